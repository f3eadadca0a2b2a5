using System;
using System.Runtime.InteropServices;
using Defrec.Native;

namespace Defrec
{
    /// <summary>One raw camera, in OpenCV's terms.</summary>
    public sealed class Intrinsics
    {
        /// <summary>Focal length in x, px.</summary>
        public double Fx { get; set; }
        /// <summary>Focal length in y, px.</summary>
        public double Fy { get; set; }
        /// <summary>Principal point, x, px; (0, 0) is the centre of the top-left pixel.</summary>
        public double Cx { get; set; }
        /// <summary>Principal point, y, px.</summary>
        public double Cy { get; set; }
        /// <summary>
        /// 0, 4, 5, 8, 12 or 14 numbers in OpenCV's order: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tx
        /// ty.
        /// </summary>
        public double[] Distortion { get; set; } = new double[0];

        /// <summary>All zero.</summary>
        public Intrinsics() { }

        /// <summary>A camera with these numbers.</summary>
        public Intrinsics(double fx, double fy, double cx, double cy, params double[] distortion)
        {
            Fx = fx;
            Fy = fy;
            Cx = cx;
            Cy = cy;
            Distortion = distortion;
        }

        internal unsafe void Write(defrec_intrinsics* native)
        {
            const int Most = 14;
            Check.NotNull(Distortion, nameof(Distortion));
            if (Distortion.Length > Most)
                throw new ArgumentException(
                    "The length is " + Distortion.Length + "; 0, 4, 5, 8, 12 or 14 expected.",
                    nameof(Distortion));
            native->fx = Fx;
            native->fy = Fy;
            native->cx = Cx;
            native->cy = Cy;
            for (int i = 0; i < Distortion.Length; ++i) native->distortion[i] = Distortion[i];
            native->distortion_count = (uint)Distortion.Length;
        }
    }

    /// <summary>Calibration of two cameras, as OpenCV's stereoCalibrate gives it.</summary>
    public sealed class RigDescription
    {
        /// <summary>
        /// Width of the raw images, px, <see cref="Constants.MinWidth"/> to
        /// <see cref="Constants.MaxSide"/>.
        /// </summary>
        public int Width { get; set; }
        /// <summary>
        /// Height of the raw images, px, <see cref="Constants.MinHeight"/> to
        /// <see cref="Constants.MaxSide"/>.
        /// </summary>
        public int Height { get; set; }
        /// <summary>The left camera.</summary>
        public Intrinsics Left { get; set; }
        /// <summary>The right camera.</summary>
        public Intrinsics Right { get; set; }
        /// <summary>3x3 row by row: x_right = Rotation * x_left + Translation.</summary>
        public double[] Rotation { get; set; } = { 1, 0, 0, 0, 1, 0, 0, 0, 1 };
        /// <summary>mm; x &lt; 0 for a right camera on the right.</summary>
        public double[] Translation { get; set; } = new double[3];

        /// <summary>
        /// Two cameras that are rectified already: frames are used as they are, without resampling,
        /// unless the camera has a disparity offset.
        /// </summary>
        public static RigDescription Rectified(int width, int height, Camera camera)
        {
            return new RigDescription {
                Width = width,
                Height = height,
                Left = new Intrinsics(camera.Fx, camera.Fy, camera.Cx, camera.Cy),
                Right = new Intrinsics(
                    camera.Fx, camera.Fy, camera.Cx + camera.DisparityOffsetPx, camera.Cy),
                Translation = new[] { -camera.BaselineMm, 0, 0 },
            };
        }
    }

    /// <summary>Two calibrated cameras and their rectification. Any thread.</summary>
    public sealed unsafe class Rig : IDisposable
    {
        internal readonly RigHandle Handle;
        private readonly double[] rotation = new double[9];

        /// <summary>
        /// Checks the calibration (finite, focal lengths over 0, a rotation, a horizontal baseline,
        /// monotone distortion) and computes the rectification (Bouguet's, as OpenCV's
        /// stereoRectify).
        /// </summary>
        /// <exception cref="ArgumentException">
        /// An argument is null, or an array of the wrong length.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The context was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The calibration cannot be: the error message names the number.
        /// </exception>
        public Rig(Context context, RigDescription description)
        {
            Check.NotNull(context, nameof(context));
            Check.NotNull(description, nameof(description));
            Check.NotNull(description.Left, "description.Left");
            Check.NotNull(description.Right, "description.Right");
            var desc = new defrec_rig_desc {
                struct_size = (uint)sizeof(defrec_rig_desc),
                width = Size(description.Width, "description.Width"),
                height = Size(description.Height, "description.Height"),
            };
            description.Left.Write(&desc.left);
            description.Right.Write(&desc.right);
            CopyExactly(description.Rotation, desc.rotation, 9, "description.Rotation");
            CopyExactly(description.Translation, desc.translation, 3, "description.Translation");

            Handle = new RigHandle(context.Handle.Log);
            using (var use = new HandleUse(context.Handle))
            {
                IntPtr native;
                DefrecException.ThrowIfFailed(
                    NativeMethods.defrec_rig_create(use.Native, &desc, &native));
                Handle.Adopt(native);
            }
            try
            {
                ReadInfo();
            }
            catch
            {
                Handle.Dispose();
                throw;
            }
        }

        /// <summary>Frames are rectified already and not resampled.</summary>
        public bool IsIdentity { get; private set; }
        /// <summary>Width of the rectified images, px.</summary>
        public int Width { get; private set; }
        /// <summary>Height of the rectified images, px.</summary>
        public int Height { get; private set; }
        /// <summary>Pinhole of the rectified images.</summary>
        public Camera Camera { get; private set; }

        /// <summary>3x3 row by row: x_rectified = rotation * x_left_raw. A new array.</summary>
        public double[] GetRotation() { return (double[])rotation.Clone(); }

        /// <summary>
        /// Maps pixels (u, v, u, v, ...) of the raw left image to the rectified left image; NaN
        /// where there is no answer. Both may be one array.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// An array is null, of odd length, or rectifiedUv is shorter than rawUv.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The rig was disposed.</exception>
        public void RectifyPixels(double[] rawUv, double[] rectifiedUv)
        {
            Check.NotNull(rawUv, nameof(rawUv));
            Check.NotNull(rectifiedUv, nameof(rectifiedUv));
            int count = Check.Groups(rawUv.Length, 2, nameof(rawUv));
            Check.Length(rectifiedUv.Length, rawUv.Length, nameof(rectifiedUv));
            fixed (double* from = rawUv, to = rectifiedUv) Map(true, from, count, to);
        }

        /// <summary>
        /// Maps pixels (u, v, u, v, ...) of the rectified left image to the raw one; NaN where
        /// there is no answer. Both may be one array.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// An array is null, of odd length, or rawUv is shorter than rectifiedUv.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The rig was disposed.</exception>
        public void DistortPixels(double[] rectifiedUv, double[] rawUv)
        {
            Check.NotNull(rectifiedUv, nameof(rectifiedUv));
            Check.NotNull(rawUv, nameof(rawUv));
            int count = Check.Groups(rectifiedUv.Length, 2, nameof(rectifiedUv));
            Check.Length(rawUv.Length, rectifiedUv.Length, nameof(rawUv));
            fixed (double* from = rectifiedUv, to = rawUv) Map(false, from, count, to);
        }

#if NETSTANDARD2_1
        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// A span is of odd length, or rectifiedUv is shorter than rawUv.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The rig was disposed.</exception>
        public void RectifyPixels(ReadOnlySpan<double> rawUv, Span<double> rectifiedUv)
        {
            int count = Check.Groups(rawUv.Length, 2, nameof(rawUv));
            Check.Length(rectifiedUv.Length, rawUv.Length, nameof(rectifiedUv));
            fixed (double* from = &MemoryMarshal.GetReference(rawUv),
                   to = &MemoryMarshal.GetReference(rectifiedUv))
                Map(true, from, count, to);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// A span is of odd length, or rawUv is shorter than rectifiedUv.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The rig was disposed.</exception>
        public void DistortPixels(ReadOnlySpan<double> rectifiedUv, Span<double> rawUv)
        {
            int count = Check.Groups(rectifiedUv.Length, 2, nameof(rectifiedUv));
            Check.Length(rawUv.Length, rectifiedUv.Length, nameof(rawUv));
            fixed (double* from = &MemoryMarshal.GetReference(rectifiedUv),
                   to = &MemoryMarshal.GetReference(rawUv))
                Map(false, from, count, to);
        }
#endif

        /// <summary>What was made from the rig goes on living.</summary>
        public void Dispose() { Handle.Dispose(); }

        private void ReadInfo()
        {
            using (var use = new HandleUse(Handle))
            {
                var info = new defrec_rig_info { struct_size = (uint)sizeof(defrec_rig_info) };
                DefrecException.ThrowIfFailed(NativeMethods.defrec_rig_get(use.Native, &info));
                IsIdentity = info.identity != 0;
                Width = (int)info.width;
                Height = (int)info.height;
                Camera = info.camera;
                for (int i = 0; i < rotation.Length; ++i) rotation[i] = info.rotation[i];
            }
        }

        private void Map(bool rectify, double* from, int count, double* to)
        {
            using (var use = new HandleUse(Handle))
            {
                if (count == 0) return;
                DefrecException.ThrowIfFailed(
                    rectify ? NativeMethods.defrec_rig_rectify_pixels(
                                  use.Native, from, (UIntPtr)(uint)count, to)
                            : NativeMethods.defrec_rig_distort_pixels(
                                  use.Native, from, (UIntPtr)(uint)count, to));
            }
        }

        private static uint Size(int size, string name)
        {
            if (size < 0)
                throw new ArgumentOutOfRangeException(name, size, "An image has no negative size.");
            return (uint)size;
        }

        private static void CopyExactly(double[] from, double* to, int count, string name)
        {
            Check.NotNull(from, name);
            if (from.Length != count)
                throw new ArgumentException(
                    "The length is " + from.Length + "; " + count + " expected.", name);
            for (int i = 0; i < count; ++i) to[i] = from[i];
        }
    }
}

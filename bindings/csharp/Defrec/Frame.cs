using System;
using Defrec.Native;

namespace Defrec
{
    /// <summary>
    /// Pixels, rows from the top: in an array, somewhere else in host memory, or in a
    /// <see cref="DeviceMemory"/>. Holds them, copies nothing; <c>default(Image)</c> is no image.
    /// </summary>
    public unsafe struct Image
    {
        private readonly byte[] array;
        private readonly IntPtr address;

        /// <summary>How the pixels lie in memory.</summary>
        public PixelFormat Format { get; }
        /// <summary>px.</summary>
        public int Width { get; }
        /// <summary>px.</summary>
        public int Height { get; }
        /// <summary>Bytes from row to row; 0: rows without gaps.</summary>
        public long Stride { get; }
        /// <summary>Where the pixels lie, from its first byte; null: in host memory.</summary>
        public DeviceMemory Memory { get; }

        /// <summary>
        /// Pixels in an array of stride * (height - 1) + width * bytes per pixel bytes, or more.
        /// stride in bytes; 0: rows without gaps.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// pixels is null or too short, or a number is out of its range.
        /// </exception>
        public Image(byte[] pixels, int width, int height, PixelFormat format, long stride = 0)
            : this(width, height, format, stride)
        {
            Check.NotNull(pixels, nameof(pixels));
            long row = (long)width * BytesPerPixel(format);
            if (stride != 0 && stride < row)
                throw new ArgumentException(
                    "The stride is " + stride + "; a row has " + row + " bytes.", nameof(stride));
            long step = stride == 0 ? row : stride;
            // A row's worth per row is there whatever the stride, so that the product below stays
            // within 64 bits.
            if (step > pixels.Length && height > 1)
                throw new ArgumentException(
                    "The array has " + pixels.Length + " bytes; rows are " + step + " bytes apart.",
                    nameof(pixels));
            Check.Length(pixels.Length, step * (height - 1) + row, nameof(pixels));
            array = pixels;
        }

        /// <summary>
        /// Pixels in host memory that is not the garbage collector's: a grabber's buffer. The
        /// caller answers for its size.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// pixels is zero, or a number is out of its range.
        /// </exception>
        public Image(IntPtr pixels, int width, int height, PixelFormat format, long stride = 0)
            : this(width, height, format, stride)
        {
            if (pixels == IntPtr.Zero) throw new ArgumentNullException(nameof(pixels));
            address = pixels;
        }

        /// <summary>
        /// Pixels that the tracker's device reads where they lie. stride 0: the tracker's
        /// <see cref="TrackerOptions.MemoryStride"/>.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// memory is null, or a number is out of its range.
        /// </exception>
        public Image(
            DeviceMemory memory, int width, int height, PixelFormat format, long stride = 0)
            : this(width, height, format, stride)
        {
            Check.NotNull(memory, nameof(memory));
            Memory = memory;
        }

        private Image(int width, int height, PixelFormat format, long stride)
        {
            if (width < 1 || width > Constants.MaxSide)
                throw new ArgumentOutOfRangeException(nameof(width), width, "1 to 8192 expected.");
            if (height < 1 || height > Constants.MaxSide)
                throw new ArgumentOutOfRangeException(
                    nameof(height), height, "1 to 8192 expected.");
            if (stride < 0)
                throw new ArgumentOutOfRangeException(
                    nameof(stride), stride, "0 or more expected: rows come from the top.");
            BytesPerPixel(format);
            array = null;
            address = IntPtr.Zero;
            Format = format;
            Width = width;
            Height = height;
            Stride = stride;
            Memory = null;
        }

        /// <summary>Whether there is an image.</summary>
        public bool IsGiven => Width > 0;

        /// <summary>
        /// Tells from two consecutive images of one view how the rows of their video follow each
        /// other in time. A cut between them may deceive it, so ask about several pairs. Any
        /// thread.
        /// </summary>
        /// <exception cref="ArgumentException">An image is not given.</exception>
        /// <exception cref="DefrecException">
        /// The images differ in size or format, or lie in a <see cref="DeviceMemory"/>.
        /// </exception>
        public static Scan DetectScan(Image earlier, Image later)
        {
            if (!earlier.IsGiven)
                throw new ArgumentException("There is no image.", nameof(earlier));
            if (!later.IsGiven) throw new ArgumentException("There is no image.", nameof(later));
            using (var earlierUse = new HandleUse(earlier.Memory?.Handle))
            using (var laterUse = new HandleUse(later.Memory?.Handle))
            fixed (byte* earlierPixels = earlier.array, laterPixels = later.array)
            {
                defrec_image first = earlier.Native(earlierPixels, earlierUse.Native);
                defrec_image second = later.Native(laterPixels, laterUse.Native);
                uint scan;
                DefrecException.ThrowIfFailed(
                    NativeMethods.defrec_detect_scan(&first, &second, &scan));
                return (Scan)scan;
            }
        }

        internal byte[] Array => array;

        /// <summary>pinned: where Array lies, null if there is none.</summary>
        internal defrec_image Native(byte* pinned, IntPtr memory)
        {
            return new defrec_image {
                struct_size = (uint)sizeof(defrec_image),
                format = Format,
                width = (uint)Width,
                height = (uint)Height,
                stride = (ulong)Stride,
                pixels = pinned != null ? pinned : (void*)address,
                memory = memory,
            };
        }

        private static int BytesPerPixel(PixelFormat format)
        {
            switch (format)
            {
                case PixelFormat.Gray8: return 1;
                case PixelFormat.Bgr8:
                case PixelFormat.Rgb8: return 3;
                case PixelFormat.Bgra8: return 4;
                default:
                    throw new ArgumentOutOfRangeException(
                        nameof(format), format, "Gray8, Bgr8, Rgb8 or Bgra8 expected.");
            }
        }
    }

    /// <summary>What a tracker is given at one time.</summary>
    public struct Frame
    {
        /// <summary>ns, strictly growing from frame to frame of a tracker, of any clock.</summary>
        public long TimestampNs { get; set; }
        /// <summary>The rig's size, the tracker's format.</summary>
        public Image Left { get; set; }
        /// <summary>The rig's size, the tracker's format.</summary>
        public Image Right { get; set; }
        /// <summary>
        /// Gray8, the rig's size: nonzero pixels of the left image are not tissue. <c>default</c>:
        /// none.
        /// </summary>
        public Image Ignore { get; set; }
        /// <summary>
        /// Make this frame the template. The first usable frame is, unless one was set.
        /// </summary>
        public bool CaptureTemplate { get; set; }
        /// <summary>
        /// Where the device leaves a <see cref="SurfaceSample"/> per template vertex; null:
        /// nowhere. Too small is how the job fails.
        /// </summary>
        public DeviceMemory Samples { get; set; }
        /// <summary>
        /// ns from the call of <see cref="Tracker.Submit(Frame)"/> until the job is to be done; 0:
        /// no deadline. What is not expected to fit is left out: <see cref="Reasons.Coarse"/>,
        /// <see cref="Reasons.Unchecked"/>, in this order. A late job has
        /// <see cref="Reasons.Overdue"/>.
        /// </summary>
        public ulong DeadlineNs { get; set; }
        /// <summary>
        /// Rectified camera from template frame, of what holds the body (a bone, the base of the
        /// tissue). It carries the depth beneath the surface, instead of what is estimated from the
        /// surface; null: not known.
        /// </summary>
        public RigidTransform? HeldMotion { get; set; }
        /// <summary>
        /// Fixed frame (a navigation system's) from rectified camera, at the frame's time. Given
        /// with every frame from the template's on, it tells the motion of the tissue from that of
        /// the camera; null: not known.
        /// </summary>
        public RigidTransform? CameraPose { get; set; }
        /// <summary>
        /// The rows of both images that are of this frame's time. The others are not read but
        /// interpolated. An interlaced image is submitted twice, once for each field in the order
        /// of their times, half a frame period apart.
        /// </summary>
        public FrameField Field { get; set; }
        /// <summary>
        /// px per pixel of the rectified left image, row by row, that a learned stereo network or a
        /// depth camera gave, in place of stage stereo; 0: none there; null: stage stereo measures
        /// it. Where it is not that of both images the frame has <see cref="Reasons.Disparity"/>.
        /// </summary>
        public float[] Disparity { get; set; }
        /// <summary>
        /// With <see cref="Disparity"/>, standard deviation of the error that a pixel shares with
        /// those around it, px; 0 with <see cref="DisparitySigma"/>.
        /// </summary>
        public float DisparitySigmaPx { get; set; }
        /// <summary>
        /// The same per pixel that has disparity; null: <see cref="DisparitySigmaPx"/> at all.
        /// </summary>
        public float[] DisparitySigma { get; set; }

        /// <summary>A pair of images.</summary>
        public Frame(Image left, Image right, long timestampNs) : this()
        {
            Left = left;
            Right = right;
            TimestampNs = timestampNs;
        }
    }
}

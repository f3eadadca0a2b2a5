using System;
using System.Runtime.InteropServices;
using System.Threading;
using Defrec.Native;

namespace Defrec
{
    /// <summary>
    /// The surface that a tracker follows: its shape in the template frame, and what it looks like,
    /// which do not change, and the elastic body that it belongs to. Any thread.
    /// </summary>
    public sealed unsafe class Template : IDisposable
    {
        internal readonly TemplateHandle Handle;

        private Template(TemplateHandle handle) { Handle = handle; }

        /// <summary>Owns the handle, also where it throws.</summary>
        internal static Template Of(TemplateHandle handle)
        {
            var template = new Template(handle);
            try
            {
                defrec_template_info info;
                using (var use = new HandleUse(handle)) info = Read(use);
                template.Width = (int)info.width;
                template.Height = (int)info.height;
                template.Camera = info.camera;
                template.VertexCount = Check.ArrayLength(info.vertex_count, 1);
                template.TriangleCount = Check.ArrayLength(info.triangle_count, 1);
                template.NodeCount = Check.ArrayLength(info.node_count, 1);
                template.EdgeCount = Check.ArrayLength(info.edge_count, 1);
                template.LandmarkCount = Check.ArrayLength(info.landmark_count, 1);
                template.PatchCount = Check.ArrayLength(info.patch_count, 1);
                template.CutPointCount = Check.ArrayLength(info.cut_point_count, 1);
                template.PieceCount = Check.ArrayLength(info.piece_count, 1);
                return template;
            }
            catch
            {
                handle.Dispose();
                throw;
            }
        }

        /// <summary>Reads a template that <see cref="Save"/> has written.</summary>
        /// <exception cref="ArgumentNullException">An argument is null.</exception>
        /// <exception cref="ObjectDisposedException">The context was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The file cannot be read, or holds no template (<see cref="Status.ErrorIo"/>).
        /// </exception>
        public static Template Load(Context context, string path)
        {
            Check.NotNull(context, nameof(context));
            Check.NotNull(path, nameof(path));
            var handle = new TemplateHandle(context.Handle.Log);
            fixed (byte* file = Utf8.Bytes(path, nameof(path)))
            using (var use = new HandleUse(context.Handle))
            {
                IntPtr native;
                DefrecException.ThrowIfFailed(
                    NativeMethods.defrec_template_load(use.Native, file, &native));
                handle.Adopt(native);
            }
            return Of(handle);
        }

        /// <summary>Width of the rectified image it was taken from, px.</summary>
        public int Width { get; private set; }
        /// <summary>Height of the rectified image it was taken from, px.</summary>
        public int Height { get; private set; }
        /// <summary>Pinhole of the rectified images.</summary>
        public Camera Camera { get; private set; }
        /// <summary>Vertices of the surface.</summary>
        public int VertexCount { get; private set; }
        /// <summary>Triangles of the surface.</summary>
        public int TriangleCount { get; private set; }
        /// <summary>Control points.</summary>
        public int NodeCount { get; private set; }
        /// <summary>Connections between control points.</summary>
        public int EdgeCount { get; private set; }
        /// <summary>Features to match to.</summary>
        public int LandmarkCount { get; private set; }
        /// <summary>Pieces of its image that are searched in each frame.</summary>
        public int PatchCount { get; private set; }
        /// <summary>Points of the lines along which tissue came apart.</summary>
        public int CutPointCount { get; private set; }
        /// <summary>Pieces of the surface that nothing joins, at most 8.</summary>
        public int PieceCount { get; private set; }

        /// <summary>Its vertices. A new array.</summary>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        public SurfacePoint[] GetVertices()
        {
            var copy = new SurfacePoint[VertexCount];
            using (var use = new HandleUse(Handle))
            fixed (SurfacePoint* to = copy)
                NativeArray.Copy(Read(use).vertices, to, copy.Length, sizeof(SurfacePoint));
            return copy;
        }

        /// <summary>
        /// Three vertex indices per triangle, counter-clockwise seen from the camera; three times
        /// the same where a cut crosses it. A new array.
        /// </summary>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        public uint[] GetTriangles()
        {
            var copy = new uint[Check.ArrayLength((ulong)TriangleCount, 3)];
            using (var use = new HandleUse(Handle))
            fixed (uint* to = copy)
                NativeArray.Copy(Read(use).triangles, to, copy.Length, sizeof(uint));
            return copy;
        }

        /// <summary>xyz per control point, template frame, mm. A new array.</summary>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        public float[] GetNodes()
        {
            var copy = new float[Check.ArrayLength((ulong)NodeCount, 3)];
            using (var use = new HandleUse(Handle))
            fixed (float* to = copy)
                NativeArray.Copy(Read(use).nodes, to, copy.Length, sizeof(float));
            return copy;
        }

        /// <summary>Connections between control points. A new array.</summary>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        public Edge[] GetEdges()
        {
            var copy = new Edge[EdgeCount];
            using (var use = new HandleUse(Handle))
            fixed (Edge* to = copy)
                NativeArray.Copy(Read(use).edges, to, copy.Length, sizeof(Edge));
            return copy;
        }

        /// <summary>Features to match to. A new array.</summary>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        public Landmark[] GetLandmarks()
        {
            var copy = new Landmark[LandmarkCount];
            using (var use = new HandleUse(Handle))
            fixed (Landmark* to = copy)
                NativeArray.Copy(Read(use).landmarks, to, copy.Length, sizeof(Landmark));
            return copy;
        }

        /// <summary>Pieces of its image. A new array.</summary>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        public Patch[] GetPatches()
        {
            var copy = new Patch[PatchCount];
            using (var use = new HandleUse(Handle))
            fixed (Patch* to = copy)
                NativeArray.Copy(Read(use).patches, to, copy.Length, sizeof(Patch));
            return copy;
        }

        /// <summary>
        /// Points of the lines along which tissue came apart (<see cref="Reasons.Cut"/>), one line
        /// after the other. A new array.
        /// </summary>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        public CutPoint[] GetCutPoints()
        {
            var copy = new CutPoint[CutPointCount];
            using (var use = new HandleUse(Handle))
            fixed (CutPoint* to = copy)
                NativeArray.Copy(Read(use).cut_points, to, copy.Length, sizeof(CutPoint));
            return copy;
        }

        /// <summary>Piece of the surface per vertex, from 0. A new array.</summary>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        public byte[] GetVertexPieces()
        {
            var copy = new byte[VertexCount];
            using (var use = new HandleUse(Handle))
            fixed (byte* to = copy)
                NativeArray.Copy(Read(use).vertex_pieces, to, copy.Length, sizeof(byte));
            return copy;
        }

        /// <summary>Width * Height gray values of the rectified left image. A new array.</summary>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        public byte[] GetImage()
        {
            var copy = new byte[Width * Height];
            using (var use = new HandleUse(Handle))
            fixed (byte* to = copy)
                NativeArray.Copy(Read(use).image, to, copy.Length, sizeof(byte));
            return copy;
        }

        /// <summary>
        /// Finds the surface points under pixels (u, v, u, ...) of the rectified left image that
        /// gave the template: xyz, mm, template frame, and whether there is one; where there is
        /// none xyz is 0. Pixels of the raw image:
        /// <see cref="Rig.RectifyPixels(double[], double[])"/> first.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// An array is null or too short, or uv of odd length.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        public void Lift(double[] uv, double[] xyz, bool[] found)
        {
            Check.NotNull(uv, nameof(uv));
            Check.NotNull(xyz, nameof(xyz));
            Check.NotNull(found, nameof(found));
            int count = Check.Groups(uv.Length, 2, nameof(uv));
            Check.Length(xyz.Length, 3L * count, nameof(xyz));
            Check.Length(found.Length, count, nameof(found));
            fixed (double* from = uv, to = xyz)
            fixed (bool* flags = found) Lift(from, count, to, (byte*)flags);
        }

#if NETSTANDARD2_1
        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// A span is too short, or uv of odd length.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        public void Lift(ReadOnlySpan<double> uv, Span<double> xyz, Span<bool> found)
        {
            int count = Check.Groups(uv.Length, 2, nameof(uv));
            Check.Length(xyz.Length, 3L * count, nameof(xyz));
            Check.Length(found.Length, count, nameof(found));
            fixed (
                double* from = &MemoryMarshal.GetReference(uv),
                to = &MemoryMarshal.GetReference(xyz))
            fixed (bool* flags = &MemoryMarshal.GetReference(found))
                Lift(from, count, to, (byte*)flags);
        }
#endif

        /// <summary>
        /// Which piece of the surface points (x, y, z, x, ...) of the template frame, mm, belong
        /// to, on the surface or off it: 0 to PieceCount - 1; 255 for a point that is not finite.
        /// <see cref="Job.WarpPoints(double[], double[], PointStatus[], double[])"/> moves them
        /// with that piece.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// An array is null or too short, or templateXyz not a multiple of 3 long.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        public void GetPointPieces(double[] templateXyz, byte[] pieces)
        {
            Check.NotNull(templateXyz, nameof(templateXyz));
            Check.NotNull(pieces, nameof(pieces));
            int count = Check.Groups(templateXyz.Length, 3, nameof(templateXyz));
            Check.Length(pieces.Length, count, nameof(pieces));
            fixed (double* from = templateXyz)
            fixed (byte* to = pieces) GetPointPieces(from, count, to);
        }

#if NETSTANDARD2_1
        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// A span is too short, or templateXyz not a multiple of 3 long.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        public void GetPointPieces(ReadOnlySpan<double> templateXyz, Span<byte> pieces)
        {
            int count = Check.Groups(templateXyz.Length, 3, nameof(templateXyz));
            Check.Length(pieces.Length, count, nameof(pieces));
            fixed (double* from = &MemoryMarshal.GetReference(templateXyz))
            fixed (byte* to = &MemoryMarshal.GetReference(pieces)) GetPointPieces(from, count, to);
        }
#endif

        /// <summary>
        /// Sets the body that the surface belongs to, from then on and in all trackers that follow
        /// it or what it becomes by growing or by a cut; null: the tissue beneath the surface.
        /// Everything is copied. A body that is being computed is given up, and that before is used
        /// until the new one is ready. Saved with the template.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// An array or a region is null, or an array not a multiple of 3 long.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        /// <exception cref="DefrecException">
        /// A number is out of its range, or a mesh is not closed, is inside out, intersects itself,
        /// has a size that is not one in mm, or does not meet the surface
        /// (<see cref="Status.ErrorArgument"/>).
        /// </exception>
        public void SetBody(BodyDescription body)
        {
            using (var pinned = body == null ? null : new PinnedBody(body))
            using (var use = new HandleUse(Handle))
                DefrecException.ThrowIfFailed(NativeMethods.defrec_template_set_body(
                    use.Native, pinned == null ? null : pinned.Desc));
        }

        /// <summary>
        /// Waits until the body beneath the surface is ready; starts computing it where nobody has.
        /// </summary>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        /// <exception cref="DefrecException">
        /// No body can be made of it (<see cref="Status.ErrorUnsupported"/>).
        /// </exception>
        public void WaitForBody() { WaitForBody(Timeout.InfiniteTimeSpan); }

        /// <summary>
        /// Likewise, or until the time is over: then false. Zero only asks;
        /// Timeout.InfiniteTimeSpan waits for ever. Once it is ready, what is asked of a frame's
        /// points depends on the frames alone and not on time.
        /// </summary>
        /// <exception cref="ArgumentOutOfRangeException">The time is negative.</exception>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        /// <exception cref="DefrecException">
        /// No body can be made of it (<see cref="Status.ErrorUnsupported"/>).
        /// </exception>
        public bool WaitForBody(TimeSpan timeout)
        {
            ulong timeoutNs = Check.Nanoseconds(timeout, nameof(timeout));
            using (var use = new HandleUse(Handle))
            {
                Status status = NativeMethods.defrec_template_wait_body(use.Native, timeoutNs);
                DefrecException.ThrowIfFailed(status);
                return status != Status.Timeout;
            }
        }

        /// <summary>
        /// Writes a file that holds the template; its layout is versioned and checked on loading.
        /// </summary>
        /// <exception cref="ArgumentNullException">path is null.</exception>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The file cannot be written (<see cref="Status.ErrorIo"/>).
        /// </exception>
        public void Save(string path)
        {
            Check.NotNull(path, nameof(path));
            fixed (byte* file = Utf8.Bytes(path, nameof(path)))
            using (var use = new HandleUse(Handle))
                DefrecException.ThrowIfFailed(NativeMethods.defrec_template_save(use.Native, file));
        }

        /// <summary>Trackers that follow it go on.</summary>
        public void Dispose() { Handle.Dispose(); }

        private void Lift(double* from, int count, double* to, byte* found)
        {
            using (var use = new HandleUse(Handle))
            {
                if (count == 0) return;
                DefrecException.ThrowIfFailed(NativeMethods.defrec_template_lift(
                    use.Native, from, (UIntPtr)(uint)count, to, found));
            }
        }

        private void GetPointPieces(double* from, int count, byte* to)
        {
            using (var use = new HandleUse(Handle))
            {
                if (count == 0) return;
                DefrecException.ThrowIfFailed(NativeMethods.defrec_template_point_pieces(
                    use.Native, from, (UIntPtr)(uint)count, to));
            }
        }

        private static defrec_template_info Read(HandleUse use)
        {
            var info =
                new defrec_template_info { struct_size = (uint)sizeof(defrec_template_info) };
            DefrecException.ThrowIfFailed(NativeMethods.defrec_template_get(use.Native, &info));
            return info;
        }
    }
}

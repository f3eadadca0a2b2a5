using System;
using Defrec.Native;

namespace Defrec
{
    /// <summary>
    /// Places of points when a frame is shown, from how they moved in the frames until then. Add
    /// every frame, then ask. Any thread.
    /// </summary>
    public sealed unsafe class Predictor : IDisposable
    {
        internal readonly PredictorHandle Handle;

        /// <summary>pointCount: 1 to 1,000,000 points, the same ones in all frames.</summary>
        /// <exception cref="DefrecException">
        /// pointCount is out of range (<see cref="Status.ErrorArgument"/>).
        /// </exception>
        public Predictor(int pointCount)
        {
            Handle = new PredictorHandle();
            var desc = new defrec_predictor_desc {
                struct_size = (uint)sizeof(defrec_predictor_desc),
                point_count = unchecked((ulong)pointCount)
            };
            IntPtr native;
            DefrecException.ThrowIfFailed(NativeMethods.defrec_predictor_create(&desc, &native));
            Handle.Adopt(native);
            PointCount = pointCount;
        }

        /// <summary>How many points there are.</summary>
        public int PointCount { get; }

        /// <summary>
        /// Tells where the points were in a frame: what <see cref="Job.MovePlan"/> and those beside
        /// it gave, with timestampNs, state and epoch of its <see cref="FrameResult"/>. Each frame,
        /// in the order of time, also those that are lost. xyz: x, y, z of each, mm; it and status
        /// may be null in a frame that is lost or has no template. expectedErrorMm: of each; null:
        /// 0. Motion before a frame that is lost, has no template or another epoch, or comes after
        /// a gap, is forgotten; so is that of a point before it was unknown, or jumped.
        /// </summary>
        /// <exception cref="ArgumentException">An array is too short.</exception>
        /// <exception cref="ObjectDisposedException">The predictor was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The time does not grow, an array is missing or a number is not finite
        /// (<see cref="Status.ErrorArgument"/>); the predictor stays as it was.
        /// </exception>
        public void AddFrame(
            long timestampNs, FrameState state, uint epoch, double[] xyz, PointStatus[] status,
            double[] expectedErrorMm = null)
        {
            if (xyz != null) Check.Length(xyz.Length, 3L * PointCount, nameof(xyz));
            if (status != null) Check.Length(status.Length, PointCount, nameof(status));
            if (expectedErrorMm != null)
                Check.Length(expectedErrorMm.Length, PointCount, nameof(expectedErrorMm));
            fixed (double* places = xyz, errors = expectedErrorMm)
            fixed (PointStatus* statuses = status)
            using (var use = new HandleUse(Handle))
            {
                var frame = new defrec_predictor_frame {
                    struct_size = (uint)sizeof(defrec_predictor_frame),
                    state = state,
                    epoch = epoch,
                    timestamp_ns = timestampNs,
                    xyz = places,
                    status = (byte*)statuses,
                    expected_error_mm = errors,
                    count = (ulong)PointCount
                };
                DefrecException.ThrowIfFailed(
                    NativeMethods.defrec_predictor_add_frame(use.Native, &frame));
            }
        }

        /// <summary>
        /// Places of the points at a time from that of the last frame to
        /// <see cref="Constants.MaxPredictionMs"/> after it, of the same clock: xyz, mm; status,
        /// that of the last frame; expectedErrorMm, that of the last frame and never less later;
        /// basis, what each prediction rests on. All but xyz may be null. A point that is unknown
        /// in the last frame stays so.
        /// </summary>
        /// <exception cref="ArgumentException">xyz is null, or an array too short.</exception>
        /// <exception cref="ObjectDisposedException">The predictor was disposed.</exception>
        /// <exception cref="DefrecException">
        /// No frame was added yet (<see cref="Status.ErrorState"/>), or it is another time
        /// (<see cref="Status.ErrorArgument"/>): show then that the points are not known.
        /// </exception>
        public void Predict(
            long timestampNs, double[] xyz, PointStatus[] status = null,
            double[] expectedErrorMm = null, PredictionBasis[] basis = null)
        {
            Check.NotNull(xyz, nameof(xyz));
            Check.Length(xyz.Length, 3L * PointCount, nameof(xyz));
            if (status != null) Check.Length(status.Length, PointCount, nameof(status));
            if (expectedErrorMm != null)
                Check.Length(expectedErrorMm.Length, PointCount, nameof(expectedErrorMm));
            if (basis != null) Check.Length(basis.Length, PointCount, nameof(basis));
            fixed (double* to = xyz, errors = expectedErrorMm)
            fixed (PointStatus* statuses = status)
            fixed (PredictionBasis* bases = basis)
            using (var use = new HandleUse(Handle))
                DefrecException.ThrowIfFailed(NativeMethods.defrec_predictor_predict(
                    use.Native, timestampNs, (UIntPtr)(uint)PointCount, to, (byte*)statuses, errors,
                    (byte*)bases));
        }

        /// <summary>Ends the use of the predictor.</summary>
        public void Dispose() { Handle.Dispose(); }
    }
}

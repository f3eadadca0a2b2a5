using System;
using System.Threading;
using Defrec.Native;

namespace Defrec
{
    /// <summary>
    /// A submitted frame, and its result. Any thread. It holds a place in the tracker's queue until
    /// it is disposed, so dispose it as soon as the result is read; left to the finaliser, the
    /// queue stays full until the next collection.
    /// </summary>
    public sealed unsafe partial class Job : IDisposable
    {
        internal readonly JobHandle Handle;
        private readonly int pixels; // of the rectified image

        internal Job(JobHandle handle, int pixels)
        {
            Handle = handle;
            this.pixels = pixels;
        }

        /// <summary>Waits until the frame is computed.</summary>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">How the job failed.</exception>
        public void Wait() { Wait(Timeout.InfiniteTimeSpan); }

        /// <summary>
        /// Waits until the frame is computed, or the time is over: then false. Zero only asks;
        /// Timeout.InfiniteTimeSpan waits for ever. Dispose on another thread does not end a wait:
        /// the job is released when the wait returns.
        /// </summary>
        /// <exception cref="ArgumentOutOfRangeException">The time is negative.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">How the job failed.</exception>
        public bool Wait(TimeSpan timeout)
        {
            ulong timeoutNs = Check.Nanoseconds(timeout, nameof(timeout));
            using (var use = new HandleUse(Handle))
            {
                Status status = NativeMethods.defrec_job_wait(use.Native, timeoutNs);
                DefrecException.ThrowIfFailed(status);
                return status != Status.Timeout;
            }
        }

        /// <summary>State, reasons and numbers of a job that is done; allocates nothing.</summary>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public FrameSummary GetSummary()
        {
            using (var use = new HandleUse(Handle))
            {
                defrec_result result = Read(use);
                return new FrameSummary(ref result);
            }
        }

        /// <summary>The whole result of a job that is done, in new arrays.</summary>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public FrameResult GetResult()
        {
            var result = new FrameResult();
            GetResult(result);
            return result;
        }

        /// <summary>
        /// The whole result of a job that is done. Arrays that have the right length are used
        /// again: with one template, always.
        /// </summary>
        /// <exception cref="ArgumentNullException">into is null.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The job is not done, or failed; into is as it was.
        /// </exception>
        public void GetResult(FrameResult into)
        {
            Check.NotNull(into, nameof(into));
            using (var use = new HandleUse(Handle))
            {
                defrec_result result = Read(use);
                into.Fill(ref result, pixels);
            }
        }

        /// <summary>
        /// The template of the job's frame, with as many vertices as its result: the tracker's
        /// present one may have grown since.
        /// </summary>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The job is not done, failed, or its tracker has no template.
        /// </exception>
        public Template GetTemplate()
        {
            var template = new TemplateHandle(Handle.Log);
            using (var use = new HandleUse(Handle))
            {
                IntPtr native;
                DefrecException.ThrowIfFailed(
                    NativeMethods.defrec_job_get_template(use.Native, &native));
                template.Adopt(native);
            }
            return Template.Of(template);
        }

        /// <summary>
        /// Finds the points under pixels (u, v, u, ...) of the rectified left image of the job's
        /// frame: x, y, z each, mm, template frame, from where
        /// <see cref="WarpPoints(double[], double[], PointStatus[], double[])"/> follows them; 0
        /// where found is None, in a lost frame everywhere. A point that is found Beside the
        /// surface moves with the tissue next to it, extrapolated, until the surface reaches it; to
        /// have it lie on the surface from then on, lift it again where WarpPoints has it in a
        /// later frame. Arrays may be longer than needed.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// An array is null or too short, or uv of odd length.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The job is not done, failed, or its tracker has no template.
        /// </exception>
        public void LiftPoints(double[] uv, double[] xyz, Found[] found)
        {
            Check.NotNull(uv, nameof(uv));
            Check.NotNull(xyz, nameof(xyz));
            Check.NotNull(found, nameof(found));
            int count = Check.Groups(uv.Length, 2, nameof(uv));
            Check.Length(xyz.Length, 3L * count, nameof(xyz));
            Check.Length(found.Length, count, nameof(found));
            fixed (double* from = uv, to = xyz)
            fixed (Found* flags = found)
            using (var use = new HandleUse(Handle))
            {
                if (count == 0) return;
                DefrecException.ThrowIfFailed(NativeMethods.defrec_job_lift_points(
                    use.Native, from, (UIntPtr)(uint)count, to, (byte*)flags));
            }
        }

        /// <summary>
        /// Moves points (x, y, z, x, ...), mm, given in the template frame (a preoperative model,
        /// say) to the frame of this job, in the rectified camera, mm. Points on the surface move
        /// with it; points beneath it are carried by the elastic body and never Observed. status,
        /// how far to trust each, and expectedErrorMm, the root mean square of the 3D error to be
        /// expected of each, may be null. Arrays may be longer than needed.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// templateXyz or xyz is null, an array is too short, or templateXyz not a multiple of 3
        /// long.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The job is not done, failed, or its tracker has no template.
        /// </exception>
        public void WarpPoints(
            double[] templateXyz, double[] xyz, PointStatus[] status = null,
            double[] expectedErrorMm = null)
        {
            Check.NotNull(templateXyz, nameof(templateXyz));
            Check.NotNull(xyz, nameof(xyz));
            int count = Check.Groups(templateXyz.Length, 3, nameof(templateXyz));
            Check.Length(xyz.Length, templateXyz.Length, nameof(xyz));
            if (status != null) Check.Length(status.Length, count, nameof(status));
            if (expectedErrorMm != null)
                Check.Length(expectedErrorMm.Length, count, nameof(expectedErrorMm));
            fixed (double* from = templateXyz, to = xyz, error = expectedErrorMm)
            fixed (PointStatus* statuses = status) Warp(from, count, to, statuses, error);
        }

        /// <summary>
        /// Covariances of the errors of what
        /// <see cref="WarpPoints(double[], double[], PointStatus[], double[])"/> gives for points
        /// (x, y, z, x, ...), mm: xx, xy, xz, yy, yz, zz each, rectified camera, mm^2. evidence,
        /// what was observed there, may be null. Arrays may be longer than needed.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// templateXyz or covariance is null, an array is too short, or templateXyz not a multiple
        /// of 3 long.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The job is not done, failed, or its tracker has no template.
        /// </exception>
        public void GetPointCovariances(
            double[] templateXyz, double[] covariance, Evidence[] evidence = null)
        {
            Check.NotNull(templateXyz, nameof(templateXyz));
            Check.NotNull(covariance, nameof(covariance));
            int count = Check.Groups(templateXyz.Length, 3, nameof(templateXyz));
            Check.Length(covariance.Length, 6L * count, nameof(covariance));
            if (evidence != null) Check.Length(evidence.Length, count, nameof(evidence));
            fixed (double* from = templateXyz, to = covariance)
            fixed (Evidence* observed = evidence) GetCovariances(from, count, to, observed);
        }

        /// <summary>
        /// Moves prepared targets to the frame of this job, as
        /// <see cref="WarpPoints(double[], double[], PointStatus[], double[])"/> and
        /// <see cref="GetPointCovariances(double[], double[], Evidence[])"/> do, faster: x, y, z
        /// each, rectified camera, mm. status, how far to trust each, expectedErrorMm, the root
        /// mean square of the 3D error to be expected of each, and covariance, of each the error's
        /// xx, xy, xz, yy, yz, zz, mm^2, may be null. Arrays may be longer than needed.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// targets or xyz is null, or an array is too short.
        /// </exception>
        /// <exception cref="ObjectDisposedException">
        /// The job was disposed, or the targets were.
        /// </exception>
        /// <exception cref="DefrecException">
        /// The job is not done, failed, or its tracker has no template; or the targets are of a
        /// template that this frame's did not become of.
        /// </exception>
        public void MoveTargets(
            Targets targets, double[] xyz, PointStatus[] status = null,
            double[] expectedErrorMm = null, double[] covariance = null)
        {
            Check.NotNull(targets, nameof(targets));
            Check.NotNull(xyz, nameof(xyz));
            int count = targets.Count;
            Check.Length(xyz.Length, 3L * count, nameof(xyz));
            if (status != null) Check.Length(status.Length, count, nameof(status));
            if (expectedErrorMm != null)
                Check.Length(expectedErrorMm.Length, count, nameof(expectedErrorMm));
            if (covariance != null) Check.Length(covariance.Length, 6L * count, nameof(covariance));
            fixed (double* to = xyz, error = expectedErrorMm, errors = covariance)
            fixed (PointStatus* statuses = status) Move(targets, to, statuses, error, errors);
        }

        /// <summary>
        /// Moves the points of a plan to the frame of this job, its vertices and then its targets,
        /// as <see cref="MoveTargets(Targets, double[], PointStatus[], double[], double[])"/> does,
        /// with the error of the registration added to that of tracking.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// plan or xyz is null, or an array is too short.
        /// </exception>
        /// <exception cref="ObjectDisposedException">
        /// The job was disposed, or the plan was.
        /// </exception>
        /// <exception cref="DefrecException">
        /// The job is not done, failed, or its tracker has no template; or the plan is of a
        /// template that this frame's did not become of.
        /// </exception>
        public void MovePlan(
            Plan plan, double[] xyz, PointStatus[] status = null, double[] expectedErrorMm = null,
            double[] covariance = null)
        {
            Check.NotNull(plan, nameof(plan));
            Check.NotNull(xyz, nameof(xyz));
            int count = plan.PointCount;
            Check.Length(xyz.Length, 3L * count, nameof(xyz));
            if (status != null) Check.Length(status.Length, count, nameof(status));
            if (expectedErrorMm != null)
                Check.Length(expectedErrorMm.Length, count, nameof(expectedErrorMm));
            if (covariance != null) Check.Length(covariance.Length, 6L * count, nameof(covariance));
            fixed (double* to = xyz, error = expectedErrorMm, errors = covariance)
            fixed (PointStatus* statuses = status)
            using (var use = new HandleUse(Handle))
            using (var planUse = new HandleUse(plan.Handle))
            {
                if (count == 0) return;
                DefrecException.ThrowIfFailed(NativeMethods.defrec_job_move_plan(
                    use.Native, planUse.Native, (UIntPtr)(uint)count, to, errors, (byte*)statuses,
                    error));
            }
        }

        /// <summary>
        /// Carries points (x, y, z, x, ...), mm, from the rectified camera of the job's frame, as
        /// its result and the methods above give them, to the fixed frame of
        /// <see cref="Frame.CameraPose"/>. cameraCovariance, of each xx, xy, xz, yy, yz, zz as
        /// those methods give it, poseCovariance, as <see cref="HandEye.GetPoseCovariance"/> gives
        /// it, and covariance, of each the sum of both in the fixed frame, mm^2, may be null.
        /// Arrays may be longer than needed.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// cameraXyz or xyz is null, an array is too short, or cameraXyz not a multiple of 3 long.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The frame was submitted without <see cref="Frame.CameraPose"/>
        /// (<see cref="Status.ErrorState"/>), or poseCovariance is no covariance.
        /// </exception>
        public void ToFixedFrame(
            double[] cameraXyz, double[] xyz, double[] cameraCovariance = null,
            double[] covariance = null, double[] poseCovariance = null)
        {
            Check.NotNull(cameraXyz, nameof(cameraXyz));
            Check.NotNull(xyz, nameof(xyz));
            int count = Check.Groups(cameraXyz.Length, 3, nameof(cameraXyz));
            Check.Length(xyz.Length, cameraXyz.Length, nameof(xyz));
            if (cameraCovariance != null)
                Check.Length(cameraCovariance.Length, 6L * count, nameof(cameraCovariance));
            if (covariance != null) Check.Length(covariance.Length, 6L * count, nameof(covariance));
            if (poseCovariance != null)
                Check.Length(poseCovariance.Length, 36, nameof(poseCovariance));
            fixed (
                double* from = cameraXyz, to = xyz, given = cameraCovariance, made = covariance,
                pose = poseCovariance)
            using (var use = new HandleUse(Handle))
                DefrecException.ThrowIfFailed(NativeMethods.defrec_job_to_fixed_frame(
                    use.Native, pose, (UIntPtr)(uint)count, from, given, to, made));
        }

        /// <summary>Gives the job's place in the queue back; waits if it is running.</summary>
        public void Dispose() { Handle.Dispose(); }

        private void Warp(double* from, int count, double* to, PointStatus* status, double* error)
        {
            using (var use = new HandleUse(Handle))
            {
                if (count == 0) return;
                DefrecException.ThrowIfFailed(NativeMethods.defrec_job_warp_points(
                    use.Native, from, (UIntPtr)(uint)count, to, (byte*)status, error));
            }
        }

        private void GetCovariances(double* from, int count, double* covariance, Evidence* evidence)
        {
            using (var use = new HandleUse(Handle))
            {
                if (count == 0) return;
                DefrecException.ThrowIfFailed(NativeMethods.defrec_job_point_covariances(
                    use.Native, from, (UIntPtr)(uint)count, covariance, (byte*)evidence));
            }
        }

        private void Move(
            Targets targets, double* to, PointStatus* status, double* error, double* covariance)
        {
            using (var use = new HandleUse(Handle))
            using (var targetsUse = new HandleUse(targets.Handle))
            {
                if (targets.Count == 0) return;
                DefrecException.ThrowIfFailed(NativeMethods.defrec_job_move_targets(
                    use.Native, targetsUse.Native, (UIntPtr)(uint)targets.Count, to, covariance,
                    (byte*)status, error));
            }
        }

        private static int Copy(void* from, ulong count, int size, void* to, int capacity)
        {
            Check.Length(capacity, Check.ArrayLength(count, 1), "destination");
            NativeArray.Copy(from, to, (int)count, size);
            return (int)count;
        }

        // What it points to lives until the job is released, that is at least as long as use.
        private static defrec_result Read(HandleUse use)
        {
            var result = new defrec_result { struct_size = (uint)sizeof(defrec_result) };
            DefrecException.ThrowIfFailed(NativeMethods.defrec_job_result(use.Native, &result));
            return result;
        }
    }
}

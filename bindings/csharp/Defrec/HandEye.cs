using System;
using Defrec.Native;

namespace Defrec
{
    /// <summary>
    /// Poses of a camera and of the marker on it: <see cref="HandEye"/>. Zero means the default.
    /// </summary>
    public sealed class HandEyeOptions
    {
        /// <summary>World from camera each.</summary>
        public RigidTransform[] CameraPoses { get; set; } = new RigidTransform[0];
        /// <summary>
        /// Time of each, s, growing; null, as the tracker's: pose i of both belong together.
        /// </summary>
        public double[] CameraTimes { get; set; }
        /// <summary>Navigation system from marker each.</summary>
        public RigidTransform[] TrackerPoses { get; set; } = new RigidTransform[0];
        /// <summary>Time of each, s, growing, by the navigation system's clock.</summary>
        public double[] TrackerTimes { get; set; }
        /// <summary>
        /// Standard deviation along each axis of the camera's places, mm. All four errors or none:
        /// then the residuals say how large they are.
        /// </summary>
        public double CameraErrorMm { get; set; }
        /// <summary>Likewise of its rotations, about each axis, rad.</summary>
        public double CameraErrorRad { get; set; }
        /// <summary>Likewise of the marker's places, mm.</summary>
        public double TrackerErrorMm { get; set; }
        /// <summary>Likewise of its rotations, rad.</summary>
        public double TrackerErrorRad { get; set; }
        /// <summary>
        /// The navigation system's time is the camera's plus it, s; null: it is estimated.
        /// </summary>
        public double? Offset { get; set; }
        /// <summary>How far the offset is searched, s; 0 to 3600; default 2.</summary>
        public double MaxOffset { get; set; }
        /// <summary>
        /// Where the root mean square of the residuals of places is larger, the calibration has
        /// failed, mm; 0.001 to 1000; default 3.
        /// </summary>
        public double MaxResidualMm { get; set; }
        /// <summary>Likewise of rotations, rad; default 0.0349 (2 degrees).</summary>
        public double MaxResidualRad { get; set; }
        /// <summary>
        /// A motion with a larger standard deviation, 100 mm from the camera, is undetermined, mm;
        /// 0.001 to 1000; default 1.
        /// </summary>
        public double MaxErrorMm { get; set; }
        /// <summary>Likewise the offset, s; default 0.01.</summary>
        public double MaxOffsetError { get; set; }
    }

    /// <summary>
    /// Where a camera is on the marker that a navigation system sees. What fits nothing, or is not
    /// determined, throws nothing: <see cref="Verdict"/> says so. Any thread.
    /// </summary>
    public sealed unsafe class HandEye : IDisposable
    {
        internal readonly HandEyeHandle Handle;
        private readonly double[] covariance = new double[36];

        /// <summary>Finds where the camera is.</summary>
        /// <exception cref="ArgumentException">
        /// options or its poses are null, or times are not as many.
        /// </exception>
        /// <exception cref="DefrecException">
        /// A pose is none, times do not grow, or a number is out of its range
        /// (<see cref="Status.ErrorArgument"/>).
        /// </exception>
        public HandEye(HandEyeOptions options)
        {
            Check.NotNull(options, nameof(options));
            Check.NotNull(options.CameraPoses, "options.CameraPoses");
            Check.NotNull(options.TrackerPoses, "options.TrackerPoses");
            bool isPaired = options.CameraTimes == null && options.TrackerTimes == null;
            if (!isPaired)
            {
                Check.NotNull(options.CameraTimes, "options.CameraTimes");
                Check.NotNull(options.TrackerTimes, "options.TrackerTimes");
                Check.Length(
                    options.CameraTimes.Length, options.CameraPoses.Length, "options.CameraTimes");
                Check.Length(
                    options.TrackerTimes.Length, options.TrackerPoses.Length,
                    "options.TrackerTimes");
            }
            Handle = new HandEyeHandle();
            using (var pins = new Pins())
            {
                defrec_hand_eye_desc desc = Describe(options, pins);
                if (isPaired) desc.flags |= HandEyeFlags.Paired;
                IntPtr native;
                DefrecException.ThrowIfFailed(NativeMethods.defrec_hand_eye_create(&desc, &native));
                Handle.Adopt(native);
            }
            try
            {
                using (var use = new HandleUse(Handle)) Take(Read(use));
            }
            catch
            {
                Handle.Dispose();
                throw;
            }
        }

        /// <summary>Never <see cref="Defrec.Verdict.Ambiguous"/>.</summary>
        public Verdict Verdict { get; private set; }
        /// <summary>The verdict's, one sentence for people.</summary>
        public string Reason { get; private set; }
        /// <summary>Remarks for people, a line each; "" without.</summary>
        public string Notes { get; private set; }
        /// <summary>
        /// The transforms, covariance and residuals are those of the best solution; else it was
        /// refused before, and they are the identity, NaN and empty.
        /// </summary>
        public bool IsSolved { get; private set; }
        /// <summary>The camera on its marker.</summary>
        public RigidTransform MarkerFromCamera { get; private set; }
        /// <summary>The camera's world in the navigation system.</summary>
        public RigidTransform TrackerFromWorld { get; private set; }
        /// <summary>The offset was estimated.</summary>
        public bool OffsetEstimated { get; private set; }
        /// <summary>The navigation system's time is the camera's plus it, s.</summary>
        public double Offset { get; private set; }
        /// <summary>Its standard deviation, s.</summary>
        public double OffsetSigma { get; private set; }
        /// <summary>Correlation of both speeds of rotation, -1 to 1.</summary>
        public double OffsetCorrelation { get; private set; }
        /// <summary>
        /// Root mean square of the residuals at the camera, of the poses that fit, mm.
        /// </summary>
        public double RmsMm { get; private set; }
        /// <summary>Likewise, rad.</summary>
        public double RmsRad { get; private set; }
        /// <summary>Residuals in units of the errors.</summary>
        public double ErrorRatio { get; private set; }
        /// <summary>The errors as stated or estimated, mm.</summary>
        public double CameraErrorMm { get; private set; }
        /// <summary>Likewise, rad.</summary>
        public double CameraErrorRad { get; private set; }
        /// <summary>Likewise, mm.</summary>
        public double TrackerErrorMm { get; private set; }
        /// <summary>Likewise, rad.</summary>
        public double TrackerErrorRad { get; private set; }
        /// <summary>So many neighbours share an error.</summary>
        public double Correlated { get; private set; }
        /// <summary>Root mean square of the rotations against their mean, rad.</summary>
        public double TurnRad { get; private set; }
        /// <summary>That of their parts across the main axis, rad.</summary>
        public double CrossTurnRad { get; private set; }
        /// <summary>
        /// What lengths of the camera's world are to be multiplied by to be the navigation
        /// system's; not applied.
        /// </summary>
        public double LengthFactor { get; private set; }
        /// <summary>Its standard deviation.</summary>
        public double LengthFactorSigma { get; private set; }
        /// <summary>Poses of the camera that were used.</summary>
        public int Used { get; private set; }
        /// <summary>Those of them that fit.</summary>
        public int InlierCount { get; private set; }
        /// <summary>Poses of the camera that were given; 0 where nothing was solved.</summary>
        public int ResidualCount { get; private set; }
        /// <summary>Motions of the transform that the poses leave open.</summary>
        public int FreeMotionCount { get; private set; }

        /// <summary>
        /// 6x6 row by row, of the motion that the true <see cref="MarkerFromCamera"/> has after
        /// this one: a turn about x, y, z of the marker's frame and about its origin, rad, then a
        /// shift, mm. A new array.
        /// </summary>
        public double[] GetCovariance() { return (double[])covariance.Clone(); }

        /// <summary>
        /// mm, per pose of the camera: how far off its place is; NaN where it was not used. A new
        /// array.
        /// </summary>
        /// <exception cref="ObjectDisposedException">The calibration was disposed.</exception>
        public double[] GetResidualsMm()
        {
            var copy = new double[ResidualCount];
            using (var use = new HandleUse(Handle))
            fixed (double* to = copy)
                NativeArray.Copy(Read(use).residuals_mm, to, copy.Length, sizeof(double));
            return copy;
        }

        /// <summary>rad, likewise of its rotation. A new array.</summary>
        /// <exception cref="ObjectDisposedException">The calibration was disposed.</exception>
        public double[] GetResidualsRad()
        {
            var copy = new double[ResidualCount];
            using (var use = new HandleUse(Handle))
            fixed (double* to = copy)
                NativeArray.Copy(Read(use).residuals_rad, to, copy.Length, sizeof(double));
            return copy;
        }

        /// <summary>Per pose of the camera: it fits. A new array.</summary>
        /// <exception cref="ObjectDisposedException">The calibration was disposed.</exception>
        public bool[] GetInliers()
        {
            var copy = new bool[ResidualCount];
            using (var use = new HandleUse(Handle))
            fixed (bool* to = copy)
                NativeArray.Copy(Read(use).inliers, to, copy.Length, sizeof(byte));
            return copy;
        }

        /// <summary>Motions of the transform that the poses leave open. A new array.</summary>
        /// <exception cref="ObjectDisposedException">The calibration was disposed.</exception>
        public FreeMotion[] GetFreeMotions()
        {
            var made = new FreeMotion[FreeMotionCount];
            using (var use = new HandleUse(Handle))
                for (int i = 0; i < made.Length; ++i)
                {
                    var motion =
                        new defrec_free_motion { struct_size = (uint)sizeof(defrec_free_motion) };
                    DefrecException.ThrowIfFailed(NativeMethods.defrec_hand_eye_get_free_motion(
                        use.Native, (UIntPtr)(uint)i, &motion));
                    made[i] = new FreeMotion(ref motion);
                }
            return made;
        }

        /// <summary>
        /// Where the camera is for a pose of its marker, navigation system from marker: what
        /// <see cref="Frame.CameraPose"/> takes where the calibration is of the rectified camera.
        /// </summary>
        /// <exception cref="ObjectDisposedException">The calibration was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The verdict is not <see cref="Defrec.Verdict.Accepted"/>
        /// (<see cref="Status.ErrorState"/>), or the pose is none.
        /// </exception>
        public RigidTransform GetCameraPose(RigidTransform markerPose)
        {
            RigidTransform pose;
            using (var use = new HandleUse(Handle))
                DefrecException.ThrowIfFailed(NativeMethods.defrec_hand_eye_camera_pose(
                    use.Native, (double*)&markerPose, (UIntPtr)1, (double*)&pose));
            return pose;
        }

        /// <summary>
        /// How far off the pose may be that <see cref="GetCameraPose"/> gives for a pose of the
        /// marker: 36 numbers, row by row, what <see cref="Job.ToFixedFrame"/> takes.
        /// </summary>
        /// <exception cref="ObjectDisposedException">The calibration was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The verdict is not <see cref="Defrec.Verdict.Accepted"/>
        /// (<see cref="Status.ErrorState"/>), or the pose is none.
        /// </exception>
        public double[] GetPoseCovariance(RigidTransform markerPose)
        {
            var made = new double[36];
            fixed (double* to = made)
            using (var use = new HandleUse(Handle))
                DefrecException.ThrowIfFailed(NativeMethods.defrec_hand_eye_pose_covariance(
                    use.Native, (double*)&markerPose, (UIntPtr)1, to));
            return made;
        }

        /// <summary>Ends the use of the calibration.</summary>
        public void Dispose() { Handle.Dispose(); }

        private static defrec_hand_eye_desc Describe(HandEyeOptions options, Pins pins)
        {
            var desc = new defrec_hand_eye_desc {
                struct_size = (uint)sizeof(defrec_hand_eye_desc),
                camera_poses = (double*)pins.Add(options.CameraPoses),
                camera_times_s = (double*)pins.Add(options.CameraTimes),
                camera_count = (ulong)options.CameraPoses.Length,
                tracker_poses = (double*)pins.Add(options.TrackerPoses),
                tracker_times_s = (double*)pins.Add(options.TrackerTimes),
                tracker_count = (ulong)options.TrackerPoses.Length,
                camera_error_mm = options.CameraErrorMm,
                camera_error_rad = options.CameraErrorRad,
                tracker_error_mm = options.TrackerErrorMm,
                tracker_error_rad = options.TrackerErrorRad,
                max_offset_s = options.MaxOffset,
                max_residual_mm = options.MaxResidualMm,
                max_residual_rad = options.MaxResidualRad,
                max_error_mm = options.MaxErrorMm,
                max_offset_error_s = options.MaxOffsetError,
            };
            if (options.Offset == null) return desc;
            desc.flags |= HandEyeFlags.KnownOffset;
            desc.offset_s = options.Offset.Value;
            return desc;
        }

        private void Take(defrec_hand_eye_info info)
        {
            Verdict = info.verdict;
            Reason = Utf8.Read(info.reason);
            Notes = Utf8.Read(info.notes);
            IsSolved = info.is_solved != 0;
            MarkerFromCamera = info.marker_from_camera;
            TrackerFromWorld = info.tracker_from_world;
            for (int i = 0; i < covariance.Length; ++i) covariance[i] = info.covariance[i];
            OffsetEstimated = info.offset_estimated != 0;
            Offset = info.offset_s;
            OffsetSigma = info.offset_sigma_s;
            OffsetCorrelation = info.offset_correlation;
            RmsMm = info.rms_mm;
            RmsRad = info.rms_rad;
            ErrorRatio = info.error_ratio;
            CameraErrorMm = info.camera_error_mm;
            CameraErrorRad = info.camera_error_rad;
            TrackerErrorMm = info.tracker_error_mm;
            TrackerErrorRad = info.tracker_error_rad;
            Correlated = info.correlated;
            TurnRad = info.turn_rad;
            CrossTurnRad = info.cross_turn_rad;
            LengthFactor = info.length_factor;
            LengthFactorSigma = info.length_factor_sigma;
            Used = Check.ArrayLength(info.used, 1);
            InlierCount = Check.ArrayLength(info.inlier_count, 1);
            ResidualCount = Check.ArrayLength(info.residual_count, 1);
            FreeMotionCount = Check.ArrayLength(info.free_motion_count, 1);
        }

        private static defrec_hand_eye_info Read(HandleUse use)
        {
            var info =
                new defrec_hand_eye_info { struct_size = (uint)sizeof(defrec_hand_eye_info) };
            DefrecException.ThrowIfFailed(NativeMethods.defrec_hand_eye_get(use.Native, &info));
            return info;
        }
    }
}

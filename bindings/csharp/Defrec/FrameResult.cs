using System;
using Defrec.Native;

namespace Defrec
{
    /// <summary>State, reasons and numbers of one frame.</summary>
    public struct FrameSummary
    {
        /// <summary>What became of the frame.</summary>
        public FrameState State { get; }
        /// <summary>Why it is not better.</summary>
        public Reasons Reasons { get; }
        /// <summary>Counts templates and relocalisations.</summary>
        public uint Epoch { get; }
        /// <summary>Of the frame, as submitted.</summary>
        public long TimestampNs { get; }
        /// <summary>Counts submitted frames from 0.</summary>
        public ulong Frame { get; }
        /// <summary>Frames since the geometry was last supported by evidence.</summary>
        public uint Age { get; }
        /// <summary>Features found in the left image.</summary>
        public uint Features { get; }
        /// <summary>Of them matched to landmarks, with depth.</summary>
        public uint Matches { get; }
        /// <summary>Of them preselected.</summary>
        public uint Inliers { get; }
        /// <summary>Patches found by guided search.</summary>
        public uint Patches { get; }
        /// <summary>0 to 1, of the vertices inside the image.</summary>
        public float ObservedShare { get; }
        /// <summary>Mean |depth residual| of the vertices whose depth agrees.</summary>
        public float MeanResidualMm { get; }
        /// <summary>Root mean square distance between found and deformed patches.</summary>
        public float PatchResidualPx { get; }
        /// <summary>Rectified camera from template frame: best rigid fit of all vertices.</summary>
        public RigidTransform RigidMotion { get; }
        /// <summary>Control points; 0 without a template, like the other counts.</summary>
        public int NodeCount { get; }
        /// <summary>Template vertices.</summary>
        public int VertexCount { get; }
        /// <summary>Landmarks of the template.</summary>
        public int LandmarkCount { get; }
        /// <summary>Patches of the template.</summary>
        public int PatchCount { get; }
        /// <summary>Pieces of the surface.</summary>
        public int PieceCount { get; }
        /// <summary>Whether the result carries the disparity image.</summary>
        public bool HasDisparity { get; }
        /// <summary>
        /// By how many frames the right view is late in this frame, negative: early; 0 where that
        /// cannot be measured.
        /// </summary>
        public float ViewLagFrames { get; }
        /// <summary>
        /// Of the right view against the left at the image centre, down is positive; mean of the
        /// last seconds, 0 where not measured.
        /// </summary>
        public float VerticalOffsetPx { get; }
        /// <summary>
        /// Of the right view against the left about the image centre, clockwise is positive; mean
        /// of the last seconds, 0 where not measured.
        /// </summary>
        public float RollDeg { get; }
        /// <summary>
        /// Right focal length to left; mean of the last seconds, 1 where not measured.
        /// </summary>
        public float FocalRatio { get; }
        /// <summary>
        /// Matches between left and right view behind the last three; 0: not measured.
        /// </summary>
        public uint RigMatches { get; }
        /// <summary>
        /// Counts the tracker's templates, and how often tissue joined them; 0 without a template.
        /// </summary>
        public uint TemplateEpoch { get; }
        /// <summary>What carries points beneath the surface, now.</summary>
        public BodyState Body { get; }

        internal unsafe FrameSummary(ref defrec_result result)
        {
            State = result.state;
            Reasons = result.reasons;
            Epoch = result.epoch;
            TimestampNs = result.timestamp_ns;
            Frame = result.frame;
            Age = result.age;
            Features = result.features;
            Matches = result.matches;
            Inliers = result.inliers;
            Patches = result.patches;
            ObservedShare = result.observed_share;
            MeanResidualMm = result.mean_residual_mm;
            PatchResidualPx = result.patch_residual_px;
            RigidMotion = result.rigid_motion;
            NodeCount = Check.ArrayLength(result.node_count, 1);
            VertexCount = Check.ArrayLength(result.vertex_count, 1);
            LandmarkCount = Check.ArrayLength(result.landmark_count, 1);
            PatchCount = Check.ArrayLength(result.patch_count, 1);
            PieceCount = Check.ArrayLength(result.piece_count, 1);
            HasDisparity = result.disparity != null;
            ViewLagFrames = result.view_lag_frames;
            VerticalOffsetPx = result.vertical_offset_px;
            RollDeg = result.roll_deg;
            FocalRatio = result.focal_ratio;
            RigMatches = result.rig_matches;
            TemplateEpoch = result.template_epoch;
            Body = result.body;
        }
    }

    /// <summary>How long a stage took.</summary>
    public struct StageTime
    {
        /// <summary>Of the stage.</summary>
        public string Name { get; }
        /// <summary>See <see cref="TrackerOptions.Timed"/>.</summary>
        public double Milliseconds { get; }

        internal StageTime(string name, double milliseconds)
        {
            Name = name;
            Milliseconds = milliseconds;
        }
    }

    /// <summary>
    /// A whole result, copied: it stays when the job is disposed. Give one object to
    /// <see cref="Job.GetResult(FrameResult)"/> again and again, then arrays are made anew only
    /// when a template with other counts comes. One thread at a time.
    /// </summary>
    public sealed unsafe class FrameResult
    {
        /// <summary>State, reasons and numbers.</summary>
        public FrameSummary Summary { get; private set; }
        /// <summary>Per control point: rectified camera from template frame.</summary>
        public Motion[] Motions { get; private set; } = new Motion[0];
        /// <summary>xyz per control point, now: rectified camera, mm.</summary>
        public float[] NodePositions { get; private set; } = new float[0];
        /// <summary>xyz per template vertex: rectified camera, mm.</summary>
        public float[] Vertices { get; private set; } = new float[0];
        /// <summary>xyz per template vertex: unit length, towards the camera.</summary>
        public float[] Normals { get; private set; } = new float[0];
        /// <summary>How far to trust each template vertex.</summary>
        public PointStatus[] VertexStatus { get; private set; } = new PointStatus[0];
        /// <summary>
        /// Root mean square of the 3D error to be expected of each template vertex, mm: the root of
        /// its covariance's trace.
        /// </summary>
        public float[] ExpectedErrorMm { get; private set; } = new float[0];
        /// <summary>
        /// xx, xy, xz, yy, yz, zz per template vertex: covariance of the position's error,
        /// rectified camera, mm^2.
        /// </summary>
        public float[] VertexCovariance { get; private set; } = new float[0];
        /// <summary>What was observed of each template vertex.</summary>
        public Evidence[] VertexEvidence { get; private set; } = new Evidence[0];
        /// <summary>The landmarks of the template.</summary>
        public Landmark[] Landmarks { get; private set; } = new Landmark[0];
        /// <summary>One per landmark; weight 0: outlier.</summary>
        public Match[] LandmarkMatches { get; private set; } = new Match[0];
        /// <summary>One per patch of the template.</summary>
        public PatchObservation[] PatchObservations { get; private set; } = new PatchObservation[0];
        /// <summary>
        /// Of the rectified image, row by row, 1/16 px; empty unless
        /// <see cref="TrackerOptions.KeepDisparity"/>.
        /// </summary>
        public short[] Disparity { get; private set; } = new short[0];
        /// <summary>
        /// One per piece of the surface: which of them were found. Empty without a template.
        /// </summary>
        public Piece[] Pieces { get; private set; } = new Piece[0];
        /// <summary>In order of execution.</summary>
        public StageTime[] Times { get; private set; } = new StageTime[0];
        /// <summary>Of the device that computed the frame.</summary>
        public string DeviceId { get; private set; } = "";

        internal void Fill(ref defrec_result result, int pixels)
        {
            var summary = new FrameSummary(ref result);
            int nodes = summary.NodeCount, vertices = summary.VertexCount,
                landmarks = summary.LandmarkCount, patches = summary.PatchCount;
            // All arrays before anything is changed: an allocation may fail.
            Motion[] motions = Sized(Motions, nodes);
            float[] nodePositions = Sized(NodePositions, Check.ArrayLength(result.node_count, 3));
            float[] positions = Sized(Vertices, Check.ArrayLength(result.vertex_count, 3));
            float[] normals = Sized(Normals, positions.Length);
            PointStatus[] status = Sized(VertexStatus, vertices);
            float[] errors = Sized(ExpectedErrorMm, vertices);
            float[] covariance = Sized(VertexCovariance, Check.ArrayLength(result.vertex_count, 6));
            Evidence[] evidence = Sized(VertexEvidence, vertices);
            Landmark[] landmarkRecords = Sized(Landmarks, landmarks);
            Match[] matches = Sized(LandmarkMatches, landmarks);
            PatchObservation[] observations = Sized(PatchObservations, patches);
            short[] disparity = Sized(Disparity, summary.HasDisparity ? pixels : 0);
            Piece[] pieces = Sized(Pieces, summary.PieceCount);
            StageTime[] times =
                Sized(Times, (int)Math.Min(result.time_count, Constants.MaxTimedStages));

            fixed (Motion* to = motions)
                NativeArray.Copy(result.motions, to, nodes, sizeof(Motion));
            fixed (float* to = nodePositions)
                NativeArray.Copy(result.node_positions, to, nodePositions.Length, sizeof(float));
            fixed (float* to = positions)
                NativeArray.Copy(result.vertices, to, positions.Length, sizeof(float));
            fixed (float* to = normals)
                NativeArray.Copy(result.normals, to, normals.Length, sizeof(float));
            fixed (PointStatus* to = status)
                NativeArray.Copy(result.vertex_status, to, vertices, sizeof(PointStatus));
            fixed (float* to = errors)
                NativeArray.Copy(result.expected_error_mm, to, vertices, sizeof(float));
            fixed (float* to = covariance)
                NativeArray.Copy(result.vertex_covariance, to, covariance.Length, sizeof(float));
            fixed (Evidence* to = evidence)
                NativeArray.Copy(result.vertex_evidence, to, vertices, sizeof(Evidence));
            fixed (Landmark* to = landmarkRecords)
                NativeArray.Copy(result.landmarks, to, landmarks, sizeof(Landmark));
            fixed (Match* to = matches)
                NativeArray.Copy(result.landmark_matches, to, landmarks, sizeof(Match));
            fixed (PatchObservation* to = observations)
                NativeArray.Copy(result.patch_observations, to, patches, sizeof(PatchObservation));
            fixed (short* to = disparity)
                NativeArray.Copy(result.disparity, to, disparity.Length, sizeof(short));
            fixed (Piece* to = pieces)
                NativeArray.Copy(result.pieces, to, pieces.Length, sizeof(Piece));
            fixed (defrec_stage_time* first = &result.times.first)
            {
                for (int i = 0; i < times.Length; ++i)
                {
                    string name = Utf8.IsAscii(first[i].name, times[i].Name)
                                      ? times[i].Name
                                      : Utf8.Read(first[i].name);
                    times[i] = new StageTime(name, first[i].milliseconds);
                }
            }

            if (!Utf8.IsAscii(result.device_id, DeviceId)) DeviceId = Utf8.Read(result.device_id);
            Summary = summary;
            Motions = motions;
            NodePositions = nodePositions;
            Vertices = positions;
            Normals = normals;
            VertexStatus = status;
            ExpectedErrorMm = errors;
            VertexCovariance = covariance;
            VertexEvidence = evidence;
            Landmarks = landmarkRecords;
            LandmarkMatches = matches;
            PatchObservations = observations;
            Disparity = disparity;
            Pieces = pieces;
            Times = times;
        }

        private static T[] Sized<T>(T[] array, int length)
        {
            return array.Length == length ? array : new T[length];
        }
    }
}

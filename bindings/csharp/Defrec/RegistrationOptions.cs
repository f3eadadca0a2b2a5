namespace Defrec
{
    /// <summary>
    /// Pairs of places of a model, and where they are seen: <see cref="Registration.FromPairs"/>.
    /// Zero means the default.
    /// </summary>
    public sealed class PointPairs
    {
        /// <summary>xyz each, mm, model frame; at least 3 places.</summary>
        public double[] ModelXyz { get; set; } = new double[0];
        /// <summary>xyz each, mm, seen frame, as many.</summary>
        public double[] SeenXyz { get; set; } = new double[0];
        /// <summary>
        /// xx, xy, xz, yy, yz, zz of each place's error, mm^2, model frame; null: 0.
        /// </summary>
        public double[] ModelCovariance { get; set; }
        /// <summary>
        /// Likewise of the seen place, seen frame. Both null: errors are not known, and alike.
        /// </summary>
        public double[] SeenCovariance { get; set; }
        /// <summary>
        /// Where the root mean square of the residuals is larger, the registration has failed, mm;
        /// 0.001 to 100; default 5.
        /// </summary>
        public double MaxResidualMm { get; set; }
        /// <summary>
        /// A motion with a larger standard deviation is undetermined, mm; 0.001 to 100; default 2.
        /// </summary>
        public double MaxErrorMm { get; set; }
    }

    /// <summary>Points that were seen of a model's surface, seen frame.</summary>
    public sealed class SeenSurface
    {
        /// <summary>xyz each, mm; at least 50 points that count.</summary>
        public float[] Vertices { get; set; } = new float[0];
        /// <summary>xyz each, towards the camera; 0 0 0: not known; null: none is known.</summary>
        public float[] Normals { get; set; }
        /// <summary>
        /// xx, xy, xz, yy, yz, zz of each point's error, mm^2, as
        /// <see cref="FrameResult.VertexCovariance"/> has them; null:
        /// <see cref="RegistrationOptions.PointErrorMm"/>.
        /// </summary>
        public float[] Covariances { get; set; }
        /// <summary>
        /// Those that are not <see cref="PointStatus.Observed"/> are passed over; null: all count.
        /// </summary>
        public PointStatus[] Status { get; set; }
    }

    /// <summary>How a surface is registered. Zero means the default.</summary>
    public sealed class RegistrationOptions
    {
        /// <summary>
        /// About where the model lies: seen frame from model frame; all 0: the identity.
        /// </summary>
        public RigidTransform Start { get; set; }
        /// <summary>
        /// The points were not seen from the viewer: triangles that turn away from it are compared
        /// as well.
        /// </summary>
        public bool NoCamera { get; set; }
        /// <summary>Where the camera stood, mm, seen frame.</summary>
        public Double3 Viewer { get; set; }
        /// <summary>
        /// How far the start may be turned, rad; 0 to 3.1416; default 0.5236 (30 degrees).
        /// </summary>
        public double MaxTurnRad { get; set; }
        /// <summary>How far it may be shifted, mm; 0 to 500; default 30.</summary>
        public double MaxShiftMm { get; set; }
        /// <summary>
        /// Poses from which the search begins, the start included; 1 to 10000; default 20.
        /// </summary>
        public int Starts { get; set; }
        /// <summary>
        /// Standard deviation along each axis of points without a covariance, mm; 0.001 to 100;
        /// default 0.5.
        /// </summary>
        public double PointErrorMm { get; set; }
        /// <summary>
        /// Standard deviation of the model's surface along its normal, mm; 0 to 100; default 0.2.
        /// </summary>
        public double ModelErrorMm { get; set; }
        /// <summary>
        /// Where the robust standard deviation of the residuals is larger, the registration has
        /// failed, mm; 0.001 to 100; default 3.
        /// </summary>
        public double MaxResidualMm { get; set; }
        /// <summary>
        /// Where a smaller share of the points lies on the model, it has failed; 0 to 1; default
        /// 0.4.
        /// </summary>
        public double MinInlierShare { get; set; }
        /// <summary>
        /// A motion with a larger standard deviation is undetermined, mm; 0.001 to 100; default 2.
        /// </summary>
        public double MaxErrorMm { get; set; }
        /// <summary>
        /// After the rigid motion the model, whose surface must be closed, is deformed as an
        /// elastic body, where what was seen says how.
        /// </summary>
        public bool Elastic { get; set; }
        /// <summary>
        /// How far the model's surface may be displaced against its rigid motion, root mean square,
        /// mm, with <see cref="Elastic"/>; 0.1 to 100; default 10.
        /// </summary>
        public double DeformationMm { get; set; }
    }
}

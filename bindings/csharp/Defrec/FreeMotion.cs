using System;
using Defrec.Native;

namespace Defrec
{
    /// <summary>
    /// A motion that the data of a registration or a hand-eye calibration do not tell from rest.
    /// </summary>
    public sealed unsafe class FreeMotion
    {
        /// <summary>A turn, or a shift alone.</summary>
        public FreeMotionKind Kind { get; }
        /// <summary>
        /// Unit length, seen frame; of a hand-eye calibration the marker's frame.
        /// </summary>
        public Double3 Axis { get; }
        /// <summary>On the axis of a turn, mm.</summary>
        public Double3 Point { get; }
        /// <summary>Shift along the axis for each rad of a turn, mm.</summary>
        public double PitchMmPerRad { get; }
        /// <summary>
        /// Standard deviation at the typical distance of the data, mm; 0: see
        /// <see cref="ExpectedRad"/>.
        /// </summary>
        public double ExpectedMm { get; }
        /// <summary>Standard deviation of a hand-eye calibration's turn, rad, else 0.</summary>
        public double ExpectedRad { get; }
        /// <summary>For people.</summary>
        public string Text { get; }

        internal FreeMotion(ref defrec_free_motion motion)
        {
            Kind = motion.kind;
            fixed (double* axis = motion.axis) Axis = new Double3(axis[0], axis[1], axis[2]);
            fixed (double* point = motion.point) Point = new Double3(point[0], point[1], point[2]);
            PitchMmPerRad = motion.pitch_mm_per_rad;
            ExpectedMm = motion.expected_mm;
            ExpectedRad = motion.expected_rad;
            Text = Utf8.Read(motion.text);
        }
    }

    /// <summary>Another pose that fits about as well.</summary>
    public sealed class AlternativePose
    {
        /// <summary>Seen frame from model frame.</summary>
        public RigidTransform Transform { get; }
        /// <summary>
        /// Root mean square by which it moves the points against the transform that was chosen, mm.
        /// </summary>
        public double DistanceMm { get; }
        /// <summary>Root mean square of the inliers' residuals, mm.</summary>
        public double RmsMm { get; }
        /// <summary>0 to 1 of what was compared.</summary>
        public double InlierShare { get; }

        internal AlternativePose(ref defrec_registration_alternative other)
        {
            Transform = other.transform;
            DistanceMm = other.distance_mm;
            RmsMm = other.rms_mm;
            InlierShare = other.inlier_share;
        }
    }
}

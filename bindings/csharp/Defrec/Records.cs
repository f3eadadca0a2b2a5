using System.Runtime.InteropServices;

// The records of stages and results: frozen, plain memory, as they lie in the library's arrays.
namespace Defrec
{
    /// <summary>A rectified pair of cameras: x right, y down, z forward.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Camera
    {
        /// <summary>Focal length in x, px.</summary>
        public double Fx;
        /// <summary>Focal length in y, px.</summary>
        public double Fy;
        /// <summary>Principal point, x, px; (0, 0) is the centre of the top-left pixel.</summary>
        public double Cx;
        /// <summary>Principal point, y, px.</summary>
        public double Cy;
        /// <summary>Distance between the eyes, mm; depth = Fx * BaselineMm / disparity.</summary>
        public double BaselineMm;

        /// <summary>A rectified pair of cameras.</summary>
        public Camera(double fx, double fy, double cx, double cy, double baselineMm)
        {
            Fx = fx;
            Fy = fy;
            Cx = cx;
            Cy = cy;
            BaselineMm = baselineMm;
        }
    }

    /// <summary>A corner that stage orb found.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Feature
    {
        /// <summary>In the image, 1/16 px.</summary>
        public int X;
        /// <summary>In the image, 1/16 px.</summary>
        public int Y;
        /// <summary>Level of the pyramid, 0 is the image itself.</summary>
        public ushort Level;
        /// <summary>Orientation bin, 0 to <see cref="Constants.OrbAngleBins"/> - 1.</summary>
        public ushort Angle;
        /// <summary>Corner score, larger is stronger.</summary>
        public uint Score;
        /// <summary>What it looks like.</summary>
        public Descriptor Descriptor;
    }

    /// <summary>A feature of the template.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Landmark
    {
        /// <summary>What it looks like.</summary>
        public Descriptor Descriptor;
        /// <summary>Template frame, mm.</summary>
        public Float3 Position;
        internal uint Reserved;
    }

    /// <summary>What stages match and ransac say of one landmark.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Match
    {
        /// <summary>Index of the live feature, -1: none.</summary>
        public int Feature;
        /// <summary>Hamming distance to it, 0 to 256.</summary>
        public int Distance;
        /// <summary>Hamming distance to the second best at another place, 0 to 256.</summary>
        public int Second;
        /// <summary>The live feature's pixel, x.</summary>
        public float U;
        /// <summary>The live feature's pixel, y.</summary>
        public float V;
        /// <summary>The live feature in the rectified camera, mm; 0 0 0 where depth is unknown.</summary>
        public Float3 Position;
        /// <summary>0 to 1 after preselection; before it, 1 for a match with depth. 0: outlier.</summary>
        public float Weight;
        internal uint Reserved;
    }

    /// <summary>A point that control points move.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct SurfacePoint
    {
        /// <summary>Template frame, mm.</summary>
        public Float3 Position;
        /// <summary>Unit length, towards the camera.</summary>
        public Float3 Normal;
        /// <summary>Control points; unused entries repeat one, with weight 0.</summary>
        public Int4 Node;
        /// <summary>Their weights; the sum is 1.</summary>
        public Float4 Weight;
    }

    /// <summary>A piece of the template's image that is searched in each frame.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Patch
    {
        /// <summary>Its centre in the view it was taken from, x, px.</summary>
        public float U;
        /// <summary>Its centre in the view it was taken from, y, px.</summary>
        public float V;
        /// <summary>Which view.</summary>
        public int View;
        internal uint Reserved;
        /// <summary>Template frame, mm.</summary>
        public Float3 Position;
        /// <summary>How position moves, mm, for one pixel to the right in the view, along the surface.</summary>
        public Float3 TangentU;
        /// <summary>How position moves, mm, for one pixel down in the view, along the surface.</summary>
        public Float3 TangentV;
        /// <summary>Control points; unused entries repeat one, with weight 0.</summary>
        public Int4 Node;
        /// <summary>Their weights; the sum is 1.</summary>
        public Float4 Weight;
        internal uint Reserved2;
    }

    /// <summary>Where a patch is expected.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PatchPrediction
    {
        /// <summary>Predicted centre in the live image, x, 1/256 px.</summary>
        public int U;
        /// <summary>Predicted centre in the live image, y, 1/256 px.</summary>
        public int V;
        /// <summary>2x2 row by row, 1/65536: offset in the view = matrix * offset in the live image.</summary>
        public Int4 ViewFromLive;
        /// <summary>1: inside the image, facing the camera, not stretched out of all proportion.</summary>
        public int Valid;
        internal int Reserved;
    }

    /// <summary>Where a patch was found.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct PatchObservation
    {
        /// <summary>Centre in the live image, x, 1/256 px.</summary>
        public int U;
        /// <summary>Centre in the live image, y, 1/256 px.</summary>
        public int V;
        /// <summary>Correlation (ZNCC), 1/4096.</summary>
        public int Score;
        /// <summary>1: found.</summary>
        public int Valid;
        /// <summary>uu, uv, vv: curvature of the score at the peak, per px^2; 0 along a direction without texture.</summary>
        public Float3 Information;
        internal uint Reserved;
    }

    /// <summary>A unit dual quaternion: the rigid motion <c>x -> R x + t</c>, mm.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Motion
    {
        /// <summary>w x y z of the rotation.</summary>
        public Float4 Real;
        /// <summary>w x y z of 0.5 * t * real.</summary>
        public Float4 Dual;
    }

    /// <summary>A connection between control points.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Edge
    {
        /// <summary>The control point with the smaller index.</summary>
        public int A;
        /// <summary>The control point with the larger index.</summary>
        public int B;
        /// <summary>More than 0.</summary>
        public float Weight;
    }

    /// <summary>A surface point moved by stage warp, and what the frame shows of it.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct SurfaceSample
    {
        /// <summary>Rectified camera, mm.</summary>
        public Float3 Position;
        /// <summary>Unit length.</summary>
        public Float3 Normal;
        /// <summary>Live depth minus the point's depth, mm; 0 without depth.</summary>
        public float Residual;
        /// <summary>What the frame says of it.</summary>
        public Observation Observation;
    }

    /// <summary>What stage ransac found.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct RansacSummary
    {
        /// <summary>Matches with depth.</summary>
        public int ValidMatches;
        /// <summary>Accepted references.</summary>
        public int References;
        /// <summary>Matches with weight over 0.5 after merging.</summary>
        public int Inliers;
        /// <summary>Matches within H of the best reference's rigid motion.</summary>
        public int BestSupport;
        /// <summary>Of the best reference: x_live = Rotation * x_template + Translation.</summary>
        public Float3x3 Rotation;
        /// <summary>Of the best reference, mm.</summary>
        public Float3 Translation;
    }

    /// <summary>What stage lm reached.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct LmSummary
    {
        /// <summary>Cost of the given motions.</summary>
        public float InitialCost;
        /// <summary>Cost of the final motions.</summary>
        public float FinalCost;
        /// <summary>Of the final state, weighted: depth.</summary>
        public float IcpCost;
        /// <summary>Of the final state, weighted: matches.</summary>
        public float MatchCost;
        /// <summary>Of the final state, weighted: patches.</summary>
        public float PatchCost;
        /// <summary>Of the final state, weighted: smoothness.</summary>
        public float ArapCost;
        /// <summary>Iterations taken.</summary>
        public int Iterations;
        /// <summary>Depth residuals with weight over 0 in the final state.</summary>
        public int IcpPoints;
        /// <summary>Match residuals with weight over 0 in the final state.</summary>
        public int Matches;
        /// <summary>Patch residuals with weight over 0 in the final state.</summary>
        public int Patches;
        /// <summary>Weighted root mean square of depth residuals, mm.</summary>
        public float IcpRms;
        /// <summary>Weighted root mean square of match residuals, mm.</summary>
        public float MatchRms;
        /// <summary>Weighted root mean square of patch residuals, px.</summary>
        public float PatchRms;
        /// <summary>The last lambda.</summary>
        public float Damping;
        /// <summary>1: a system could not be solved and the motions are those given.</summary>
        public int Failed;
        internal uint Reserved;
    }
}

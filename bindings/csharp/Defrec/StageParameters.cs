using System.Runtime.InteropServices;

// What stages are made with. 0 means default wherever a default is named; docs/stages.md defines what the numbers do.
namespace Defrec
{
    /// <summary>Of stage rectify. Raw pixels to rectified gray values and a mask of usable ones.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct RectifyParameters
    {
        internal uint StructSize;
        /// <summary>Of the source.</summary>
        public PixelFormat Format;
        /// <summary>Of the source, px.</summary>
        public uint SourceWidth;
        /// <summary>Of the source, px.</summary>
        public uint SourceHeight;
        /// <summary>Of the source, bytes; default: width * bytes per pixel.</summary>
        public uint SourceStride;
        /// <summary>Of the result, px; default: the source's.</summary>
        public uint Width;
        /// <summary>Of the result, px; default: the source's.</summary>
        public uint Height;
        /// <summary>Of the result, bytes; default: width.</summary>
        public uint Stride;
        /// <summary>Gray values from here on count as highlights and are masked; default 235, 256: none.</summary>
        public uint Saturation;
        /// <summary>px (Chebyshev) that the mask grows round highlights, at most 16; default 4.</summary>
        public uint HighlightRadius;
    }

    /// <summary>Of stage stereo. Disparity of a rectified pair.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct StereoParameters
    {
        internal uint StructSize;
        /// <summary>Of gray images and masks, px, at least 2.</summary>
        public uint Width;
        /// <summary>Of gray images and masks, px, at least 2.</summary>
        public uint Height;
        /// <summary>Bytes; default: width.</summary>
        public uint Stride;
        /// <summary>px, 0 or more.</summary>
        public int MinDisparity;
        /// <summary>Number searched, at most 510; default 128.</summary>
        public uint Disparities;
        /// <summary>Of the correlation window of the search, px of half resolution, 2 to 6; default 4.</summary>
        public uint Radius;
        /// <summary>Of the correlation window at full resolution, px, 2 to 6; default 4.</summary>
        public uint RefineRadius;
        /// <summary>ZNCC of the search below this is no evidence, 1/4096; default 1600 (0.39).</summary>
        public uint MinScore;
        /// <summary>ZNCC at full resolution that a pixel needs which the search left open, 1/4096; default 2000 (0.49).</summary>
        public uint RefineScore;
        /// <summary>Lead of the best score over any other that is not close to it, 1/4096; default 40 (0.01).</summary>
        public uint Uniqueness;
        /// <summary>Least standard deviation of gray in the window, 1/16 gray level; default 8.</summary>
        public uint Texture;
        /// <summary>Largest difference between left and right winner, px of half resolution; default 1.</summary>
        public uint LeftRight;
        /// <summary>A range of disparities in a neighbourhood above this is a depth edge, 1/16 px of half resolution; default 24.</summary>
        public uint Edge;
        /// <summary>Of 25 neighbours, how many must agree with a disparity, itself included; default 10.</summary>
        public uint Support;
        /// <summary>px, at most 8; holes up to about this radius are filled from their rim; default 6.</summary>
        public uint FillRadius;
        /// <summary>Of the smoothing window, px, at most 3; default 3.</summary>
        public uint SmoothRadius;
        /// <summary>Neighbours that differ by more are another surface, 1/16 px, at most 256; default 24.</summary>
        public uint SmoothRange;
        /// <summary>At most 8; default 4.</summary>
        public uint SmoothPasses;
    }

    /// <summary>Of stage orb. Features of the left image.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct OrbParameters
    {
        internal uint StructSize;
        /// <summary>Of gray image and mask, px.</summary>
        public uint Width;
        /// <summary>Of gray image and mask, px.</summary>
        public uint Height;
        /// <summary>Bytes; default: width.</summary>
        public uint Stride;
        /// <summary>Of the pyramid, each 4/5 of the one below; 1 to 8, default 4.</summary>
        public uint Levels;
        /// <summary>One corner at most for each cell of this side, px of its level; 4 to 16, default 8.</summary>
        public uint Cell;
        /// <summary>Of FAST, gray levels; 1 to 254, default 3.</summary>
        public uint Threshold;
        /// <summary>Most features; 1 to 65535, default 2048.</summary>
        public uint Capacity;
        /// <summary>Least distance between features of one level, px of the level; 1 to 63, default 4; grows until the features fit the capacity.</summary>
        public uint Spacing;
    }

    /// <summary>Of stage match. Features matched to landmarks.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct MatchParameters
    {
        internal uint StructSize;
        /// <summary>Most landmarks, 1 to 65535.</summary>
        public uint Landmarks;
        /// <summary>Most live features, 1 to 65535.</summary>
        public uint Features;
        /// <summary>Largest Hamming distance of a match, 1 to 256; default 64.</summary>
        public uint MaxDistance;
        /// <summary>Most best / second best, 1/256; 1 to 256, default 218 (0.85); 256: no ratio test.</summary>
        public uint Ratio;
        /// <summary>Of the disparity image, px.</summary>
        public uint Width;
        /// <summary>Of the disparity image, px.</summary>
        public uint Height;
        /// <summary>Of the disparity image, elements; default: width.</summary>
        public uint Stride;
        /// <summary>The rectified camera.</summary>
        public Camera Camera;
    }

    /// <summary>Of stage align. Guided search for patches.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct AlignParameters
    {
        internal uint StructSize;
        /// <summary>Most patches.</summary>
        public uint Patches;
        /// <summary>Exact count of control points.</summary>
        public uint Nodes;
        /// <summary>Images that patches are taken from; default 1.</summary>
        public uint Views;
        /// <summary>Of the live image, the mask and each view, px.</summary>
        public uint Width;
        /// <summary>Of the live image, the mask and each view, px.</summary>
        public uint Height;
        /// <summary>Bytes; default: width.</summary>
        public uint Stride;
        /// <summary>Search on images halved this many times, 0 to 3; default 0.</summary>
        public uint Level;
        /// <summary>px of that level, 1 to 7; default 5.</summary>
        public uint PatchRadius;
        /// <summary>px of that level, 1 to 16; default 4. Found is what lies less far away than this.</summary>
        public uint SearchRadius;
        /// <summary>ZNCC, 1/4096; default 2867 (0.7).</summary>
        public uint MinScore;
        /// <summary>Least standard deviation of the patch, 1/16 gray level; default 16.</summary>
        public uint Texture;
        /// <summary>The rectified camera.</summary>
        public Camera Camera;
    }

    /// <summary>Of stage ransac. Preselection of matches that move rigidly together.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct RansacParameters
    {
        internal uint StructSize;
        /// <summary>Most landmarks.</summary>
        public uint Landmarks;
        /// <summary>1 to 1024; default 30.</summary>
        public uint References;
        /// <summary>1 to 100; default 10.</summary>
        public uint Iterations;
        /// <summary>The paper's H; default: a tenth of the RMS radius of each frame's live points, at least 1 mm.</summary>
        public float ThresholdMm;
        /// <summary>Matches within H that a reference needs, itself included; default 6; 1/32 of all matches is added.</summary>
        public uint MinSupport;
        /// <summary>Of the random choices: the same seed gives the same result.</summary>
        public ulong Seed;
    }

    /// <summary>Of stage lm. Levenberg-Marquardt over the control points' motions.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct LmParameters
    {
        internal uint StructSize;
        /// <summary>Default: coupled.</summary>
        public Solver Solver;
        /// <summary>Exact count, as given to Prepare: control points.</summary>
        public uint Nodes;
        /// <summary>Exact count, as given to Prepare.</summary>
        public uint Edges;
        /// <summary>Exact count, as given to Prepare.</summary>
        public uint Points;
        /// <summary>Exact count, as given to Prepare.</summary>
        public uint Landmarks;
        /// <summary>Exact count, as given to Prepare.</summary>
        public uint Patches;
        /// <summary>Of the disparity image, px.</summary>
        public uint Width;
        /// <summary>Of the disparity image, px.</summary>
        public uint Height;
        /// <summary>Of the disparity image, elements; default: width.</summary>
        public uint Stride;
        /// <summary>The rectified camera.</summary>
        public Camera Camera;
        /// <summary>Default 10.</summary>
        public uint Iterations;
        /// <summary>Most conjugate gradient steps in one iteration; default 20.</summary>
        public uint CgIterations;
        /// <summary>1: first move everything rigidly onto the weighted matches.</summary>
        public uint Presolve;
        /// <summary>Typical; lengths in the ARAP term are divided by it; default 5.</summary>
        public float NodeSpacingMm;
        /// <summary>Default 1.</summary>
        public float IcpWeight;
        /// <summary>Default 10.</summary>
        public float MatchWeight;
        /// <summary>Default 10.</summary>
        public float PatchWeight;
        /// <summary>Default 1.</summary>
        public float ArapWeight;
        /// <summary>Default 1.</summary>
        public float LengthWeight;
        /// <summary>Default 20.</summary>
        public float AngleWeight;
        /// <summary>Default 100.</summary>
        public float RotationWeight;
        /// <summary>Default 3.</summary>
        public float IcpTukeyMm;
        /// <summary>Default 5.</summary>
        public float MatchTukeyMm;
        /// <summary>Default 4.</summary>
        public float PatchTukeyPx;
        /// <summary>Live surface farther than this along the ray is another surface; default 10.</summary>
        public float AssociationMm;
        /// <summary>First lambda; default 1e-3.</summary>
        public float Damping;
        /// <summary>H in the weight 1 - d / (5 H) of matches that preselection left at 0; default 2.</summary>
        public float MatchThresholdMm;
    }

    /// <summary>Of stage warp. Surface points moved by control points.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct WarpParameters
    {
        internal uint StructSize;
        /// <summary>Exact count, as given to Prepare: control points.</summary>
        public uint Nodes;
        /// <summary>Exact count, as given to Prepare.</summary>
        public uint Points;
        /// <summary>Of the disparity image, px.</summary>
        public uint Width;
        /// <summary>Of the disparity image, px.</summary>
        public uint Height;
        /// <summary>Of the disparity image, elements; default: width.</summary>
        public uint Stride;
        internal uint Reserved;
        /// <summary>The rectified camera.</summary>
        public Camera Camera;
        /// <summary>Live depth within this of the point's is an observation; default 2.</summary>
        public float ToleranceMm;
    }
}

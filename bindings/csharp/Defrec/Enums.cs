using System;

namespace Defrec
{
    /// <summary>What a call answered: 0 or more is success, negative is failure.</summary>
    public enum Status
    {
        /// <summary>Done.</summary>
        Ok = 0,
        /// <summary>A wait ended before the work did.</summary>
        Timeout = 1,
        /// <summary>A caller's mistake.</summary>
        ErrorArgument = -1,
        /// <summary>Sizes or versions do not fit together.</summary>
        ErrorVersion = -2,
        /// <summary>Valid, but this device or build cannot.</summary>
        ErrorUnsupported = -3,
        /// <summary>Memory of the host or the device is used up.</summary>
        ErrorOutOfMemory = -4,
        /// <summary>Dispose the tracker and open another device.</summary>
        ErrorDeviceLost = -5,
        /// <summary>A plugin broke its contract, or was refused.</summary>
        ErrorPlugin = -6,
        /// <summary>A file could not be read or written.</summary>
        ErrorIo = -7,
        /// <summary>Not a live handle of the expected kind.</summary>
        ErrorHandle = -8,
        /// <summary>The queue is full, or another thread is inside this object.</summary>
        ErrorBusy = -9,
        /// <summary>Not possible now: from a callback, before there is a template, after a fork.</summary>
        ErrorState = -10,
        /// <summary>A fault of the library.</summary>
        ErrorInternal = -99
    }

    /// <summary>How important a line of the log is.</summary>
    public enum LogLevel
    {
        /// <summary>For those who look for a fault.</summary>
        Debug = 1,
        /// <summary>What happened.</summary>
        Info = 2,
        /// <summary>Something was refused or ignored.</summary>
        Warning = 3,
        /// <summary>Something failed.</summary>
        Error = 4
    }

    /// <summary>Bits of <c>defrec_context_desc.flags</c>; <see cref="ContextOptions"/> has a property for each.</summary>
    [Flags]
    public enum ContextFlags : uint
    {
        /// <summary>None.</summary>
        None = 0,
        /// <summary>Look for plugins nowhere but in the given paths.</summary>
        OnlyGivenPlugins = 1,
        /// <summary>Honour the environment variable DEFREC_PLUGIN_PATH, but never in a privileged process.</summary>
        UseEnvironment = 2
    }

    /// <summary>What computes.</summary>
    public enum DeviceKind : uint
    {
        /// <summary>The processor.</summary>
        Cpu = 1,
        /// <summary>An NVIDIA GPU, by CUDA.</summary>
        Cuda = 2,
        /// <summary>A GPU, or a software driver, by Vulkan.</summary>
        Vulkan = 3
    }

    /// <summary>The stages a frame passes, in their order.</summary>
    public enum StageKind : uint
    {
        /// <summary>Raw pixels to rectified gray values and a mask of usable ones.</summary>
        Rectify = 0,
        /// <summary>Disparity of a rectified pair.</summary>
        Stereo = 1,
        /// <summary>ORB features of the left image.</summary>
        Orb = 2,
        /// <summary>Features matched to the template's landmarks.</summary>
        Match = 3,
        /// <summary>Guided search for the template's patches.</summary>
        Align = 4,
        /// <summary>Preselection of matches that move rigidly together.</summary>
        Ransac = 5,
        /// <summary>Levenberg-Marquardt over the control points' motions.</summary>
        Lm = 6,
        /// <summary>Surface points moved by the control points, and what the frame shows of them.</summary>
        Warp = 7
    }

    /// <summary>Which stages a device offers: bit <c>1 &lt;&lt; StageKind</c>.</summary>
    [Flags]
    public enum StageMask : uint
    {
        /// <summary>None.</summary>
        None = 0,
        /// <summary><see cref="StageKind.Rectify"/>.</summary>
        Rectify = 1u << 0,
        /// <summary><see cref="StageKind.Stereo"/>.</summary>
        Stereo = 1u << 1,
        /// <summary><see cref="StageKind.Orb"/>.</summary>
        Orb = 1u << 2,
        /// <summary><see cref="StageKind.Match"/>.</summary>
        Match = 1u << 3,
        /// <summary><see cref="StageKind.Align"/>.</summary>
        Align = 1u << 4,
        /// <summary><see cref="StageKind.Ransac"/>.</summary>
        Ransac = 1u << 5,
        /// <summary><see cref="StageKind.Lm"/>.</summary>
        Lm = 1u << 6,
        /// <summary><see cref="StageKind.Warp"/>.</summary>
        Warp = 1u << 7,
        /// <summary>Every stage that a tracker needs.</summary>
        All = 0xff
    }

    /// <summary>Properties of a device.</summary>
    [Flags]
    public enum DeviceFeatures : uint
    {
        /// <summary>None.</summary>
        None = 0,
        /// <summary>The same input gives the same bits.</summary>
        Repeatable = 1,
        /// <summary>A graphics driver that computes on the processor, slower than the CPU backend.</summary>
        Software = 2
    }

    /// <summary>Whose memory a <see cref="DeviceMemory"/> is.</summary>
    public enum MemoryKind : uint
    {
        /// <summary>The processor's, for devices that compute in it.</summary>
        Host = 1,
        /// <summary>A CUDA device's (cudaMalloc), in the process's primary context.</summary>
        Cuda = 2
    }

    /// <summary>How the pixels of an image lie in memory.</summary>
    public enum PixelFormat : uint
    {
        /// <summary>As the tracker's default; not for images.</summary>
        Default = 0,
        /// <summary>One byte, gray.</summary>
        Gray8 = 1,
        /// <summary>Three bytes: blue, green, red.</summary>
        Bgr8 = 2,
        /// <summary>Three bytes: red, green, blue.</summary>
        Rgb8 = 3,
        /// <summary>Four bytes: blue, green, red, one that is not looked at.</summary>
        Bgra8 = 4
    }

    /// <summary>Bits of <c>defrec_frame.flags</c>; see <see cref="Frame.CaptureTemplate"/>.</summary>
    [Flags]
    public enum FrameFlags : uint
    {
        /// <summary>None.</summary>
        None = 0,
        /// <summary>Make this frame the template.</summary>
        CaptureTemplate = 1
    }

    /// <summary>State of a frame.</summary>
    public enum FrameState : uint
    {
        /// <summary>There is no template yet.</summary>
        Initialising = 0,
        /// <summary>Followed.</summary>
        Tracking = 1,
        /// <summary>Followed, with less evidence than usual: see <see cref="Reasons"/>.</summary>
        Degraded = 2,
        /// <summary>The geometry is the last known and not to be believed.</summary>
        Lost = 3,
        /// <summary>Found again in this frame; a new epoch.</summary>
        Relocalised = 4
    }

    /// <summary>Why a frame is less than <see cref="FrameState.Tracking"/>, a mask.</summary>
    [Flags]
    public enum Reasons : uint
    {
        /// <summary>None.</summary>
        None = 0,
        /// <summary>The left or the right image is black.</summary>
        Dark = 1u << 0,
        /// <summary>The left or the right image is white.</summary>
        Saturated = 1u << 1,
        /// <summary>Nothing in the image to hold on to.</summary>
        NoTexture = 1u << 2,
        /// <summary>Few features match the template.</summary>
        FewMatches = 1u << 3,
        /// <summary>Something lies in front of the surface.</summary>
        Occluded = 1u << 4,
        /// <summary>The surface found does not lie where the images show it.</summary>
        LargeResidual = 1u << 5,
        /// <summary>It moved far since the frame before.</summary>
        FastMotion = 1u << 6,
        /// <summary>The surface left the image.</summary>
        OutOfView = 1u << 7,
        /// <summary>Too little disparity.</summary>
        NoDepth = 1u << 8,
        /// <summary>The eyes do not match each other.</summary>
        OneEye = 1u << 9,
        /// <summary>The same pixels as the frame before.</summary>
        Frozen = 1u << 10,
        /// <summary>The time since the last frame is more than twice the usual.</summary>
        Gap = 1u << 11,
        /// <summary>Left and right are exchanged.</summary>
        EyesSwapped = 1u << 12,
        /// <summary>Smoke, blur, a wet lens.</summary>
        LowContrast = 1u << 13
    }

    /// <summary>What to believe of a vertex or point.</summary>
    public enum PointStatus : byte
    {
        /// <summary>Seen in this frame.</summary>
        Observed = 0,
        /// <summary>From its neighbourhood: occluded, outside or without depth.</summary>
        Extrapolated = 1,
        /// <summary>Not to be believed: the frame is lost, or nothing near it was seen for long.</summary>
        Unknown = 2
    }

    /// <summary>What a frame says of a surface point.</summary>
    public enum Observation : uint
    {
        /// <summary>The live surface lies where the point is.</summary>
        Observed = 0,
        /// <summary>No disparity there.</summary>
        NoDepth = 1,
        /// <summary>The live surface lies in front of it.</summary>
        Occluded = 2,
        /// <summary>Outside the image, or behind the camera.</summary>
        Outside = 3,
        /// <summary>The live surface lies behind it, or it faces away.</summary>
        Inconsistent = 4
    }

    /// <summary>How stage lm solves for a step.</summary>
    public enum Solver : uint
    {
        /// <summary>The default, <see cref="Coupled"/>.</summary>
        Default = 0,
        /// <summary>Conjugate gradients over all control points.</summary>
        Coupled = 1,
        /// <summary>Each control point for itself, as the paper does.</summary>
        Independent = 2
    }

    /// <summary>Constants of the C API.</summary>
    public static class Constants
    {
        /// <summary>The major version of the C API that this assembly is made for.</summary>
        public const int ApiMajor = 1;
        /// <summary>The minor version of the C API that this assembly is made for; a library must have it or a later one.</summary>
        public const int ApiMinor = 1;
        /// <summary>Stages that exist.</summary>
        public const int StageCountV1 = 8;
        /// <summary>The narrowest image, px.</summary>
        public const int MinWidth = 64;
        /// <summary>The lowest image, px.</summary>
        public const int MinHeight = 48;
        /// <summary>The longest side of an image, px.</summary>
        public const int MaxSide = 8192;
        /// <summary>Disparities are in 1/16 px: this is one pixel.</summary>
        public const int DisparityOne = 16;
        /// <summary>The disparity where there is no evidence.</summary>
        public const int DisparityNone = -32768;
        /// <summary>Orientation bin k of a feature is the angle <c>k * 2 pi / 32</c> from x towards y.</summary>
        public const int OrbAngleBins = 32;
        /// <summary>Control points that move one surface point.</summary>
        public const int SkinNodes = 4;
        /// <summary>Most stage times in one result.</summary>
        public const int MaxTimedStages = 16;
    }
}

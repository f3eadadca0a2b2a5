namespace Defrec
{
    /// <summary>How a tracker works. Zero means the default; it is read once, by the constructor of <see cref="Tracker"/>.</summary>
    public sealed class TrackerOptions
    {
        /// <summary><see cref="DeviceInfo.Id"/>; null: the first device with every stage.</summary>
        public string DeviceId { get; set; }
        /// <summary>Of the random choices: the same seed and frames give the same results.</summary>
        public ulong Seed { get; set; }
        /// <summary>Of the frames; default Bgr8.</summary>
        public PixelFormat Format { get; set; }
        /// <summary>Jobs submitted and not yet disposed; default 2, most 16.</summary>
        public uint FramesInFlight { get; set; }
        /// <summary>Most searched, px; default: found from the first frame.</summary>
        public uint Disparities { get; set; }
        /// <summary>px; used with <see cref="Disparities"/>.</summary>
        public int MinDisparity { get; set; }
        /// <summary>Nearest surface expected; default 20.</summary>
        public float MinDepthMm { get; set; }
        /// <summary>Between control points in the template's image; default: width / 24.</summary>
        public float NodeSpacingPx { get; set; }
        /// <summary>Between template vertices; default: width / 120, at least 4.</summary>
        public float VertexSpacingPx { get; set; }
        /// <summary>Default 1024.</summary>
        public uint MaxFeatures { get; set; }
        /// <summary>Default 1024.</summary>
        public uint MaxPatches { get; set; }
        /// <summary>Of the smoothness term; default 0.2.</summary>
        public float ArapWeight { get; set; }
        /// <summary>Results carry the disparity image.</summary>
        public bool KeepDisparity { get; set; }
        /// <summary>Of Levenberg-Marquardt; default 3.</summary>
        public uint CoarseIterations { get; set; }
        /// <summary>Of Levenberg-Marquardt; default 3.</summary>
        public uint FineIterations { get; set; }
        /// <summary>
        /// The host waits after each stage, so that the times of results are the device's; slower. Otherwise they are those of queueing where a
        /// device computes by itself.
        /// </summary>
        public bool Timed { get; set; }
        /// <summary>Of left and right images in a <see cref="DeviceMemory"/>, bytes; default: rows without gaps.</summary>
        public uint MemoryStride { get; set; }
    }
}

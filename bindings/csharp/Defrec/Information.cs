using Defrec.Native;

namespace Defrec
{
    /// <summary>A plugin that was looked at, loaded or refused.</summary>
    public sealed unsafe class PluginInfo
    {
        /// <summary><see cref="Status.Ok"/> when loaded, else why it was refused.</summary>
        public Status Verdict { get; }
        /// <summary>Its name.</summary>
        public string Name { get; }
        /// <summary>Its file.</summary>
        public string Path { get; }
        /// <summary>Its own version.</summary>
        public string Version { get; }
        /// <summary>
        /// Why it was refused, an error message; when loaded, which of its devices are left out and
        /// why, "" where none is.
        /// </summary>
        public string Reason { get; }

        internal PluginInfo(ref defrec_plugin_info info)
        {
            Verdict = info.verdict;
            Name = Utf8.Read(info.name);
            Path = Utf8.Read(info.path);
            Version = Utf8.Read(info.version);
            Reason = Utf8.Read(info.reason);
        }
    }

    /// <summary>A device of a loaded plugin.</summary>
    public sealed unsafe class DeviceInfo
    {
        /// <summary>What computes.</summary>
        public DeviceKind Kind { get; }
        /// <summary>
        /// Stable and unique: "cpu", "reference", "cuda:GPU-1a2b", "vulkan:10005:0000".
        /// </summary>
        public string Id { get; }
        /// <summary>For people.</summary>
        public string Name { get; }
        /// <summary>Its driver and version; "" if it has none.</summary>
        public string Driver { get; }
        /// <summary>Its memory, bytes.</summary>
        public ulong MemoryBytes { get; }
        /// <summary>
        /// The stages that it offers; a tracker needs <see cref="StageMask.All"/>.
        /// </summary>
        public StageMask Stages { get; }
        /// <summary>Properties.</summary>
        public DeviceFeatures Features { get; }
        /// <summary>Version of the conformance suite passed, 0 if none.</summary>
        public uint Conformance { get; }

        internal DeviceInfo(ref defrec_device_info info)
        {
            Kind = info.kind;
            Id = Utf8.Read(info.id);
            Name = Utf8.Read(info.name);
            Driver = Utf8.Read(info.driver);
            MemoryBytes = info.memory_bytes;
            Stages = info.stages;
            Features = info.features;
            Conformance = info.conformance;
        }
    }
}

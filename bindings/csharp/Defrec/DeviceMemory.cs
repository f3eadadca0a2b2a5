using System;
using Defrec.Native;

namespace Defrec
{
    /// <summary>
    /// The caller's memory, in which a tracker's device works without a copy. The memory stays the
    /// caller's, and must outlive this object and every job that was given it. Import once what
    /// frames use in turn: it allocates. Any thread. docs/api/device_memory.md tells more.
    /// </summary>
    public sealed unsafe class DeviceMemory : IDisposable
    {
        internal readonly MemoryHandle Handle;

        /// <summary>
        /// address: of that kind, a multiple of 16; of an array only while it is pinned. size in
        /// bytes.
        /// </summary>
        /// <exception cref="ArgumentNullException">tracker is null.</exception>
        /// <exception cref="ObjectDisposedException">The tracker was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The device cannot reach it (<see cref="Status.ErrorUnsupported"/>), or it is no such
        /// memory.
        /// </exception>
        public DeviceMemory(Tracker tracker, MemoryKind kind, IntPtr address, long size)
        {
            Check.NotNull(tracker, nameof(tracker));
            if (size < 0)
                throw new ArgumentOutOfRangeException(
                    nameof(size), size, "Memory has no negative size.");
            var desc = new defrec_memory_desc {
                struct_size = (uint)sizeof(defrec_memory_desc),
                kind = kind,
                address = (void*)address,
                size = (ulong)size,
            };
            Handle = new MemoryHandle(tracker.Handle.Log);
            using (var use = new HandleUse(tracker.Handle))
            {
                IntPtr native;
                DefrecException.ThrowIfFailed(
                    NativeMethods.defrec_memory_import(use.Native, &desc, &native));
                Handle.Adopt(native);
            }
        }

        /// <summary>Frames that were submitted with it are computed all the same.</summary>
        public void Dispose() { Handle.Dispose(); }
    }
}

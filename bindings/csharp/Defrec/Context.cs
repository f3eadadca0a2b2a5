using System;
using System.Collections.Generic;
using Defrec.Native;

namespace Defrec
{
    /// <summary>
    /// The plugins that were found, their devices, and the threads that compute. Everything else is
    /// made from a context. Any thread. What was made from it keeps it alive: contexts, trackers,
    /// jobs may be disposed in any order.
    /// </summary>
    public sealed unsafe class Context : IDisposable
    {
        internal readonly ContextHandle Handle;

        /// <summary>
        /// Finds and loads the plugins beside the library and those of the system; no log.
        /// </summary>
        /// <exception cref="DllNotFoundException">There is no native library.</exception>
        /// <exception cref="DefrecException">
        /// The library is of another version, or out of memory.
        /// </exception>
        public Context() : this(new ContextOptions()) { }

        /// <summary>
        /// Finds and loads the plugins. Succeeds with none found: look at <see cref="GetPlugins"/>.
        /// </summary>
        /// <exception cref="ArgumentNullException">options, or a path in it, is null.</exception>
        /// <exception cref="ArgumentOutOfRangeException">
        /// Threads or PluginDeadlineMs is negative.
        /// </exception>
        /// <exception cref="DllNotFoundException">There is no native library.</exception>
        /// <exception cref="DefrecException">
        /// A path is not absolute, only one function of an allocator is given, or the library is of
        /// another version.
        /// </exception>
        public Context(ContextOptions options)
        {
            Check.NotNull(options, nameof(options));
            if (options.Threads < 0)
                throw new ArgumentOutOfRangeException(
                    nameof(options), options.Threads, "Threads is negative.");
            if (options.PluginDeadlineMs < 0)
                throw new ArgumentOutOfRangeException(
                    nameof(options), options.PluginDeadlineMs, "PluginDeadlineMs is negative.");
            DefrecLibrary.RequireVersion();

            int[] offsets;
            byte[] texts = Join(options.PluginPaths, out offsets);
            var paths = new IntPtr[offsets.Length];
            ContextLog log = options.Log == null ? null : new ContextLog(options.Log);
            try
            {
                Handle = new ContextHandle(log);
                fixed (byte* text = texts)
                fixed (IntPtr* path = paths)
                {
                    for (int i = 0; i < paths.Length; ++i) path[i] = (IntPtr)(text + offsets[i]);
                    var desc = new defrec_context_desc {
                        struct_size = (uint)sizeof(defrec_context_desc),
                        flags = (options.OnlyGivenPlugins ? ContextFlags.OnlyGivenPlugins : 0) |
                                (options.UseEnvironment ? ContextFlags.UseEnvironment : 0),
                        plugin_paths = (byte**)path,
                        plugin_path_count = (UIntPtr)(uint)paths.Length,
                        log = log == null ? IntPtr.Zero : ContextLog.Function,
                        log_user = log == null ? IntPtr.Zero : log.User,
                        log_level = (int)options.LogLevel,
                        threads = (uint)options.Threads,
                        alloc = options.Allocator.Allocate,
                        free = options.Allocator.Free,
                        alloc_user = options.Allocator.User,
                        parallel_for = options.ParallelFor.Function,
                        parallel_for_user = options.ParallelFor.User,
                        plugin_deadline_ms = (uint)options.PluginDeadlineMs,
                    };
                    IntPtr native;
                    DefrecException.ThrowIfFailed(
                        NativeMethods.defrec_context_create(&desc, &native));
                    Handle.Adopt(native);
                }
            }
            finally
            {
                if (log != null) log.Release();
            }
        }

        /// <summary>
        /// Every candidate that was looked at, loaded or refused, in the order of the search.
        /// </summary>
        /// <exception cref="ObjectDisposedException">The context was disposed.</exception>
        public PluginInfo[] GetPlugins()
        {
            using (var use = new HandleUse(Handle))
            {
                var plugins = new PluginInfo[(int)NativeMethods.defrec_plugin_count(use.Native)];
                for (int i = 0; i < plugins.Length; ++i)
                {
                    var info =
                        new defrec_plugin_info { struct_size = (uint)sizeof(defrec_plugin_info) };
                    DefrecException.ThrowIfFailed(
                        NativeMethods.defrec_plugin_get(use.Native, (UIntPtr)(uint)i, &info));
                    plugins[i] = new PluginInfo(ref info);
                }
                return plugins;
            }
        }

        /// <summary>
        /// Devices of all loaded plugins, fastest kind first (CUDA, Vulkan on a GPU, CPU, software,
        /// reference), then by id: the same order in every run.
        /// </summary>
        /// <exception cref="ObjectDisposedException">The context was disposed.</exception>
        public DeviceInfo[] GetDevices()
        {
            using (var use = new HandleUse(Handle))
            {
                var devices = new DeviceInfo[(int)NativeMethods.defrec_device_count(use.Native)];
                for (int i = 0; i < devices.Length; ++i)
                {
                    var info =
                        new defrec_device_info { struct_size = (uint)sizeof(defrec_device_info) };
                    DefrecException.ThrowIfFailed(
                        NativeMethods.defrec_device_get(use.Native, (UIntPtr)(uint)i, &info));
                    devices[i] = new DeviceInfo(ref info);
                }
                return devices;
            }
        }

        /// <summary>What was made from the context goes on living.</summary>
        public void Dispose() { Handle.Dispose(); }

        private static byte[] Join(IList<string> paths, out int[] offsets)
        {
            var all = new List<byte>();
            offsets = new int[paths.Count];
            for (int i = 0; i < offsets.Length; ++i)
            {
                Check.NotNull(paths[i], nameof(ContextOptions.PluginPaths));
                offsets[i] = all.Count;
                all.AddRange(Utf8.Bytes(paths[i], nameof(ContextOptions.PluginPaths)));
            }
            return all.ToArray();
        }
    }
}

using System;
using System.Collections.Generic;

namespace Defrec
{
    /// <summary>
    /// Receives the log, one line at a time, on any thread. It must not call defrec, and should
    /// return soon: the library waits for it. An exception ends here and the line is dropped.
    /// source is "sdk" or a plugin's name.
    /// </summary>
    public delegate void LogHandler(LogLevel level, string source, string text);

    /// <summary>
    /// The application's own memory, by functions of native code: <c>defrec_alloc_fn</c> and
    /// <c>defrec_free_fn</c> of defrec_c.h. They are called from any thread until the context and
    /// all made from it are gone. There is no delegate for them: a frame's memory would depend on
    /// the garbage collector.
    /// </summary>
    public struct NativeAllocator
    {
        /// <summary>
        /// <c>void *alloc(void *user, size_t size, size_t alignment)</c>; zero: the library's own
        /// memory.
        /// </summary>
        public IntPtr Allocate;
        /// <summary><c>void free(void *user, void *ptr)</c>.</summary>
        public IntPtr Free;
        /// <summary>The user of both.</summary>
        public IntPtr User;
    }

    /// <summary>
    /// The application's own threads, by a function of native code: <c>defrec_parallel_for_fn</c>
    /// of defrec_c.h. It is called from any thread until the context and all made from it are gone.
    /// There is no delegate for it: a frame is some hundred short loops, and a collection or an
    /// exception in one would be the frame's.
    /// </summary>
    public struct NativeParallelFor
    {
        /// <summary>
        /// <c>void parallel_for(void *user, size_t count, void (*body)(void *arg, size_t index),
        /// void *arg)</c>; zero: the library's pool.
        /// </summary>
        public IntPtr Function;
        /// <summary>Its user.</summary>
        public IntPtr User;
    }

    /// <summary>
    /// How a <see cref="Context"/> finds plugins, logs and computes. It is read once, by the
    /// constructor.
    /// </summary>
    public sealed class ContextOptions
    {
        /// <summary>
        /// Absolute folders or manifest files, searched first. Then follow the folder of the
        /// library and the system's.
        /// </summary>
        public IList<string> PluginPaths { get; } = new List<string>();

        /// <summary>Look nowhere but in <see cref="PluginPaths"/>.</summary>
        public bool OnlyGivenPlugins { get; set; }

        /// <summary>
        /// Honour the environment variable DEFREC_PLUGIN_PATH, but never in a privileged process.
        /// </summary>
        public bool UseEnvironment { get; set; }

        /// <summary>Receives the log; null: none.</summary>
        public LogHandler Log { get; set; }

        /// <summary>The lowest level that is logged.</summary>
        public LogLevel LogLevel { get; set; } = LogLevel.Info;

        /// <summary>
        /// Threads of the library's own pool, the caller's included; 0: one per core.
        /// </summary>
        public int Threads { get; set; }

        /// <summary>
        /// How long a plugin may take to start, to return from a call or to do a frame's work, ms;
        /// 0: a minute. Then its device is quarantined.
        /// </summary>
        public int PluginDeadlineMs { get; set; }

        /// <summary>The application's memory.</summary>
        public NativeAllocator Allocator { get; set; }

        /// <summary>The application's threads.</summary>
        public NativeParallelFor ParallelFor { get; set; }
    }
}

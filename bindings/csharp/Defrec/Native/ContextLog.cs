using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Threading;

namespace Defrec.Native
{
    /// <summary>
    /// The log of one context. The library is given a number, not an address, and one static
    /// function: whatever is collected and however late a line comes, it finds its log or none. The
    /// log lives until the last handle of its context is destroyed.
    /// </summary>
    internal sealed unsafe class ContextLog
    {
        [UnmanagedFunctionPointer(CallingConvention.Cdecl)]
        private delegate void Callback(IntPtr user, int level, byte* source, byte* text);

        // The field keeps the delegate, and with it Function, for as long as the assembly.
        private static readonly Callback Forward = Write;
        internal static readonly IntPtr Function = Marshal.GetFunctionPointerForDelegate(Forward);

        private static readonly Dictionary<IntPtr, ContextLog> Logs =
            new Dictionary<IntPtr, ContextLog>();
        private static long last;

        private readonly LogHandler handler;
        private int references = 1;

        /// <summary>With one reference, the maker's.</summary>
        internal ContextLog(LogHandler handler)
        {
            this.handler = handler;
            User = new IntPtr(Interlocked.Increment(ref last));
            lock (Logs) Logs.Add(User, this);
        }

        /// <summary>What the library hands to Function.</summary>
        internal IntPtr User { get; }

        /// <summary>Logs that some handle still has.</summary>
        internal static int Count
        {
            get
            {
                lock (Logs) return Logs.Count;
            }
        }

        internal void AddReference() { Interlocked.Increment(ref references); }

        internal void Release()
        {
            if (Interlocked.Decrement(ref references) > 0) return;
            lock (Logs) Logs.Remove(User);
        }

        private static void Write(IntPtr user, int level, byte* source, byte* text)
        {
            // An exception must not run into native code: a line that cannot be delivered is
            // dropped, as the library does with its own.
            try
            {
                ContextLog log;
                lock (Logs)
                {
                    if (!Logs.TryGetValue(user, out log)) return;
                }
                log.handler((LogLevel)level, Utf8.Read(source), Utf8.Read(text));
            }
            catch (Exception)
            {
            }
        }
    }
}

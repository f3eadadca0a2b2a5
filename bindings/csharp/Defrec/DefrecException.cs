using System;
using Defrec.Native;

namespace Defrec
{
    /// <summary>
    /// A call failed. <see cref="Exception.Message"/> is the library's error message: what was
    /// given, what was expected.
    /// </summary>
    public sealed class DefrecException : Exception
    {
        /// <summary>What kind of failure it was.</summary>
        public Status Status { get; }

        /// <summary>A failure of this kind, with its error message.</summary>
        public DefrecException(Status status, string message) : base(message) { Status = status; }

        /// <summary>Must follow the call at once: the error message is the thread's last.</summary>
        internal static unsafe void ThrowIfFailed(Status status)
        {
            if (status < 0)
                throw new DefrecException(status, Utf8.Read(NativeMethods.defrec_last_error()));
        }
    }
}

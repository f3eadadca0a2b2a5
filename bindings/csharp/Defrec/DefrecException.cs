using System;
using Defrec.Native;

namespace Defrec
{
    /// <summary>A call failed. <see cref="Exception.Message"/> is the library's sentence: what was given, what was expected.</summary>
    public sealed class DefrecException : Exception
    {
        /// <summary>What kind of failure it was.</summary>
        public Status Status { get; }

        /// <summary>A failure of this kind, in one sentence.</summary>
        public DefrecException(Status status, string sentence) : base(sentence)
        {
            Status = status;
        }

        /// <summary>Must follow the call at once: the sentence is the thread's last.</summary>
        internal static unsafe void ThrowIfFailed(Status status)
        {
            if (status < 0) throw new DefrecException(status, Utf8.Read(NativeMethods.defrec_last_error()));
        }
    }
}

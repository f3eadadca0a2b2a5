using System;
using System.Threading;

namespace Defrec.Native
{
    /// <summary>
    /// Arguments that C could not survive: objects that are not there, arrays that are too short.
    /// </summary>
    internal static class Check
    {
        internal static void NotNull(object value, string name)
        {
            if (value == null) throw new ArgumentNullException(name);
        }

        /// <summary>How many groups of this many elements the array holds.</summary>
        internal static int Groups(int length, int size, string name)
        {
            if (length % size != 0)
                throw new ArgumentException(
                    "The length is " + length + "; a multiple of " + size + " expected.", name);
            return length / size;
        }

        internal static void Length(long length, long needed, string name)
        {
            if (length < needed)
                throw new ArgumentException(
                    "The length is " + length + "; at least " + needed + " expected.", name);
        }

        /// <summary>How long to wait, ns; Timeout.InfiniteTimeSpan: for ever.</summary>
        internal static ulong Nanoseconds(TimeSpan timeout, string name)
        {
            if (timeout == Timeout.InfiniteTimeSpan) return ulong.MaxValue;
            if (timeout < TimeSpan.Zero)
                throw new ArgumentOutOfRangeException(name, timeout, "A time is not negative.");
            ulong ticks = (ulong)timeout.Ticks; // of 100 ns
            return ticks < ulong.MaxValue / 100 ? 100 * ticks : ulong.MaxValue;
        }

        /// <summary>What the library counts must fit an array.</summary>
        internal static int ArrayLength(ulong count, int elements)
        {
            if (count > (ulong)(int.MaxValue / elements))
                throw new OutOfMemoryException(count + " records do not fit an array.");
            return (int)count * elements;
        }
    }
}

using System;

namespace Defrec.Native
{
    /// <summary>Arguments that C could not survive: objects that are not there, arrays that are too short.</summary>
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
                throw new ArgumentException("The length is " + length + "; a multiple of " + size + " expected.", name);
            return length / size;
        }

        internal static void Length(long length, long needed, string name)
        {
            if (length < needed)
                throw new ArgumentException("The length is " + length + "; at least " + needed + " expected.", name);
        }

        /// <summary>What the library counts must fit an array.</summary>
        internal static int ArrayLength(ulong count, int elements)
        {
            if (count > (ulong)(int.MaxValue / elements)) throw new OutOfMemoryException(count + " records do not fit an array.");
            return (int)count * elements;
        }
    }
}

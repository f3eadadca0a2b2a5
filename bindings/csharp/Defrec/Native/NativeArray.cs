using System;

namespace Defrec.Native
{
    /// <summary>Arrays of the library.</summary>
    internal static unsafe class NativeArray
    {
        /// <summary>
        /// Copies count elements of size bytes; from may be null where there are none.
        /// </summary>
        internal static void Copy(void* from, void* to, int count, int size)
        {
            if (count > 0) Buffer.MemoryCopy(from, to, (long)count * size, (long)count * size);
        }

        /// <summary>The array, or a new one where it has another length.</summary>
        internal static T[] Sized<T>(T[] array, int length)
        {
            return array.Length == length ? array : new T[length];
        }
    }
}

using System;

namespace Defrec
{
    /// <summary>
    /// What a <see cref="Stage"/> reads or writes: an array of numbers or records, or host memory
    /// that is not the garbage collector's. Arrays convert by themselves; nothing is copied.
    /// <c>default(StageBuffer)</c> is an optional buffer that is not given.
    /// </summary>
    public unsafe struct StageBuffer
    {
        internal readonly Array Array;
        internal readonly IntPtr Address;
        internal readonly long Size; // bytes

        /// <summary>size bytes of memory that is not the garbage collector's, or pinned.</summary>
        /// <exception cref="ArgumentException">address is zero, or size negative.</exception>
        public StageBuffer(IntPtr address, long size)
        {
            if (address == IntPtr.Zero) throw new ArgumentNullException(nameof(address));
            if (size < 0)
                throw new ArgumentOutOfRangeException(
                    nameof(size), size, "Memory has no negative size.");
            Array = null;
            Address = address;
            Size = size;
        }

        private StageBuffer(Array array, long size)
        {
            Array = array;
            Address = IntPtr.Zero;
            Size = size;
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(byte[] array)
        {
            return new StageBuffer(array, array == null ? 0 : (long)array.Length * sizeof(byte));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(short[] array)
        {
            return new StageBuffer(array, array == null ? 0 : (long)array.Length * sizeof(short));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(ushort[] array)
        {
            return new StageBuffer(array, array == null ? 0 : (long)array.Length * sizeof(ushort));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(int[] array)
        {
            return new StageBuffer(array, array == null ? 0 : (long)array.Length * sizeof(int));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(uint[] array)
        {
            return new StageBuffer(array, array == null ? 0 : (long)array.Length * sizeof(uint));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(float[] array)
        {
            return new StageBuffer(array, array == null ? 0 : (long)array.Length * sizeof(float));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(double[] array)
        {
            return new StageBuffer(array, array == null ? 0 : (long)array.Length * sizeof(double));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(Feature[] array)
        {
            return new StageBuffer(array, array == null ? 0 : (long)array.Length * sizeof(Feature));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(Landmark[] array)
        {
            return new StageBuffer(
                array, array == null ? 0 : (long)array.Length * sizeof(Landmark));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(Match[] array)
        {
            return new StageBuffer(array, array == null ? 0 : (long)array.Length * sizeof(Match));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(SurfacePoint[] array)
        {
            return new StageBuffer(
                array, array == null ? 0 : (long)array.Length * sizeof(SurfacePoint));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(Patch[] array)
        {
            return new StageBuffer(array, array == null ? 0 : (long)array.Length * sizeof(Patch));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(PatchPrediction[] array)
        {
            return new StageBuffer(
                array, array == null ? 0 : (long)array.Length * sizeof(PatchPrediction));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(PatchObservation[] array)
        {
            return new StageBuffer(
                array, array == null ? 0 : (long)array.Length * sizeof(PatchObservation));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(Motion[] array)
        {
            return new StageBuffer(array, array == null ? 0 : (long)array.Length * sizeof(Motion));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(Edge[] array)
        {
            return new StageBuffer(array, array == null ? 0 : (long)array.Length * sizeof(Edge));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(SurfaceSample[] array)
        {
            return new StageBuffer(
                array, array == null ? 0 : (long)array.Length * sizeof(SurfaceSample));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(RansacSummary[] array)
        {
            return new StageBuffer(
                array, array == null ? 0 : (long)array.Length * sizeof(RansacSummary));
        }

        /// <summary>The whole array; null: not given.</summary>
        public static implicit operator StageBuffer(LmSummary[] array)
        {
            return new StageBuffer(
                array, array == null ? 0 : (long)array.Length * sizeof(LmSummary));
        }
    }
}

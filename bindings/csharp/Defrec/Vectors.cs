using System;
using System.Runtime.InteropServices;
using Defrec.Native;

// The small arrays inside records. Fields, so that records stay plain memory and need no unsafe
// code.
namespace Defrec
{
    /// <summary>Three floats: a position or a direction.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Float3
    {
        /// <summary>To the right.</summary>
        public float X;
        /// <summary>Down.</summary>
        public float Y;
        /// <summary>Forward, away from the camera.</summary>
        public float Z;

        /// <summary>Three floats.</summary>
        public Float3(float x, float y, float z)
        {
            X = x;
            Y = y;
            Z = z;
        }
    }

    /// <summary>Four floats: the parts w x y z of a quaternion, or weights.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Float4
    {
        /// <summary>Element 0.</summary>
        public float E0;
        /// <summary>Element 1.</summary>
        public float E1;
        /// <summary>Element 2.</summary>
        public float E2;
        /// <summary>Element 3.</summary>
        public float E3;

        /// <summary>Four floats.</summary>
        public Float4(float e0, float e1, float e2, float e3)
        {
            E0 = e0;
            E1 = e1;
            E2 = e2;
            E3 = e3;
        }

        /// <summary>Element 0 to 3.</summary>
        public float this[int index]
        {
            get
            {
                switch (index)
                {
                    case 0: return E0;
                    case 1: return E1;
                    case 2: return E2;
                    case 3: return E3;
                    default: throw new ArgumentOutOfRangeException(nameof(index));
                }
            }
        }
    }

    /// <summary>Four integers: control points, or a 2x2 matrix row by row.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Int4
    {
        /// <summary>Element 0.</summary>
        public int E0;
        /// <summary>Element 1.</summary>
        public int E1;
        /// <summary>Element 2.</summary>
        public int E2;
        /// <summary>Element 3.</summary>
        public int E3;

        /// <summary>Four integers.</summary>
        public Int4(int e0, int e1, int e2, int e3)
        {
            E0 = e0;
            E1 = e1;
            E2 = e2;
            E3 = e3;
        }

        /// <summary>Element 0 to 3.</summary>
        public int this[int index]
        {
            get
            {
                switch (index)
                {
                    case 0: return E0;
                    case 1: return E1;
                    case 2: return E2;
                    case 3: return E3;
                    default: throw new ArgumentOutOfRangeException(nameof(index));
                }
            }
        }
    }

    /// <summary>A 3x3 matrix of floats, row by row.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Float3x3
    {
        /// <summary>The first row.</summary>
        public Float3 Row0;
        /// <summary>The second row.</summary>
        public Float3 Row1;
        /// <summary>The third row.</summary>
        public Float3 Row2;
    }

    /// <summary>Three numbers.</summary>
    public struct Double3
    {
        /// <summary>The first.</summary>
        public double X;
        /// <summary>The second.</summary>
        public double Y;
        /// <summary>The third.</summary>
        public double Z;

        /// <summary>Three numbers.</summary>
        public Double3(double x, double y, double z)
        {
            X = x;
            Y = y;
            Z = z;
        }
    }

    /// <summary>256 bits of an ORB descriptor: bit i is bit i % 32 of word i / 32.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct Descriptor
    {
        internal fixed uint words[8];

        /// <summary>Word 0 to 7.</summary>
        public uint this[int index]
        {
            get
            {
                if ((uint)index >= 8) throw new ArgumentOutOfRangeException(nameof(index));
                fixed (uint* first = words) return first[index];
            }
            set
            {
                if ((uint)index >= 8) throw new ArgumentOutOfRangeException(nameof(index));
                fixed (uint* first = words) first[index] = value;
            }
        }
    }

    /// <summary>
    /// A rigid motion <c>x -> R x + t</c> in doubles, 3x4 row by row: rotation and translation, mm.
    /// </summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct RigidTransform
    {
        internal fixed double elements[12];

        /// <summary>
        /// 12 numbers, row by row: three of the rotation and one of the translation, mm, in each.
        /// </summary>
        /// <exception cref="ArgumentException">rows is null, or not of 12 numbers.</exception>
        public RigidTransform(params double[] rows)
        {
            Check.NotNull(rows, nameof(rows));
            if (rows.Length != 12)
                throw new ArgumentException(
                    "The length is " + rows.Length + "; 12 expected.", nameof(rows));
            fixed (double* first = elements)
                for (int i = 0; i < 12; ++i) first[i] = rows[i];
        }

        /// <summary>
        /// Row 0 to 2; columns 0 to 2 are the rotation, 3 is the translation in mm.
        /// </summary>
        public double this[int row, int column]
        {
            get
            {
                if ((uint)row >= 3) throw new ArgumentOutOfRangeException(nameof(row));
                if ((uint)column >= 4) throw new ArgumentOutOfRangeException(nameof(column));
                fixed (double* first = elements) return first[4 * row + column];
            }
        }
    }
}

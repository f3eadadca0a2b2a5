using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;

namespace Defrec.Native
{
    /// <summary>Arrays that stay in their places until it is disposed.</summary>
    internal sealed unsafe class Pins : IDisposable
    {
        private readonly List<GCHandle> pins = new List<GCHandle>();

        /// <summary>NULL of null and of an array without elements.</summary>
        internal void* Add(Array array)
        {
            if (array == null || array.Length == 0) return null;
            pins.Add(GCHandle.Alloc(array, GCHandleType.Pinned));
            return (void*)pins[pins.Count - 1].AddrOfPinnedObject();
        }

        public void Dispose()
        {
            foreach (GCHandle pin in pins) pin.Free();
            pins.Clear();
        }
    }
}

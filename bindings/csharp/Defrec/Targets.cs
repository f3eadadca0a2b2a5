using System;
using Defrec.Native;

namespace Defrec
{
    /// <summary>
    /// Points of a plan, prepared once to be moved in many frames: <see cref="Job.MoveTargets(Targets, double[], double[], PointStatus[], double[])"/>. They follow their template and what it becomes by
    /// growing or by a cut. Any thread.
    /// </summary>
    public sealed unsafe class Targets : IDisposable
    {
        internal readonly TargetsHandle Handle;

        /// <summary>templateXyz: points (x, y, z, x, ...), mm, template frame. Those that are not finite are unknown in every frame.</summary>
        /// <exception cref="ArgumentException">An argument is null, or templateXyz not a multiple of 3 long.</exception>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        /// <exception cref="DefrecException">There are more than 1,000,000 points.</exception>
        public Targets(Template surface, double[] templateXyz)
        {
            Check.NotNull(surface, nameof(surface));
            Check.NotNull(templateXyz, nameof(templateXyz));
            int count = Check.Groups(templateXyz.Length, 3, nameof(templateXyz));
            Handle = new TargetsHandle(surface.Handle.Log);
            fixed (double* from = templateXyz)
            using (var use = new HandleUse(surface.Handle))
            {
                IntPtr native;
                DefrecException.ThrowIfFailed(NativeMethods.defrec_targets_create(use.Native, from, (UIntPtr)(uint)count, &native));
                Handle.Adopt(native);
            }
        }

        /// <summary>The number of points.</summary>
        /// <exception cref="ObjectDisposedException">They were disposed.</exception>
        public int Count
        {
            get
            {
                using (var use = new HandleUse(Handle)) return (int)NativeMethods.defrec_targets_count(use.Native);
            }
        }

        /// <summary>Ends their use.</summary>
        public void Dispose()
        {
            Handle.Dispose();
        }
    }
}

using System;
using System.Runtime.InteropServices;
using Defrec.Native;

namespace Defrec
{
    /// <summary>
    /// Points of a plan, on the surface or beneath it, prepared once to be moved in many frames by
    /// <see cref="Job.MoveTargets(Targets, double[], PointStatus[], double[], double[])"/>. They
    /// follow the template and what it becomes by growing or by a cut. Any thread.
    /// </summary>
    public sealed unsafe class Targets : IDisposable
    {
        internal readonly TargetsHandle Handle;

        /// <summary>
        /// templateXyz: x, y, z of each, mm, template frame; copied. What is not finite is unknown
        /// in every frame. At most 1,000,000.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// template or templateXyz is null, or templateXyz not a multiple of 3 long.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        /// <exception cref="DefrecException">
        /// They are too many (<see cref="Status.ErrorArgument"/>).
        /// </exception>
        public Targets(Template template, double[] templateXyz)
        {
            Check.NotNull(template, nameof(template));
            Check.NotNull(templateXyz, nameof(templateXyz));
            int count = Check.Groups(templateXyz.Length, 3, nameof(templateXyz));
            Handle = new TargetsHandle(template.Handle.Log);
            fixed (double* from = templateXyz) Count = Make(template, from, count);
        }

#if NETSTANDARD2_1
        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// template is null, or templateXyz not a multiple of 3 long.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The template was disposed.</exception>
        /// <exception cref="DefrecException">
        /// They are too many (<see cref="Status.ErrorArgument"/>).
        /// </exception>
        public Targets(Template template, ReadOnlySpan<double> templateXyz)
        {
            Check.NotNull(template, nameof(template));
            int count = Check.Groups(templateXyz.Length, 3, nameof(templateXyz));
            Handle = new TargetsHandle(template.Handle.Log);
            fixed (double* from = &MemoryMarshal.GetReference(templateXyz))
                Count = Make(template, from, count);
        }
#endif

        /// <summary>How many there are.</summary>
        public int Count { get; }

        /// <summary>
        /// Ends the use of the targets; a call that moves them on another thread ends first.
        /// </summary>
        public void Dispose() { Handle.Dispose(); }

        // As many as the library says that there are: as many it writes in each frame.
        private int Make(Template template, double* from, int count)
        {
            using (var use = new HandleUse(template.Handle))
            {
                IntPtr native;
                DefrecException.ThrowIfFailed(NativeMethods.defrec_targets_create(
                    use.Native, from, (UIntPtr)(uint)count, &native));
                Handle.Adopt(native);
                return Check.ArrayLength((ulong)NativeMethods.defrec_targets_count(native), 1);
            }
        }
    }
}

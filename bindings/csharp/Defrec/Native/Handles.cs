using System;
using System.Runtime.InteropServices;

namespace Defrec.Native
{
    /// <summary>
    /// Owns one native handle and destroys it once: by Dispose, or by the finaliser. The library
    /// keeps what a handle was made from alive by itself, so handles may be destroyed in any order,
    /// and a finaliser needs no other.
    /// </summary>
    internal abstract class DefrecHandle : SafeHandle
    {
        private readonly string owner;
        private readonly ContextLog log;

        /// <summary>
        /// Made before the native handle is, so that nothing can fail between the two. log: of the
        /// context, may be null.
        /// </summary>
        protected DefrecHandle(string owner, ContextLog log) : base(IntPtr.Zero, true)
        {
            this.owner = owner;
            this.log = log;
        }

        public sealed override bool IsInvalid => handle == IntPtr.Zero;

        /// <summary>The class that a user knows it by.</summary>
        internal string Owner => owner;

        internal ContextLog Log => log;

        internal void Adopt(IntPtr native)
        {
            if (log != null) log.AddReference();
            SetHandle(native);
        }

        protected sealed override bool ReleaseHandle()
        {
            Destroy(handle);
            if (log != null) log.Release();
            return true;
        }

        protected abstract void Destroy(IntPtr native);
    }

    /// <summary>
    /// While it lives, Dispose on another thread does not destroy the native handle. Made for
    /// `using`.
    /// </summary>
    internal struct HandleUse : IDisposable
    {
        internal readonly IntPtr Native;
        private readonly DefrecHandle handle;

        /// <summary>handle null: Native is NULL.</summary>
        internal HandleUse(DefrecHandle handle)
        {
            this.handle = null;
            Native = IntPtr.Zero;
            if (handle == null) return;
            bool added = false;
            try
            {
                handle.DangerousAddRef(ref added);
            }
            catch (ObjectDisposedException)
            {
                throw new ObjectDisposedException(handle.Owner);
            }
            this.handle = handle;
            Native = handle.DangerousGetHandle();
        }

        public void Dispose()
        {
            if (handle != null) handle.DangerousRelease();
        }
    }

    internal sealed class ContextHandle : DefrecHandle
    {
        internal ContextHandle(ContextLog log) : base(nameof(Context), log) { }
        protected override void Destroy(IntPtr native)
        {
            NativeMethods.defrec_context_destroy(native);
        }
    }

    internal sealed class RigHandle : DefrecHandle
    {
        internal RigHandle(ContextLog log) : base(nameof(Rig), log) { }
        protected override void Destroy(IntPtr native) { NativeMethods.defrec_rig_destroy(native); }
    }

    internal sealed class StageHandle : DefrecHandle
    {
        internal StageHandle(ContextLog log) : base(nameof(Stage), log) { }
        protected override void Destroy(IntPtr native)
        {
            NativeMethods.defrec_stage_destroy(native);
        }
    }

    internal sealed class TrackerHandle : DefrecHandle
    {
        internal TrackerHandle(ContextLog log) : base(nameof(Tracker), log) { }
        protected override void Destroy(IntPtr native)
        {
            NativeMethods.defrec_tracker_destroy(native);
        }
    }

    internal sealed class MemoryHandle : DefrecHandle
    {
        internal MemoryHandle(ContextLog log) : base(nameof(DeviceMemory), log) { }
        protected override void Destroy(IntPtr native)
        {
            NativeMethods.defrec_memory_release(native);
        }
    }

    internal sealed class JobHandle : DefrecHandle
    {
        internal JobHandle(ContextLog log) : base(nameof(Job), log) { }
        protected override void Destroy(IntPtr native) { NativeMethods.defrec_job_release(native); }
    }

    internal sealed class TemplateHandle : DefrecHandle
    {
        internal TemplateHandle(ContextLog log) : base(nameof(Template), log) { }
        protected override void Destroy(IntPtr native)
        {
            NativeMethods.defrec_template_release(native);
        }
    }

    internal sealed class TargetsHandle : DefrecHandle
    {
        internal TargetsHandle(ContextLog log) : base(nameof(Targets), log) { }
        protected override void Destroy(IntPtr native)
        {
            NativeMethods.defrec_targets_destroy(native);
        }
    }
    internal sealed class RegistrationHandle : DefrecHandle
    {
        internal RegistrationHandle(ContextLog log) : base(nameof(Registration), log) { }
        protected override void Destroy(IntPtr native)
        {
            NativeMethods.defrec_registration_destroy(native);
        }
    }

    internal sealed class PlanHandle : DefrecHandle
    {
        internal PlanHandle(ContextLog log) : base(nameof(Plan), log) { }
        protected override void Destroy(IntPtr native)
        {
            NativeMethods.defrec_plan_destroy(native);
        }
    }

    internal sealed class HandEyeHandle : DefrecHandle
    {
        internal HandEyeHandle() : base(nameof(HandEye), null) { }
        protected override void Destroy(IntPtr native)
        {
            NativeMethods.defrec_hand_eye_destroy(native);
        }
    }

    internal sealed class PredictorHandle : DefrecHandle
    {
        internal PredictorHandle() : base(nameof(Predictor), null) { }
        protected override void Destroy(IntPtr native)
        {
            NativeMethods.defrec_predictor_destroy(native);
        }
    }
}

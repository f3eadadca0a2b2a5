using System;
using System.Runtime.InteropServices;
using Defrec.Native;

namespace Defrec
{
    /// <summary>
    /// One stage on one device, by itself. Which buffers it takes, in which order and of which
    /// sizes, stands in docs/stages.md. One thread at a time: a second caller is answered with
    /// <see cref="Status.ErrorBusy"/>.
    /// </summary>
    public sealed unsafe partial class Stage : IDisposable
    {
        private const int MostBuffers = 64;
        internal readonly StageHandle Handle;

        private Stage(Context context)
        {
            Check.NotNull(context, nameof(context));
            Handle = new StageHandle(context.Handle.Log);
        }

        /// <summary>
        /// Gives the inputs that stay the same from run to run (a template). A stage that has them
        /// needs it before its first run.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// inputs is null or has more than 64 buffers.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The stage was disposed.</exception>
        /// <exception cref="DefrecException">The buffers are not those of the stage.</exception>
        public void Prepare(params StageBuffer[] inputs)
        {
            Check.NotNull(inputs, nameof(inputs));
            Call(inputs, null);
        }

        /// <summary>
        /// Runs it and waits. An optional buffer that is not given is <c>default(StageBuffer)</c>.
        /// A buffer that is too small is an argument error whose error message names the size
        /// needed.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// inputs or outputs is null, or they have more than 64 buffers.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The stage was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The buffers are not those of the stage, or the device failed.
        /// </exception>
        public void Run(StageBuffer[] inputs, StageBuffer[] outputs)
        {
            Check.NotNull(inputs, nameof(inputs));
            Check.NotNull(outputs, nameof(outputs));
            Call(inputs, outputs);
        }

        /// <summary>Destroys the stage; a run on another thread ends first.</summary>
        public void Dispose() { Handle.Dispose(); }

        private void Create(Context context, StageKind kind, void* parameters, string deviceId)
        {
            fixed (byte* device = Utf8.Bytes(deviceId, nameof(deviceId)))
            using (var use = new HandleUse(context.Handle))
            {
                IntPtr native;
                DefrecException.ThrowIfFailed(NativeMethods.defrec_stage_create(
                    use.Native, device, (uint)kind, parameters, &native));
                Handle.Adopt(native);
            }
        }

        // outputs null: prepare.
        private void Call(StageBuffer[] inputs, StageBuffer[] outputs)
        {
            int inputCount = inputs.Length, outputCount = outputs == null ? 0 : outputs.Length;
            if (inputCount + outputCount > MostBuffers)
                throw new ArgumentException(
                    (inputCount + outputCount) + " buffers; at most " + MostBuffers + " expected.",
                    nameof(inputs));
            defrec_buffer* native = stackalloc defrec_buffer[MostBuffers];
            GCHandle* pins = stackalloc GCHandle[MostBuffers];
            int pinned = 0;
            try
            {
                for (int i = 0; i < inputCount + outputCount; ++i)
                {
                    StageBuffer buffer = i < inputCount ? inputs[i] : outputs[i - inputCount];
                    native[i] = new defrec_buffer {
                        data = (void*)buffer.Address, size = (ulong)buffer.Size
                    };
                    if (buffer.Array == null) continue;
                    GCHandle pin = GCHandle.Alloc(buffer.Array, GCHandleType.Pinned);
                    pins[pinned++] = pin;
                    native[i].data = (void*)pin.AddrOfPinnedObject();
                }
                using (var use = new HandleUse(Handle))
                {
                    DefrecException.ThrowIfFailed(
                        outputs == null ? NativeMethods.defrec_stage_prepare(
                                              use.Native, (defrec_const_buffer*)native,
                                              (UIntPtr)(uint)inputCount)
                                        : NativeMethods.defrec_stage_run(
                                              use.Native, (defrec_const_buffer*)native,
                                              (UIntPtr)(uint)inputCount, native + inputCount,
                                              (UIntPtr)(uint)outputCount));
                }
            }
            finally
            {
                while (pinned > 0) pins[--pinned].Free();
            }
        }
    }
}

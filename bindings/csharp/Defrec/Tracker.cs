using System;
using Defrec.Native;

namespace Defrec
{
    /// <summary>
    /// Follows a surface from frame to frame. Submit from one thread at a time: a second caller is
    /// answered with <see cref="Status.ErrorBusy"/>. Different trackers are independent.
    /// </summary>
    public sealed unsafe partial class Tracker : IDisposable
    {
        internal readonly TrackerHandle Handle;
        private readonly int width, height, pixels; // of the rectified image
        private readonly uint framesInFlight; // 0: the library's default

        /// <summary>Opens the fastest device that has every stage; frames are Bgr8.</summary>
        /// <exception cref="ArgumentNullException">An argument is null.</exception>
        /// <exception cref="ObjectDisposedException">
        /// The context or the rig was disposed.
        /// </exception>
        /// <exception cref="DefrecException">
        /// There is no such device, or it has not enough memory.
        /// </exception>
        public Tracker(Context context, Rig rig) : this(context, rig, new TrackerOptions()) { }

        /// <summary>
        /// Opens the device and allocates everything that a frame needs; afterwards no frame
        /// allocates in the library, but those that capture a template.
        /// </summary>
        /// <exception cref="ArgumentNullException">An argument is null.</exception>
        /// <exception cref="ObjectDisposedException">
        /// The context or the rig was disposed.
        /// </exception>
        /// <exception cref="DefrecException">
        /// An option is out of its range, there is no such device, or it has not enough memory.
        /// </exception>
        public Tracker(Context context, Rig rig, TrackerOptions options)
        {
            Check.NotNull(context, nameof(context));
            Check.NotNull(rig, nameof(rig));
            Check.NotNull(options, nameof(options));
            width = rig.Width;
            height = rig.Height;
            pixels = width * height;
            framesInFlight = options.FramesInFlight;
            Handle = new TrackerHandle(context.Handle.Log);
            fixed (byte* device = Utf8.Bytes(options.DeviceId, "options.DeviceId"))
            using (var contextUse = new HandleUse(context.Handle))
            using (var rigUse = new HandleUse(rig.Handle))
            {
                var desc = new defrec_tracker_desc {
                    struct_size = (uint)sizeof(defrec_tracker_desc), device_id = device
                };
                options.CopyTo(ref desc);
                IntPtr native;
                DefrecException.ThrowIfFailed(NativeMethods.defrec_tracker_create(
                    contextUse.Native, rigUse.Native, &desc, &native));
                Handle.Adopt(native);
            }
        }

        /// <summary>
        /// Queues a frame and returns at once; jobs of one tracker run in order. Pixels in host
        /// memory are copied before it returns, pixels in a <see cref="DeviceMemory"/> are complete
        /// when it is called and stay as they are until the job is done. Dispose the job to give
        /// its place in the queue back.
        /// </summary>
        /// <exception cref="ArgumentException">Left or right is not given.</exception>
        /// <exception cref="ObjectDisposedException">
        /// The tracker, or a memory of the frame, was disposed.
        /// </exception>
        /// <exception cref="DefrecException">
        /// The queue is full or another thread is submitting (<see cref="Status.ErrorBusy"/>), the
        /// timestamp does not grow, the size or the format is not the tracker's.
        /// </exception>
        public Job Submit(Frame frame)
        {
            Job job;
            DefrecException.ThrowIfFailed(Submit(ref frame, out job));
            return job;
        }

        /// <summary>
        /// Queues a pair of images. heldMotion and cameraPose: see <see cref="Frame.HeldMotion"/>
        /// and <see cref="Frame.CameraPose"/>.
        /// </summary>
        /// <exception cref="ArgumentException">Left or right is not given.</exception>
        /// <exception cref="ObjectDisposedException">
        /// The tracker, or a memory of the frame, was disposed.
        /// </exception>
        /// <exception cref="DefrecException">As of <see cref="Submit(Frame)"/>.</exception>
        public Job Submit(
            Image left, Image right, long timestampNs, RigidTransform? heldMotion = null,
            RigidTransform? cameraPose = null)
        {
            return Submit(new Frame(
                left, right, timestampNs) { HeldMotion = heldMotion, CameraPose = cameraPose });
        }

        /// <summary>
        /// Queues a frame if there is a place for it; false, and job is null, where
        /// <see cref="Submit(Frame)"/> throws <see cref="Status.ErrorBusy"/>.
        /// </summary>
        /// <exception cref="ArgumentException">Left or right is not given.</exception>
        /// <exception cref="ObjectDisposedException">
        /// The tracker, or a memory of the frame, was disposed.
        /// </exception>
        /// <exception cref="DefrecException">
        /// As of <see cref="Submit(Frame)"/>, but for the full queue.
        /// </exception>
        public bool TrySubmit(Frame frame, out Job job)
        {
            Status status = Submit(ref frame, out job);
            if (status == Status.ErrorBusy) return false;
            DefrecException.ThrowIfFailed(status);
            return true;
        }

        /// <summary>The present template. Any thread. Dispose it.</summary>
        /// <exception cref="ObjectDisposedException">The tracker was disposed.</exception>
        /// <exception cref="DefrecException">
        /// There is none yet (<see cref="Status.ErrorState"/>).
        /// </exception>
        public Template GetTemplate()
        {
            var template = new TemplateHandle(Handle.Log);
            using (var use = new HandleUse(Handle))
            {
                IntPtr native;
                DefrecException.ThrowIfFailed(
                    NativeMethods.defrec_tracker_get_template(use.Native, &native));
                template.Adopt(native);
            }
            return Template.Of(template);
        }

        /// <summary>
        /// Tracks this template from the next submitted frame on; the rig must have the same
        /// rectified camera and size.
        /// </summary>
        /// <exception cref="ArgumentNullException">template is null.</exception>
        /// <exception cref="ObjectDisposedException">
        /// The tracker or the template was disposed.
        /// </exception>
        /// <exception cref="DefrecException">The template is of another camera.</exception>
        public void SetTemplate(Template template)
        {
            Check.NotNull(template, nameof(template));
            using (var use = new HandleUse(Handle))
            using (var templateUse = new HandleUse(template.Handle))
                DefrecException.ThrowIfFailed(
                    NativeMethods.defrec_tracker_set_template(use.Native, templateUse.Native));
        }

        /// <summary>
        /// Waits for the frame being computed; frames still queued end with
        /// <see cref="Status.ErrorState"/>. Jobs stay valid until disposed. While another thread is
        /// inside a call of this tracker, that call ends it.
        /// </summary>
        public void Dispose() { Handle.Dispose(); }

        private Status Submit(ref Frame frame, out Job job)
        {
            job = null;
            if (!frame.Left.IsGiven)
                throw new ArgumentException("There is no left image.", nameof(frame));
            if (!frame.Right.IsGiven)
                throw new ArgumentException("There is no right image.", nameof(frame));
            var made = new Job(new JobHandle(Handle.Log), pixels);
            using (var use = new HandleUse(Handle))
            using (var leftUse = new HandleUse(HandleOf(frame.Left.Memory)))
            using (var rightUse = new HandleUse(HandleOf(frame.Right.Memory)))
            using (var ignoreUse = new HandleUse(HandleOf(frame.Ignore.Memory)))
            using (var samplesUse = new HandleUse(HandleOf(frame.Samples)))
            fixed (
                byte* leftPixels = frame.Left.Array, rightPixels = frame.Right.Array,
                ignorePixels = frame.Ignore.Array)
            fixed (float* disparityPixels = frame.Disparity, sigmaPixels = frame.DisparitySigma)
            {
                defrec_disparity disparity = DisparityOf(frame, disparityPixels, sigmaPixels);
                defrec_image left = frame.Left.Native(leftPixels, leftUse.Native);
                defrec_image right = frame.Right.Native(rightPixels, rightUse.Native);
                defrec_image ignore = frame.Ignore.Native(ignorePixels, ignoreUse.Native);
                var native = new defrec_frame {
                    struct_size = (uint)sizeof(defrec_frame),
                    flags = (frame.CaptureTemplate ? FrameFlags.CaptureTemplate : FrameFlags.None) |
                            (frame.HeldMotion.HasValue ? FrameFlags.HeldMotion : FrameFlags.None) |
                            (frame.CameraPose.HasValue ? FrameFlags.CameraPose : FrameFlags.None),
                    timestamp_ns = frame.TimestampNs,
                    left = &left,
                    right = &right,
                    ignore = frame.Ignore.IsGiven ? &ignore : null,
                    samples = samplesUse.Native,
                    deadline_ns = frame.DeadlineNs,
                    held_motion = frame.HeldMotion.GetValueOrDefault(),
                    camera_pose = frame.CameraPose.GetValueOrDefault(),
                    field = frame.Field,
                    disparity = frame.Disparity == null ? null : &disparity,
                };
                IntPtr created;
                Status status = NativeMethods.defrec_tracker_submit(use.Native, &native, &created);
                if (status >= 0)
                {
                    made.Handle.Adopt(created);
                    job = made;
                }
                return status;
            }
        }

        private defrec_disparity DisparityOf(Frame frame, float* disparity, float* sigma)
        {
            if (frame.Disparity != null && frame.Disparity.Length != pixels)
                throw new ArgumentException(
                    "Disparity has " + frame.Disparity.Length + " pixels, " + pixels + " expected.",
                    nameof(frame));
            if (frame.DisparitySigma != null && frame.DisparitySigma.Length != pixels)
                throw new ArgumentException(
                    "DisparitySigma has " + frame.DisparitySigma.Length + " pixels, " + pixels +
                        " expected.",
                    nameof(frame));
            if (frame.Disparity == null &&
                (frame.DisparitySigma != null || frame.DisparitySigmaPx != 0))
                throw new ArgumentException("There is no Disparity.", nameof(frame));
            return new defrec_disparity {
                struct_size = (uint)sizeof(defrec_disparity),
                width = (uint)width,
                height = (uint)height,
                disparity = disparity,
                sigma = sigma,
                sigma_px = frame.DisparitySigmaPx,
            };
        }

        private static MemoryHandle HandleOf(DeviceMemory memory)
        {
            return memory == null ? null : memory.Handle;
        }
    }
}

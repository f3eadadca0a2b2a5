using System;
using System.IO;
using System.Runtime.InteropServices;
using Defrec.Native;
using NUnit.Framework;

namespace Defrec.Tests
{
    /// <summary>
    /// Row 50 of docs/safety/faults.md: memory runs out at any one allocation of the library, from
    /// context to template file, on every backend. LD_PRELOAD is bindings/memory_faults.
    /// DEFREC_TEST_ALLOCATION_STEP: one allocation in so many fails.
    /// </summary>
    [TestFixture]
    public class MemoryTest
    {
        // A window of the sequence's frames, for the reference takes its time.
        private const int Left = 96, Top = 72, Width = 128, Height = 96;
        private const int FrameCount = 3, None = -1;
        private static readonly string Asked =
            Environment.GetEnvironmentVariable("DEFREC_TEST_ALLOCATION_STEP");

        [DllImport("defrec_memory_faults")]
        private static extern void defrec_fail_allocation(IntPtr number);
        [DllImport("defrec_memory_faults")]
        private static extern int defrec_is_failure_to_come();
        [DllImport("defrec_memory_faults")]
        private static extern IntPtr defrec_live_allocations();

        private readonly Image[] left = new Image[FrameCount + 1],
                                 right = new Image[FrameCount + 1];
        private string file, plugin, device;

        public MemoryTest()
        {
            var frames = new StereoSequence(
                Path.Combine(TestPaths.Sequence, "left"),
                Path.Combine(TestPaths.Sequence, "right"));
            for (int i = 0; i <= FrameCount; ++i)
            {
                frames.Read(i);
                left[i] = Window(frames.Left);
                right[i] = Window(frames.Right);
            }
        }

        private Context Open()
        {
            var options = new ContextOptions { OnlyGivenPlugins = true, Threads = 1 };
            options.PluginPaths.Add(plugin);
            return new Context(options);
        }

        private static Image Window(PngImage image)
        {
            byte[] gray = image.Gray(), window = new byte[Width * Height];
            for (int y = 0; y < Height; ++y)
                Array.Copy(gray, (Top + y) * image.Width + Left, window, y * Width, Width);
            return new Image(window, Width, Height, PixelFormat.Gray8);
        }

        private FrameState Follow(Tracker tracker, int frame)
        {
            using (Job job =
                       tracker.Submit(left[frame], right[frame], StereoSequence.TimestampOf(frame)))
            {
                job.Wait();
                return job.GetSummary().State;
            }
        }

        private Rig OpenRig(Context context)
        {
            var camera = new Camera(1000.0 / 3, 1000.0 / 3, 159.5 - Left, 119.5 - Top, 4.6);
            return new Rig(context, RigDescription.Rectified(Width, Height, camera));
        }

        private Tracker OpenTracker(Context context, Rig rig)
        {
            return new Tracker(
                context, rig,
                new TrackerOptions {
                    DeviceId = device, Format = PixelFormat.Gray8, Disparities = 32,
                    Body = BodyMode.Off
                });
        }

        /// <summary>
        /// Everything that is made is disposed, whatever fails; a tracker that was made stays
        /// usable.
        /// </summary>
        private void Scenario()
        {
            using (Context context = Open())
            using (Rig rig = OpenRig(context))
            using (Tracker tracker = OpenTracker(context, rig))
            {
                try
                {
                    for (int i = 0; i < FrameCount; ++i)
                        Assert.That(Follow(tracker, i), Is.EqualTo(FrameState.Tracking));
                    using (Template template = tracker.GetTemplate()) template.Save(file);
                    using (Template loaded = Template.Load(context, file))
                        tracker.SetTemplate(loaded);
                }
                catch (DefrecException)
                {
                    defrec_fail_allocation((IntPtr)None);
                    // frames are missing
                    Assert.That(Follow(tracker, FrameCount), Is.Not.EqualTo(FrameState.Lost));
                    throw;
                }
            }
        }

        /// <summary>
        /// What the scenario ended with; whether so many allocations were made; growth of those
        /// alive.
        /// </summary>
        private Status Fail(long number, out bool wasMade, out long growth)
        {
            long before = (long)defrec_live_allocations();
            Status status = Status.Ok;
            defrec_fail_allocation((IntPtr)number);
            try
            {
                Scenario();
            }
            catch (DefrecException e)
            {
                status = e.Status;
            }
            wasMade = defrec_is_failure_to_come() == 0;
            defrec_fail_allocation((IntPtr)None);
            growth = (long)defrec_live_allocations() - before;
            return status;
        }

        // A failure costs a few frames.
        [Test]
        public void OneAfterTheOtherFailsOnReference() { Check("reference", 397); }

        [Test]
        public void OneAfterTheOtherFailsOnCpu() { Check("cpu", 29); }

        [Test]
        public void OneAfterTheOtherFailsOnVulkan() { Check("vulkan", 797); }

        [Test]
        public void OneAfterTheOtherFailsOnCuda() { Check("cuda", 397); }

        private void Check(string backend, int step)
        {
            if (Asked != null) step = int.Parse(Asked);
            file = Path.Combine(TestPaths.Scratch, "surface");
            // the table of handles has grown then
            for (int i = 0; i < 20; ++i)
                new Context(new ContextOptions { OnlyGivenPlugins = true }).Dispose();
            plugin = Path.Combine(TestPaths.Plugins, "defrec_plugin_" + backend + ".json");
            using (Context context = Open())
            {
                DeviceInfo[] devices = context.GetDevices();
                if (devices.Length == 0) return;
                device = devices[0].Id;
            }
            // sdk/api/memory_test.cpp lets memory run out while shaders are compiled; here, a
            // tracker keeps them.
            using (Context context = Open())
            using (Rig rig = OpenRig(context))
            using (OpenTracker(context, rig)) CheckEveryFailure(step);
        }

        private void CheckEveryFailure(int step)
        {
            for (int i = 0; i < 2; ++i) Scenario();
            long number = 0, failures = 0;
            for (bool wasMade = true;; number += step)
            {
                long growth;
                Status status = Fail(number, out wasMade, out growth);
                // what is kept for ever is kept once
                if (growth != 0) status = Fail(number, out wasMade, out growth);
                Assert.That(
                    status, Is.EqualTo(Status.Ok).Or.EqualTo(Status.ErrorOutOfMemory),
                    "allocation " + number);
                Assert.That(growth, Is.EqualTo(0), "allocation " + number);
                if (!wasMade) break;
                if (status != Status.Ok) ++failures;
            }
            Assert.That(number, Is.GreaterThan(1000));
            Assert.That(failures, Is.GreaterThan(number / step / 2));
            Scenario();
        }
    }
}

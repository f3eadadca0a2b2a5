using System;
using System.IO;
using System.Runtime.InteropServices;
using Defrec.Native;
using NUnit.Framework;

namespace Defrec.Tests
{
    /// <summary>
    /// Row 50 of docs/faults.md: memory runs out at any one allocation of the library, from context to template file. LD_PRELOAD is
    /// bindings/memory_faults. DEFREC_TEST_EVERY_ALLOCATION: all of them, not one in Step.
    /// </summary>
    [TestFixture]
    public class MemoryTest
    {
        private const int FrameCount = 3, None = -1;
        private static readonly int Step = Environment.GetEnvironmentVariable("DEFREC_TEST_EVERY_ALLOCATION") != null ? 1 : 29;

        [DllImport("defrec_memory_faults")]
        private static extern void defrec_fail_allocation(IntPtr number);
        [DllImport("defrec_memory_faults")]
        private static extern int defrec_is_failure_to_come();
        [DllImport("defrec_memory_faults")]
        private static extern IntPtr defrec_live_allocations();

        private string file;

        private static ContextOptions OnlyCpu()
        {
            var options = new ContextOptions { OnlyGivenPlugins = true, Threads = 1 };
            options.PluginPaths.Add(TestPaths.CpuPlugin);
            return options;
        }

        private readonly StereoSequence frames =
            new StereoSequence(Path.Combine(TestPaths.Sequence, "left"), Path.Combine(TestPaths.Sequence, "right"));

        private void Follow(Tracker tracker, int frame)
        {
            frames.Read(frame);
            using (Job job = tracker.Submit(frames.Left.View(), frames.Right.View(), StereoSequence.TimestampOf(frame)))
            {
                job.Wait();
                Assert.That(job.GetSummary().State, Is.EqualTo(FrameState.Tracking));
            }
        }

        /// <summary>Everything that is made is disposed, whatever fails; a tracker that was made stays usable.</summary>
        private void Scenario()
        {
            using (var context = new Context(OnlyCpu()))
            using (var rig = new Rig(context, frames.Rig(new Camera(1000.0 / 3, 1000.0 / 3, 159.5, 119.5, 4.6))))
            using (var tracker = new Tracker(context, rig, new TrackerOptions { DeviceId = "cpu" }))
            {
                try
                {
                    for (int i = 0; i < FrameCount; ++i) Follow(tracker, i);
                    using (Template template = tracker.GetTemplate()) template.Save(file);
                    using (Template loaded = Template.Load(context, file)) tracker.SetTemplate(loaded);
                }
                catch (DefrecException)
                {
                    defrec_fail_allocation((IntPtr)None);
                    Follow(tracker, FrameCount);
                    throw;
                }
            }
        }

        /// <summary>What the scenario ended with; whether so many allocations were made; growth of those alive.</summary>
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

        [Test]
        public void OneAfterTheOtherFails()
        {
            file = Path.Combine(TestPaths.Scratch, "surface");
            for (int i = 0; i < 20; ++i) Scenario(); // what is kept for ever has grown then
            int failures = 0;
            bool wasMade = true;
            for (long number = 0; wasMade; number += Step)
            {
                long growth;
                Status status = Fail(number, out wasMade, out growth);
                if (growth != 0) status = Fail(number, out wasMade, out growth); // what is kept for ever is kept once
                Assert.That(status, Is.EqualTo(Status.Ok).Or.EqualTo(Status.ErrorOutOfMemory), "allocation " + number);
                Assert.That(growth, Is.EqualTo(0), "allocation " + number);
                if (status != Status.Ok) ++failures;
            }
            Assert.That(failures, Is.GreaterThan(1000 / Step));
            Scenario();
        }
    }
}

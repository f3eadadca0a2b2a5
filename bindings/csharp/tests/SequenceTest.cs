using System;
using System.Collections.Generic;
using System.Linq;
using System.Threading;
using System.Threading.Tasks;
using NUnit.Framework;

namespace Defrec.Tests
{
    /// <summary>Sequences of frames: which calls they make, and in which order.</summary>
    [TestFixture]
    public class SequenceTest : StubTest
    {
        private static readonly Image Picture =
            new Image(new byte[3 * Width * Height], Width, Height, PixelFormat.Bgr8);

        private static IEnumerable<Frame> Frames(int count, List<string> log)
        {
            for (int i = 0; i < count; ++i)
            {
                log.Add("frame " + i);
                yield return new Frame(Picture, Picture, i);
            }
        }

        private static string[] JobCalls()
        {
            return Stub.Calls().Select(call => call.Substring(0, call.IndexOf('('))).ToArray();
        }

        [Test]
        public void EveryFrameBecomesAJobThatIsDisposedAfterItsTurn()
        {
            var log = new List<string>();
            Job last = null;
            int count = 0;
            foreach (Job job in Tracker.Process(Frames(3, log)))
            {
                if (last != null) Assert.Throws<ObjectDisposedException>(() => last.Wait());
                job.GetSummary();
                last = job;
                ++count;
            }
            Assert.That(count, Is.EqualTo(3));
            Assert.Throws<ObjectDisposedException>(() => last.Wait());
            string[] calls = JobCalls();
            foreach (string call in new[] {
                         "defrec_tracker_submit", "defrec_job_wait", "defrec_job_result",
                         "defrec_job_release"
                     })
                Assert.That(calls.Count(each => each == call), Is.EqualTo(3), call);
        }

        [Test]
        public void WithOneFrameInFlightEachJobComesBeforeTheNextFrameIsTaken()
        {
            var log = new List<string>();
            using (var tracker =
                       new Tracker(Context, Rig, new TrackerOptions { FramesInFlight = 1 }))
                foreach (Job job in tracker.Process(Frames(3, log))) log.Add("job");
            Assert.That(
                log, Is.EqualTo(new[] { "frame 0", "job", "frame 1", "job", "frame 2", "job" }));
        }

        [Test]
        public void WhatIsLeftEarlyIsDisposed()
        {
            var log = new List<string>();
            foreach (Job job in Tracker.Process(Frames(9, log))) break;
            string[] calls = JobCalls();
            Assert.That(calls.Count(call => call == "defrec_tracker_submit"), Is.GreaterThan(1));
            Assert.That(
                calls.Count(call => call == "defrec_job_release"),
                Is.EqualTo(calls.Count(call => call == "defrec_tracker_submit")));
        }

        [Test]
        public void AWaitMayBeAsynchronous()
        {
            using (Job job = Submit())
            {
                Assert.That(job.WaitAsync().Wait(TimeSpan.FromMinutes(1)));
                var cancelled = new CancellationToken(true);
                Assert.That(
                    Assert.Throws<AggregateException>(() => job.WaitAsync(cancelled).Wait())
                        .InnerException,
                    Is.InstanceOf<OperationCanceledException>());
            }
        }

        [Test]
        public void FramesAreGiven()
        {
            Assert.Throws<ArgumentNullException>(() => Tracker.Process(null));
        }
    }
}

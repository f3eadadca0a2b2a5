using System;
using System.Collections.Generic;
using System.Linq;
using System.Threading;
using Defrec.Native;
using NUnit.Framework;

namespace Defrec.Tests
{
    /// <summary>
    /// Every handle is destroyed once, whoever does it and in whatever order; what was disposed
    /// says so.
    /// </summary>
    [TestFixture]
    public class LifetimeTest
    {
        [SetUp]
        public void ForgetCalls()
        {
            Collect();
            Stub.Reset();
        }

        // All kinds of objects, each made from those before it.
        private static IDisposable[] MakeAll()
        {
            var context = new Context(new ContextOptions {
                Log = (level, source, text) =>
                {}
            });
            var rig = new Rig(
                context,
                RigDescription.Rectified(StubTest.Width, StubTest.Height, StubTest.Camera));
            var tracker = new Tracker(context, rig);
            Template loaded = Template.Load(context, "/a");
            return new IDisposable[] {
                context,
                rig,
                tracker,
                new DeviceMemory(tracker, MemoryKind.Host, (IntPtr)16, 16),
                tracker.Submit(StubTest.GrayImage(), StubTest.GrayImage(), 1),
                tracker.GetTemplate(),
                loaded,
                new Stage(context, new OrbParameters()),
                new Targets(loaded, new double[3]),
            };
        }

        private static void Collect()
        {
            for (int i = 0; i < 3; ++i)
            {
                GC.Collect();
                GC.WaitForPendingFinalizers();
            }
        }

        [Test]
        public void DisposedInAnyOrderAndAgain()
        {
            int logs = ContextLog.Count;
            var random = new Random(1);
            for (int round = 0; round < 50; ++round)
            {
                IDisposable[] all = MakeAll().OrderBy(o => random.Next()).ToArray();
                foreach (IDisposable o in all)
                {
                    Assert.That(
                        ContextLog.Count, Is.EqualTo(logs + 1),
                        "the log lives as long as anything of its context");
                    o.Dispose();
                }
                foreach (IDisposable o in all) o.Dispose();
                string[] calls = Stub.Calls();
                Assert.That(Stub.Unbalanced(calls), Is.Empty);
                Assert.That(calls.Count(IsDestroyer), Is.EqualTo(all.Length));
                Assert.That(ContextLog.Count, Is.EqualTo(logs));
            }
        }

        [Test]
        public void LeftToFinalisers()
        {
            int logs = ContextLog.Count;
            const int Rounds = 40;
            // On a thread of its own: a collector that looks at stacks finds nothing of it there.
            var maker = new Thread(() =>
            {
                for (int i = 0; i < Rounds; ++i) MakeAll();
        });
        maker.Start();
        maker.Join();
        Collect();
        // What a collector that is not exact still takes for used goes with the next objects.
        string[] calls = Stub.Calls();
        int made = calls.Count(call => call.Contains("out=0x")),
            destroyed = calls.Count(IsDestroyer);
        Assert.That(made, Is.EqualTo(9 * Rounds));
        Assert.That(destroyed, Is.GreaterThanOrEqualTo(9 * (Rounds - 1)));
        Assert.That(calls.Where(IsDestroyer), Is.Unique);
        Assert.That(ContextLog.Count, Is.LessThanOrEqualTo(logs + 1));
    }

    [Test]
    public void ADisposedObjectSaysSo()
    {
        IDisposable[] all = MakeAll();
        var context = (Context)all[0];
        var rig = (Rig)all[1];
        var tracker = (Tracker)all[2];
        var memory = (DeviceMemory)all[3];
        var job = (Job)all[4];
        var template = (Template)all[5];
        var stage = (Stage)all[7];
        var targets = (Targets)all[8];
        var other = new Context();
        var otherRig = new Rig(
            other, RigDescription.Rectified(StubTest.Width, StubTest.Height, StubTest.Camera));
        var otherTracker = new Tracker(other, otherRig);
        Job otherJob = otherTracker.Submit(StubTest.GrayImage(), StubTest.GrayImage(), 1);
        foreach (IDisposable o in all) o.Dispose();
        Stub.Calls();
        double[] uv = new double[2], xyz = new double[3];
        Image image = StubTest.GrayImage(), inMemory = new Image(memory, 64, 48, PixelFormat.Gray8);
        var calls = new Dictionary<TestDelegate, string> {
            { () => context.GetPlugins(), "Context" },
            { () => context.GetDevices(), "Context" },
            { () => new Rig(context, RigDescription.Rectified(64, 48, StubTest.Camera)),
              "Context" },
            { () => new Tracker(context, otherRig), "Context" },
            { () => new Stage(context, new OrbParameters()), "Context" },
            { () => Template.Load(context, "/a"), "Context" },
            { () => new Tracker(other, rig), "Rig" },
            { () => rig.RectifyPixels(uv, uv), "Rig" },
            { () => rig.DistortPixels(uv, uv), "Rig" },
            { () => rig.RectifyPixels(new double[0], uv), "Rig" },
            { () => tracker.Submit(image, image, 1), "Tracker" },
            { () => tracker.GetTemplate(), "Tracker" },
            { () => tracker.SetTemplate(template), "Tracker" },
            { () => new DeviceMemory(tracker, MemoryKind.Host, (IntPtr)16, 16), "Tracker" },
            { () => otherTracker.SetTemplate(template), "Template" },
            { () => otherTracker.Submit(inMemory, image, 1), "DeviceMemory" },
            { () => otherTracker.Submit(image, inMemory, 1), "DeviceMemory" },
            { () => otherTracker.Submit(new Frame(image, image, 1) { Ignore = inMemory }),
              "DeviceMemory" },
            { () => otherTracker.Submit(new Frame(image, image, 1) { Samples = memory }),
              "DeviceMemory" },
            { () => job.Wait(), "Job" },
            { () => job.GetSummary(), "Job" },
            { () => job.GetResult(), "Job" },
            { () => job.CopyVertices(new float[0]), "Job" },
            { () => job.CopyDisparity(new short[0]), "Job" },
            { () => job.GetTemplate(), "Job" },
            { () => job.LiftPoints(uv, xyz, new Found[1]), "Job" },
            { () => job.WarpPoints(xyz, xyz), "Job" },
            { () => job.GetPointCovariances(xyz, new double[6]), "Job" },
            { () => template.GetVertices(), "Template" },
            { () => template.GetTriangles(), "Template" },
            { () => template.GetNodes(), "Template" },
            { () => template.GetEdges(), "Template" },
            { () => template.GetLandmarks(), "Template" },
            { () => template.GetPatches(), "Template" },
            { () => template.GetCutPoints(), "Template" },
            { () => template.GetVertexPieces(), "Template" },
            { () => template.GetImage(), "Template" },
            { () => template.Lift(uv, xyz, new bool[1]), "Template" },
            { () => template.GetPointPieces(xyz, new byte[1]), "Template" },
            { () => template.SetBody(null), "Template" },
            { () => template.WaitForBody(), "Template" },
            { () => new Targets(template, xyz), "Template" },
            { () => job.MoveTargets(targets, xyz), "Job" },
            { () => job.ToFixedFrame(xyz, xyz), "Job" },
            { () => otherJob.MoveTargets(targets, xyz), "Targets" },
            { () => template.Save("/a"), "Template" },
            { () => stage.Prepare(), "Stage" },
            { () => stage.Run(new StageBuffer[0], new StageBuffer[0]), "Stage" },
        };
        foreach (KeyValuePair<TestDelegate, string> call in calls)
        {
            var refusal = Assert.Throws<ObjectDisposedException>(call.Key, call.Value);
            Assert.That(refusal.ObjectName, Is.EqualTo(call.Value));
        }
        Assert.That(Stub.Calls(), Is.Empty, "none of them reached the library");
        otherJob.Dispose();
        otherTracker.Dispose();
        otherRig.Dispose();
        other.Dispose();
    }

    [Test]
    public void DisposedWhileOthersCall()
    {
        for (int round = 0; round < 30; ++round)
        {
            IDisposable[] all = MakeAll();
            var tracker = (Tracker)all[2];
            var job = (Job)all[4];
            var template = (Template)all[5];
            var started = new CountdownEvent(3);
            Exception unexpected = null;
            Thread[] callers =
                new ThreadStart[] {
                    () => job.Wait(),
                    () => tracker.Submit(StubTest.GrayImage(), StubTest.GrayImage(), 1).Dispose(),
                    () => template.GetVertices(),
                }
                    .Select(
                        call => new Thread(
                            () =>
                            {
                                started.Signal();
                                try
                                {
                                    for (;;) call();
                                }
                                catch (ObjectDisposedException)
                                {
                                }
                                catch (Exception e)
                                {
                                    unexpected = e;
                                }
                            }))
                    .ToArray();
            foreach (Thread caller in callers) caller.Start();
            started.Wait();
            foreach (IDisposable o in all) o.Dispose();
            foreach (Thread caller in callers) caller.Join();
            Assert.That(unexpected, Is.Null);
            Assert.That(CallsAfterDestruction(Stub.Calls()), Is.Empty);
        }
    }

    // Calls with a handle that an earlier call destroyed.
    private static IEnumerable<string> CallsAfterDestruction(string[] calls)
    {
        var destroyed = new HashSet<string>();
        foreach (string call in calls)
        {
            int begin = call.IndexOf("=0x", StringComparison.Ordinal) + 1;
            string handle = begin == 0 ? "" : call.Substring(begin).Split(',', ')')[0];
            if (destroyed.Contains(handle)) yield return call;
            if (IsDestroyer(call)) destroyed.Add(handle);
        }
    }

    private static bool IsDestroyer(string call)
    {
        return call.Contains("_destroy(") || call.Contains("_release(");
    }
}
}

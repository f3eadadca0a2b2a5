using System;
using System.Collections.Generic;
using System.Linq;
using System.Threading;
using System.Threading.Tasks;
using NUnit.Framework;

namespace Defrec.Tests
{
    /// <summary>Asynchronous sequences, which .NET Standard 2.1 has.</summary>
    [TestFixture]
    public class AsyncTest : StubTest
    {
        private static readonly Image Picture =
            new Image(new byte[3 * Width * Height], Width, Height, PixelFormat.Bgr8);

        /// <summary>A camera that delivers on other threads.</summary>
        private sealed class Grabber : IAsyncEnumerable<Frame>, IAsyncEnumerator<Frame>
        {
            internal int Count;
            internal int Taken;
            internal bool IsDisposed;

            public Frame Current { get; private set; }

            public IAsyncEnumerator<Frame> GetAsyncEnumerator(CancellationToken cancellation)
            {
                return this;
            }

            public ValueTask<bool> MoveNextAsync()
            {
                return new ValueTask<bool>(Task.Run(() =>
                {
                    if (Taken == Count) return false;
                Current = new Frame(Picture, Picture, Taken++);
                return true;
            }));
        }

        public ValueTask DisposeAsync()
        {
            IsDisposed = true;
            return default(ValueTask);
        }
    }

    private static bool Next(IAsyncEnumerator<Job> jobs)
    {
        Task<bool> next = jobs.MoveNextAsync().AsTask();
        Assert.That(next.Wait(TimeSpan.FromMinutes(1)));
        return next.Result;
    }

    private static int Calls(string name)
    {
        return Stub.Calls().Count(call => call.StartsWith(name + "("));
    }

    [Test]
    public void EveryFrameBecomesAJobThatIsDisposedAfterItsTurn()
    {
        var camera = new Grabber { Count = 4 };
        IAsyncEnumerator<Job> jobs = Tracker.ProcessAsync(camera).GetAsyncEnumerator();
        Job last = null;
        int count = 0;
        for (; Next(jobs); ++count)
        {
            if (last != null) Assert.Throws<ObjectDisposedException>(() => last.Wait());
            last = jobs.Current;
            last.GetSummary();
        }
        Assert.That(count, Is.EqualTo(4));
        Assert.That(Next(jobs), Is.False);
        jobs.DisposeAsync().AsTask().Wait();
        Assert.That(camera.IsDisposed);
        Assert.That(Calls("defrec_job_release"), Is.EqualTo(4));
    }

    [Test]
    public void WithOneFrameInFlightEachJobComesBeforeTheNextFrameIsTaken()
    {
        var camera = new Grabber { Count = 3 };
        using (var tracker = new Tracker(Context, Rig, new TrackerOptions { FramesInFlight = 1 }))
        {
            IAsyncEnumerator<Job> jobs = tracker.ProcessAsync(camera).GetAsyncEnumerator();
            for (int i = 1; i <= 3; ++i)
            {
                Assert.That(Next(jobs));
                Assert.That(camera.Taken, Is.EqualTo(i));
            }
            Assert.That(Next(jobs), Is.False);
        }
    }

    [Test]
    public void CancellationAndAnEarlyEndDisposeEverything()
    {
        var camera = new Grabber { Count = 9 };
        var cancellation = new CancellationTokenSource();
        IAsyncEnumerator<Job> jobs =
            Tracker.ProcessAsync(camera).GetAsyncEnumerator(cancellation.Token);
        Assert.That(Next(jobs));
        cancellation.Cancel();
        var failure = Assert.Throws<AggregateException>(() => Next(jobs));
        Assert.That(failure.InnerException, Is.InstanceOf<OperationCanceledException>());
        jobs.DisposeAsync().AsTask().Wait();
        Assert.That(camera.IsDisposed);
        string[] calls = Stub.Calls();
        Assert.That(
            calls.Count(call => call.StartsWith("defrec_job_release(")),
            Is.EqualTo(calls.Count(call => call.StartsWith("defrec_tracker_submit("))));
    }

    [Test]
    public void FramesAreGiven()
    {
        Assert.Throws<ArgumentNullException>(() => Tracker.ProcessAsync(null));
    }
}
}

using System;
using System.Collections.Generic;
using System.Threading;
using System.Threading.Tasks;
using Defrec.Native;

namespace Defrec
{
    public sealed partial class Tracker
    {
        private uint MaxPending
        {
            // TrySubmit knows the library's default
            get => framesInFlight == 0 ? uint.MaxValue : framesInFlight;
        }

        /// <summary>
        /// Tracks a sequence: gives the job of each frame, done, in order, and disposes it when the
        /// next is asked for. Meanwhile the frames behind it are computed, as many as
        /// <see cref="TrackerOptions.FramesInFlight"/> allows. With 1, each job is given before the
        /// next frame is taken, as a camera needs it.
        /// </summary>
        /// <exception cref="ArgumentNullException">frames is null.</exception>
        /// <exception cref="DefrecException">
        /// While it is enumerated: as of <see cref="Submit(Frame)"/> and <see cref="Job.Wait()"/>.
        /// </exception>
        public IEnumerable<Job> Process(IEnumerable<Frame> frames)
        {
            Check.NotNull(frames, nameof(frames));
            return ProcessAll(frames);
        }

        private IEnumerable<Job> ProcessAll(IEnumerable<Frame> frames)
        {
            var pending = new Queue<Job>();
            try
            {
                foreach (Frame frame in frames)
                {
                    Job job;
                    while (!TrySubmit(frame, out job))
                    {
                        if (pending.Count == 0)
                        {
                            job = Submit(frame); // jobs of others fill the queue: throws
                            break;
                        }
                        using (Job done = pending.Dequeue())
                        {
                            done.Wait();
                            yield return done;
                        }
                    }
                    pending.Enqueue(job);
                    if (pending.Count < MaxPending) continue;
                    using (Job done = pending.Dequeue())
                    {
                        done.Wait();
                        yield return done;
                    }
                }
                while (pending.Count > 0)
                {
                    using (Job done = pending.Dequeue())
                    {
                        done.Wait();
                        yield return done;
                    }
                }
            }
            finally
            {
                foreach (Job job in pending) job.Dispose();
            }
        }

#if NETSTANDARD2_1
        /// <summary>
        /// As <see cref="Process"/>, of frames that come asynchronously; no thread waits for them,
        /// and none of the caller's for jobs.
        /// </summary>
        /// <exception cref="ArgumentNullException">frames is null.</exception>
        /// <exception cref="DefrecException">
        /// While it is enumerated: as of <see cref="Submit(Frame)"/> and <see cref="Job.Wait()"/>.
        /// </exception>
        public IAsyncEnumerable<Job> ProcessAsync(IAsyncEnumerable<Frame> frames)
        {
            Check.NotNull(frames, nameof(frames));
            return new AsyncSequence(this, frames);
        }

        private sealed class AsyncSequence : IAsyncEnumerable<Job>
        {
            private readonly Tracker tracker;
            private readonly IAsyncEnumerable<Frame> frames;

            internal AsyncSequence(Tracker tracker, IAsyncEnumerable<Frame> frames)
            {
                this.tracker = tracker;
                this.frames = frames;
            }

            public IAsyncEnumerator<Job> GetAsyncEnumerator(CancellationToken cancellation)
            {
                return new AsyncJobs(
                    tracker, frames.GetAsyncEnumerator(cancellation), cancellation);
            }
        }

        private sealed class AsyncJobs : IAsyncEnumerator<Job>
        {
            private readonly Tracker tracker;
            private readonly IAsyncEnumerator<Frame> frames;
            private readonly CancellationToken cancellation;
            private readonly Queue<Job> pending = new Queue<Job>();
            private bool hasFrame; // frames.Current waits for a place
            private bool hasEnded;

            internal AsyncJobs(
                Tracker tracker, IAsyncEnumerator<Frame> frames, CancellationToken cancellation)
            {
                this.tracker = tracker;
                this.frames = frames;
                this.cancellation = cancellation;
            }

            public Job Current { get; private set; }

            public ValueTask<bool> MoveNextAsync() { return new ValueTask<bool>(MoveNext()); }

            public ValueTask DisposeAsync()
            {
                Release();
                foreach (Job job in pending) job.Dispose();
                pending.Clear();
                return frames.DisposeAsync();
            }

            private void Release()
            {
                if (Current != null) Current.Dispose();
                Current = null;
            }

            private async Task<bool> MoveNext()
            {
                Release();
                while (!hasEnded && pending.Count < tracker.MaxPending)
                {
                    cancellation.ThrowIfCancellationRequested();
                    if (!hasFrame) hasFrame = await frames.MoveNextAsync().ConfigureAwait(false);
                    hasEnded = !hasFrame;
                    if (hasEnded) break;
                    Job job;
                    if (!tracker.TrySubmit(frames.Current, out job))
                    {
                        if (pending.Count > 0) break;
                        // jobs of others fill the queue: throws
                        job = tracker.Submit(frames.Current);
                    }
                    hasFrame = false;
                    pending.Enqueue(job);
                }
                if (pending.Count == 0) return false;
                Current = pending.Dequeue();
                await Current.WaitAsync(cancellation).ConfigureAwait(false);
                return true;
            }
        }
#endif
    }

    public sealed partial class Job
    {
        // How soon a cancelled wait ends.
        private static readonly TimeSpan CancellationInterval = TimeSpan.FromMilliseconds(20);

        /// <summary>
        /// Waits on a thread of the pool until the frame is computed. Cancelled, the wait ends
        /// within 20 ms and the job goes on.
        /// </summary>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="OperationCanceledException">cancellation was requested.</exception>
        /// <exception cref="DefrecException">How the job failed.</exception>
        public Task WaitAsync(CancellationToken cancellation = default(CancellationToken))
        {
            return Task.Run(
                () =>
                {
                    while (!Wait(CancellationInterval)) cancellation.ThrowIfCancellationRequested();
                },
                cancellation);
        }
    }
}

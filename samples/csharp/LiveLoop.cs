// How a navigation system uses defrec: a camera delivers frames at its own pace, and the loop takes
// the newest frame, waits for its result until a deadline, and goes on with what is there.
//   live_loop LEFT RIGHT FX,FY,CX,CY,BASELINE_MM DEADLINE_MS [DEVICE_ID]
// The camera is a thread that reads a sequence at 30 frames a second. One line is printed for each
// result: in time, or late.
using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.Globalization;
using System.Threading;
using Defrec;

/// <summary>Keeps only the newest frame; a slow loop misses some.</summary>
internal sealed class CameraThread
{
    private readonly StereoSequence sequence;
    private readonly Thread thread;
    private PngImage left = new PngImage(), right = new PngImage();
    private int number;
    private TimeSpan arrived;
    private bool isNew, hasEnded;
    private Exception failure;

    internal CameraThread(StereoSequence sequence)
    {
        this.sequence = sequence;
        thread = new Thread(Deliver) { IsBackground = true };
    }

    internal void Start() { thread.Start(); }

    /// <summary>Waits for a frame that was not taken yet. False: the camera has ended.</summary>
    internal bool TakeNewest(
        ref PngImage intoLeft, ref PngImage intoRight, out int taken, out TimeSpan at)
    {
        lock (thread)
        {
            while (!isNew && !hasEnded) Monitor.Wait(thread);
            if (failure != null) throw new SampleException(failure.Message);
            Exchange(ref intoLeft, ref left);
            Exchange(ref intoRight, ref right);
            taken = number;
            at = arrived;
            bool took = isNew;
            isNew = false;
            return took;
        }
    }

    private void Deliver()
    {
        try
        {
            var clock = Stopwatch.StartNew();
            PngImage nextLeft = new PngImage(), nextRight = new PngImage();
            for (int i = 0; i < sequence.Count; ++i)
            {
                sequence.Read(i, nextLeft, nextRight);
                TimeSpan early =
                    TimeSpan.FromTicks(StereoSequence.TimestampOf(i) / 100) - clock.Elapsed;
                if (early > TimeSpan.Zero) Thread.Sleep(early);
                lock (thread)
                {
                    Exchange(ref nextLeft, ref left);
                    Exchange(ref nextRight, ref right);
                    number = i;
                    arrived = LiveLoop.Clock.Elapsed;
                    isNew = true;
                    Monitor.Pulse(thread);
                }
            }
        }
        catch (Exception e)
        {
            failure = e;
        }
        lock (thread)
        {
            hasEnded = true;
            Monitor.Pulse(thread);
        }
    }

    private static void Exchange(ref PngImage a, ref PngImage b)
    {
        PngImage kept = a;
        a = b;
        b = kept;
    }
}

internal static class LiveLoop
{
    private const int Places = 2; // frames submitted and not yet released; the tracker's default
    internal static readonly Stopwatch Clock = Stopwatch.StartNew();

    private struct Pending
    {
        internal Job Job;
        internal int Number;
        internal TimeSpan Deadline;
    }

    private static int Main(string[] arguments)
    {
        return Sample.Run(
            () =>
            {
                double deadlineMs = 0;
                if (arguments.Length < 4 || arguments.Length > 5 ||
                    !double.TryParse(
                        arguments[3], NumberStyles.Float, CultureInfo.InvariantCulture,
                        out deadlineMs) ||
                    !(deadlineMs >= 0 && deadlineMs <= 60000))
                    throw new UsageException(
                        "live_loop LEFT RIGHT FX,FY,CX,CY,BASELINE_MM DEADLINE_MS [DEVICE_ID]");
                Loop(
                    arguments[0], arguments[1], Sample.ParseCamera(arguments[2]),
                    TimeSpan.FromTicks((long)(deadlineMs * TimeSpan.TicksPerMillisecond)),
                    arguments.Length > 4 ? arguments[4] : null);
            });
    }

    private static void Loop(
        string leftFolder, string rightFolder, Camera cameraNumbers, TimeSpan patience,
        string deviceId)
    {
        var sequence = new StereoSequence(leftFolder, rightFolder);
        var camera = new CameraThread(sequence);
        PngImage left = new PngImage(), right = new PngImage();
        int submitted = 0, number;
        TimeSpan arrived;
        var pending = new Queue<Pending>();
        // Everything that takes long is done before the camera runs: plugins, device, memory.
        using (var context = new Context())
        using (var rig = new Rig(context, sequence.Rig(cameraNumbers)))
        using (
            var tracker = new Tracker(
                context, rig, new TrackerOptions { DeviceId = deviceId, FramesInFlight = Places }))
        {
            camera.Start();
            while (camera.TakeNewest(ref left, ref right, out number, out arrived))
            {
                TakeResults(pending, TimeSpan.Zero); // late results
                Job job;
                if (!tracker.TrySubmit(
                        new Frame(left.View(), right.View(), 100 * arrived.Ticks), out job))
                    continue; // both places are taken; the frame is dropped
                ++submitted;
                pending.Enqueue(
                    new Pending { Job = job, Number = number, Deadline = arrived + patience });
                TakeResults(pending, arrived + patience);
            }
            TakeResults(pending, TimeSpan.MaxValue);
        }
        Console.WriteLine(
            "{0} frames from the camera, {1} tracked, {2} dropped", sequence.Count, submitted,
            sequence.Count - submitted);
    }

    // Shows the results that are done by then, oldest first, and releases their places.
    private static void TakeResults(Queue<Pending> pending, TimeSpan until)
    {
        while (pending.Count > 0)
        {
            TimeSpan left = until == TimeSpan.MaxValue ? TimeSpan.MaxValue : until - Clock.Elapsed;
            if (!pending.Peek().Job.Wait(left > TimeSpan.Zero ? left : TimeSpan.Zero)) return;
            Pending done = pending.Dequeue();
            using (done.Job) Show(done);
        }
    }

    // What a display does with a result: a frame that is tracked or degraded moves the plan; a lost
    // one hides it, or shows it as old.
    private static void Show(Pending done)
    {
        FrameSummary summary = done.Job.GetSummary();
        Console.WriteLine(
            "frame {0} {1}: {2}{3}", done.Number,
            Clock.Elapsed <= done.Deadline ? "in time" : "late",
            summary.State.ToString().ToLowerInvariant(),
            summary.Reasons == Reasons.None ? "" : ": " + summary.Reasons);
    }
}

using System;
using System.Globalization;
using System.IO;
using System.Linq;

namespace Defrec.Tests
{
    /// <summary>
    /// The rendered sequence, tracked through the binding, on device "cpu" unless told otherwise.
    /// </summary>
    internal sealed class TrackingSession : IDisposable
    {
        internal readonly StereoSequence Frames = new StereoSequence(
            Path.Combine(TestPaths.Sequence, "left"), Path.Combine(TestPaths.Sequence, "right"));
        internal readonly Context Context;
        internal readonly Rig Rig;
        internal readonly Tracker Tracker;

        internal TrackingSession(TrackerOptions options, ContextOptions contextOptions = null)
        {
            Context = new Context(contextOptions ?? new ContextOptions());
            Rig = new Rig(
                Context,
                Frames.Rig(new Camera(
                    333.33333333333331, 333.33333333333331, 159.5, 119.5, 4.5999999999999996)));
            options = options ?? new TrackerOptions();
            options.DeviceId = options.DeviceId ?? "cpu";
            Tracker = new Tracker(Context, Rig, options);
        }

        /// <summary>Submits a frame and waits for it.</summary>
        internal Job Track(int frame)
        {
            Frames.Read(frame);
            Job job = Tracker.Submit(
                Frames.Left.View(), Frames.Right.View(), StereoSequence.TimestampOf(frame));
            job.Wait();
            return job;
        }

        internal void SaveTemplate(string file)
        {
            Track(0).Dispose();
            using (Template template = Tracker.GetTemplate()) template.Save(file);
        }

        /// <summary>The pixels to follow: u, v, u, ...</summary>
        internal static double[] Pixels()
        {
            return File.ReadAllLines(Path.Combine(TestPaths.Sequence, "points.csv"))
                .Skip(1)
                .SelectMany(
                    line => line.Split(',').Skip(1).Select(
                        cell => double.Parse(cell, CultureInfo.InvariantCulture)))
                .ToArray();
        }

        public void Dispose()
        {
            Tracker.Dispose();
            Rig.Dispose();
            Context.Dispose();
        }
    }
}

// Follows pixels of the first left image through a stereo sequence.
//   track_folder LEFT RIGHT FX,FY,CX,CY,BASELINE_MM POINTS.csv OUT.csv [DEVICE_ID]
// POINTS.csv has the columns id,u,v (px). OUT.csv has the position of each point in each frame: mm,
// rectified left camera.
using System.Collections.Generic;
using System.IO;
using Defrec;

/// <summary>Pixels, the points of the surface under them, and their current positions.</summary>
internal sealed class FollowedPoints
{
    private readonly List<string> ids = new List<string>();
    private readonly double[] uv, atRest, now, expectedErrorMm;
    private readonly bool[] found; // the template has a surface there
    private readonly PointStatus[] status;
    private bool isKnown;

    internal FollowedPoints(string path)
    {
        var pixels = new List<double>();
        string[] lines = File.ReadAllLines(path);
        for (int i = 1; i < lines.Length; ++i) // the first line is the header
        {
            string[] cells = lines[i].Split(',');
            if (cells.Length != 3)
                throw new SampleException(path + ": id,u,v expected, found \"" + lines[i] + "\"");
            ids.Add(cells[0]);
            pixels.Add(Sample.Number(cells[1], path));
            pixels.Add(Sample.Number(cells[2], path));
        }
        if (ids.Count == 0) throw new SampleException(path + ": names no point");
        uv = pixels.ToArray();
        atRest = new double[3 * ids.Count];
        now = new double[3 * ids.Count];
        found = new bool[ids.Count];
        status = new PointStatus[ids.Count];
        expectedErrorMm = new double[ids.Count];
    }

    /// <summary>
    /// Lifts the pixels to the surface. The first frame with a surface becomes the template.
    /// </summary>
    internal void Lift(Rig rig, Tracker tracker)
    {
        if (isKnown) return;
        rig.RectifyPixels(uv, uv);
        using (Template template = tracker.GetTemplate())
        {
            // Results of a recording must not depend on when the body is ready.
            template.WaitForBody();
            template.Lift(uv, atRest, found);
        }
        isKnown = true;
    }

    /// <summary>Moves the points to the frame of this job.</summary>
    internal void Warp(Job job)
    {
        if (isKnown) job.WarpPoints(atRest, now, status, expectedErrorMm);
    }

    internal void Write(TextWriter file, int frame)
    {
        for (int i = 0; i < ids.Count; ++i)
        {
            file.Write(frame + "," + ids[i] + ",");
            if (!isKnown || !found[i] || status[i] == PointStatus.Unknown)
                file.Write(",,,lost,\n");
            else
                file.Write(
                    "{0},{1},{2},{3},{4}\n", Sample.Decimals(now[3 * i]),
                    Sample.Decimals(now[3 * i + 1]), Sample.Decimals(now[3 * i + 2]),
                    status[i] == PointStatus.Observed ? "tracked" : "extrapolated",
                    Sample.Decimals(expectedErrorMm[i]));
        }
    }
}

internal static class TrackFolder
{
    private static int Main(string[] arguments)
    {
        return Sample.Run(
            () =>
            {
                if (arguments.Length < 5 || arguments.Length > 6)
                    throw new UsageException(
                        "track_folder LEFT RIGHT FX,FY,CX,CY,BASELINE_MM POINTS.csv OUT.csv " +
                        "[DEVICE_ID]");
                Track(
                    arguments[0], arguments[1], Sample.ParseCamera(arguments[2]), arguments[3],
                    arguments[4], arguments.Length > 5 ? arguments[5] : null);
            });
    }

    private static void Track(
        string left, string right, Camera camera, string points, string outPath, string deviceId)
    {
        var sequence = new StereoSequence(left, right);
        var followed = new FollowedPoints(points);
        using (var context = new Context())
        using (var rig = new Rig(context, sequence.Rig(camera)))
            // null: the fastest
            using (
                var tracker =
                    new Tracker(context, rig, new TrackerOptions { DeviceId = deviceId }))
        using (var file = new StreamWriter(outPath))
        {
            file.Write("frame,id,x,y,z,status,expected_error_mm\n");
            for (int i = 0; i < sequence.Count; ++i)
            {
                sequence.Read(i);
                // The pixels are copied; the job holds a place in the queue until it is disposed.
                using (
                    Job job = tracker.Submit(
                        sequence.Left.View(), sequence.Right.View(), StereoSequence.TimestampOf(i)))
                {
                    job.Wait();
                    if (job.GetSummary().VertexCount > 0) followed.Lift(rig, tracker);
                    followed.Warp(job);
                    followed.Write(file, i);
                }
            }
        }
    }
}

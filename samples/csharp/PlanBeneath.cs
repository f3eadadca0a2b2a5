// A plan beneath the surface: follows its targets (a tumour's margin, a vessel) through a stereo
// sequence, and draws them over the left image with a ring of the expected error.
//   plan_beneath LEFT RIGHT FX,FY,CX,CY,BASELINE_MM TARGETS.csv OUT_FOLDER [DEVICE_ID]
// TARGETS.csv has the columns id,x,y,z, and may have others: mm, template frame (the rectified left
// camera of the frame that became the template; an application registers its plan to that).
// OUT_FOLDER/targets.csv has the position of each target in each frame: mm, rectified left camera.
// OUT_FOLDER/000000.ppm and so on are the left images with the targets: a dot where each is, and a
// ring as wide as the error to be expected there, of at least 3 px. Green ones lie on the surface
// and were observed; those that the tissue carries are orange.
using System;
using System.Collections.Generic;
using System.IO;
using System.Text;
using Defrec;

/// <summary>The targets of a plan, and their current positions.</summary>
internal sealed class Plan : IDisposable
{
    private static readonly byte[] ObservedBgr = { 96, 220, 64 }, CarriedBgr = { 32, 176, 255 };
    private readonly List<string> ids = new List<string>();
    private readonly double[] atRest, now, expectedErrorMm;
    private readonly PointStatus[] status;
    private Targets targets; // null before there is a template
    private bool isVoid; // that template was given up

    internal Plan(string path)
    {
        string[] lines = File.ReadAllLines(path);
        List<string> head = new List<string>((lines.Length > 0 ? lines[0] : "").Split(','));
        int[] columns = Array.ConvertAll(new[] { "id", "x", "y", "z" }, name => head.IndexOf(name));
        if (Array.IndexOf(columns, -1) >= 0)
            throw new SampleException(path + ": the columns id,x,y,z expected");
        var xyz = new List<double>();
        for (int i = 1; i < lines.Length; ++i)
        {
            string[] cells = lines[i].Split(',');
            foreach (int column in columns)
                if (column >= cells.Length)
                    throw new SampleException(
                        path + ": line " + (i + 1) + " has " + cells.Length + " cells");
            ids.Add(cells[columns[0]]);
            for (int k = 1; k < 4; ++k) xyz.Add(Sample.Number(cells[columns[k]], path));
        }
        if (ids.Count == 0) throw new SampleException(path + ": names no target");
        atRest = xyz.ToArray();
        now = new double[atRest.Length];
        expectedErrorMm = new double[ids.Count];
        status = new PointStatus[ids.Count];
    }

    /// <summary>Prepares the targets for the job's template, once.</summary>
    internal void Prepare(Job job)
    {
        if (targets != null) return;
        using (Template template = job.GetTemplate())
        {
            Sample.WaitForBody(template);
            targets = new Targets(template, atRest);
        }
    }

    /// <summary>Moves the targets to the frame of this job.</summary>
    internal void Move(Job job, int frame)
    {
        isVoid = isVoid || (targets != null && Sample.IsGivenUp(job, frame));
        if (targets != null && !isVoid)
            job.MoveTargets(targets, now, status, expectedErrorMm);
        else
            for (int i = 0; i < status.Length; ++i) status[i] = PointStatus.Unknown;
    }

    internal void Write(TextWriter file, int frame)
    {
        for (int i = 0; i < ids.Count; ++i)
        {
            file.Write(frame + "," + ids[i] + ",");
            if (status[i] == PointStatus.Unknown)
                file.Write(",,,lost,\n");
            else
                file.Write(
                    "{0},{1},{2},{3},{4}\n", Sample.Decimals(now[3 * i]),
                    Sample.Decimals(now[3 * i + 1]), Sample.Decimals(now[3 * i + 2]),
                    status[i] == PointStatus.Observed ? "tracked" : "extrapolated",
                    Sample.Decimals(expectedErrorMm[i]));
        }
    }

    internal void Print(int frame, BodyState body)
    {
        int known = 0;
        double most = 0;
        for (int i = 0; i < ids.Count; ++i)
        {
            if (status[i] == PointStatus.Unknown) continue;
            ++known;
            most = Math.Max(most, expectedErrorMm[i]);
        }
        Console.Write(
            "frame {0}: body {1}, {2} of {3} targets, expected error up to {4} mm\n", frame,
            body.ToString().ToLowerInvariant(), known, ids.Count, Sample.Decimals(most));
    }

    internal void Draw(PngImage picture, Camera camera)
    {
        for (int i = 0; i < ids.Count; ++i)
        {
            double x = now[3 * i], y = now[3 * i + 1], z = now[3 * i + 2];
            if (status[i] == PointStatus.Unknown || !(z > 0)) continue;
            double u = camera.Fx * x / z + camera.Cx, v = camera.Fy * y / z + camera.Cy,
                   radius = camera.Fx * expectedErrorMm[i] / z;
            if (!(u >= 0 && u < picture.Width && v >= 0 && v < picture.Height && radius < 8192))
                continue;
            Draw(
                picture, Sixteenths(u), Sixteenths(v), Math.Max(Sixteenths(radius), 3 * 16),
                status[i] == PointStatus.Observed ? ObservedBgr : CarriedBgr);
        }
    }

    // A dot and a ring; centre and radius in 1/16 px.
    private static void Draw(PngImage picture, long u, long v, long radius, byte[] bgr)
    {
        const long dot = 24, halfLine = 12;
        long reach = Math.Max(radius + halfLine, dot) / 16 + 1, inner = radius - halfLine,
             outer = radius + halfLine;
        long right = Math.Min(u / 16 + reach, picture.Width - 1),
             bottom = Math.Min(v / 16 + reach, picture.Height - 1);
        for (long y = Math.Max(v / 16 - reach, 0); y <= bottom; ++y)
        {
            for (long x = Math.Max(u / 16 - reach, 0); x <= right; ++x)
            {
                long dx = 16 * x - u, dy = 16 * y - v, squared = dx * dx + dy * dy;
                if (squared <= dot * dot || (squared >= inner * inner && squared <= outer * outer))
                    Array.Copy(bgr, 0, picture.Pixels, 3 * (y * picture.Width + x), 3);
            }
        }
    }

    private static long Sixteenths(double px) { return (long)(16 * px + 0.5); }

    public void Dispose()
    {
        if (targets != null) targets.Dispose();
    }
}

internal static class PlanBeneath
{
    private static int Main(string[] arguments)
    {
        return Sample.Run(
            () =>
            {
                if (arguments.Length < 5 || arguments.Length > 6)
                    throw new UsageException(
                        "plan_beneath LEFT RIGHT FX,FY,CX,CY,BASELINE_MM TARGETS.csv OUT_FOLDER " +
                        "[DEVICE_ID]");
                Follow(
                    arguments[0], arguments[1], Sample.ParseCamera(arguments[2]), arguments[3],
                    arguments[4], arguments.Length > 5 ? arguments[5] : null);
            });
    }

    private static void Follow(
        string left, string right, Camera camera, string targets, string folder, string deviceId)
    {
        var sequence = new StereoSequence(left, right);
        using (var plan = new Plan(targets))
        using (var context = new Context())
        using (var rig = new Rig(context, sequence.Rig(camera)))
            // null: the fastest
            using (
                var tracker =
                    new Tracker(context, rig, new TrackerOptions { DeviceId = deviceId }))
        using (var file = new StreamWriter(
                   Path.Combine(Directory.CreateDirectory(folder).FullName, "targets.csv")))
        {
            file.Write("frame,id,x,y,z,status,expected_error_mm\n");
            for (int i = 0; i < sequence.Count; ++i)
            {
                sequence.Read(i);
                using (
                    Job job = tracker.Submit(
                        sequence.Left.View(), sequence.Right.View(), StereoSequence.TimestampOf(i)))
                {
                    job.Wait();
                    if (job.GetSummary().VertexCount > 0) plan.Prepare(job); // there is a template
                    plan.Move(job, i);
                    plan.Write(file, i);
                    plan.Draw(sequence.Left, camera); // the tracker has its own copy
                    Write(Path.Combine(folder, i.ToString("D6") + ".ppm"), sequence.Left);
                    plan.Print(i, job.GetSummary().Body);
                }
            }
        }
    }

    private static void Write(string path, PngImage picture)
    {
        byte[] head =
            Encoding.ASCII.GetBytes("P6\n" + picture.Width + " " + picture.Height + "\n255\n"),
               rgb = new byte[picture.Pixels.Length];
        // from blue, green, red
        for (int i = 0; i < rgb.Length; ++i) rgb[i] = picture.Pixels[i + 2 - 2 * (i % 3)];
        using (FileStream file = File.Create(path))
        {
            file.Write(head, 0, head.Length);
            file.Write(rgb, 0, rgb.Length);
        }
    }
}

// From the scan to the tissue: registers a preoperative model to the template, once, and follows
// its targets through a stereo sequence.
//   scan_to_tissue LEFT RIGHT FX,FY,CX,CY,BASELINE_MM SCAN.obj LANDMARKS.csv TARGETS.csv OUT.csv
//       [DEVICE_ID]
// SCAN.obj is the organ's surface as the scan has it (CT, say), mm. LANDMARKS.csv has the columns
// x,y,z,u,v: three or more places of the scan, and the pixels of the first left image where
// somebody saw them, which therefore has to show the surface. TARGETS.csv has the columns id,x,y,z,
// in the scan's frame. OUT.csv has their positions in each frame, rectified left camera, with the
// error to be expected: that of the registration and that of tracking together. A registration that
// cannot be trusted ends the program, with the reason; a person has to look.
using System;
using System.Collections.Generic;
using System.IO;
using Defrec;

/// <summary>Rows of numbers, below a header.</summary>
internal sealed class Table
{
    internal readonly List<double[]> Rows = new List<double[]>();

    internal Table(string path, string header)
    {
        string[] lines = File.ReadAllLines(path);
        if (lines.Length == 0 || lines[0] != header)
            throw new SampleException(path + ": the header " + header + " expected");
        int columns = header.Split(',').Length;
        for (int i = 1; i < lines.Length; ++i)
        {
            string[] cells = lines[i].Split(',');
            if (cells.Length != columns)
                throw new SampleException(
                    path + ": line " + (i + 1) + ": " + columns + " numbers expected");
            Rows.Add(Array.ConvertAll(cells, cell => Sample.Number(cell, path)));
        }
    }

    /// <summary>So many columns from one on, row by row.</summary>
    internal double[] Columns(int first, int count)
    {
        var values = new double[count * Rows.Count];
        for (int i = 0; i < Rows.Count; ++i) Array.Copy(Rows[i], first, values, count * i, count);
        return values;
    }
}

/// <summary>The scan's targets, registered, and what becomes of them.</summary>
internal sealed class FollowedScan : IDisposable
{
    private const double LandmarkErrorMm = 1; // they are clicked, so they are not exact

    private readonly Mesh scan;
    private readonly Table landmarks, targets;
    private readonly double[] now, expectedErrorMm;
    private readonly PointStatus[] status;
    private Plan plan; // null before the first frame
    private bool isVoid; // its template was given up

    internal FollowedScan(string scanFile, string landmarksFile, string targetsFile)
    {
        scan = new Mesh(scanFile);
        landmarks = new Table(landmarksFile, "x,y,z,u,v");
        targets = new Table(targetsFile, "id,x,y,z");
        now = new double[3 * targets.Rows.Count];
        expectedErrorMm = new double[targets.Rows.Count];
        status = new PointStatus[targets.Rows.Count];
    }

    /// <summary>Registers the scan to the template of the first frame's job.</summary>
    internal void Register(Context context, Rig rig, Job job)
    {
        // The landmarks are its pixels: tissue is elsewhere in a later image.
        if (job.GetSummary().VertexCount == 0)
            throw new SampleException(
                "the landmarks are pixels of the first image, which shows no surface; begin " +
                "where one is seen");
        using (Template template = job.GetTemplate())
        {
            using (Registration registration =
                       RegisterSurface(context, template, StartByLandmarks(rig, template)))
                plan = Plan.Create(template, registration, targets: targets.Columns(1, 3));
            Sample.WaitForBody(template);
        }
    }

    // About where the scan lies.
    private RigidTransform StartByLandmarks(Rig rig, Template template)
    {
        double[] places = landmarks.Columns(0, 3), lifted = new double[places.Length],
                 uv = landmarks.Columns(3, 2);
        var found = new bool[landmarks.Rows.Count];
        rig.RectifyPixels(uv, uv);
        template.Lift(uv, lifted, found);
        List<double> model = new List<double>(), seen = new List<double>(),
                     errors = new List<double>();
        const double variance = LandmarkErrorMm * LandmarkErrorMm;
        for (int i = 0; i < found.Length; ++i)
        {
            if (!found[i]) continue; // the template has no surface there
            model.AddRange(new ArraySegment<double>(places, 3 * i, 3));
            seen.AddRange(new ArraySegment<double>(lifted, 3 * i, 3));
            errors.AddRange(new[] { variance, 0, 0, variance, 0, variance });
        }
        if (model.Count < 9)
            throw new SampleException(
                model.Count / 3 + " landmarks lie on the template, three or more expected");
        using (Registration registration = Registration.FromPairs(new PointPairs {
            ModelXyz = model.ToArray(), SeenXyz = seen.ToArray(), SeenCovariance = errors.ToArray()
        }))
        {
            Console.Write("landmarks: " + registration.Reason + "\n");
            if (registration.Verdict != Verdict.Accepted &&
                registration.Verdict != Verdict.Undetermined)
                throw new SampleException("the landmarks give no start: " + registration.Reason);
            return registration.Transform;
        }
    }

    // By the surface, which says much more.
    private Registration RegisterSurface(Context context, Template template, RigidTransform start)
    {
        var model = new TriangleMesh(
            Array.ConvertAll(scan.Vertices, value => (float)value), scan.Triangles);
        // The landmarks are not farther off.
        var options = new RegistrationOptions { Start = start, MaxShiftMm = 10, MaxTurnRad = 0.2 };
        Registration registration = Registration.FromTemplate(context, template, model, options);
        Console.Write("surface: " + registration.Reason + "\n");
        foreach (FreeMotion motion in registration.GetFreeMotions())
            Console.Write("not determined: " + motion.Text + "\n");
        if (registration.Verdict == Verdict.Accepted) return registration;
        string reason = registration.Reason;
        registration.Dispose();
        throw new SampleException("the scan is not registered: " + reason);
    }

    /// <summary>Writes where the targets are in the frame of this job.</summary>
    internal void Write(TextWriter file, int frame, Job job)
    {
        isVoid = isVoid || Sample.IsGivenUp(job, frame);
        if (!isVoid) job.MovePlan(plan, now, status, expectedErrorMm);
        for (int i = 0; i < status.Length; ++i)
        {
            file.Write(frame + "," + (long)targets.Rows[i][0] + ",");
            if (isVoid || status[i] == PointStatus.Unknown)
                file.Write(",,,lost,\n");
            else
                file.Write(
                    "{0},{1},{2},{3},{4}\n", Sample.Decimals(now[3 * i]),
                    Sample.Decimals(now[3 * i + 1]), Sample.Decimals(now[3 * i + 2]),
                    status[i] == PointStatus.Observed ? "tracked" : "extrapolated",
                    Sample.Decimals(expectedErrorMm[i]));
        }
    }

    public void Dispose()
    {
        if (plan != null) plan.Dispose();
    }
}

internal static class ScanToTissue
{
    private static int Main(string[] arguments)
    {
        return Sample.Run(
            () =>
            {
                if (arguments.Length < 7 || arguments.Length > 8)
                    throw new UsageException(
                        "scan_to_tissue LEFT RIGHT FX,FY,CX,CY,BASELINE_MM SCAN.obj " +
                        "LANDMARKS.csv TARGETS.csv OUT.csv [DEVICE_ID]");
                Follow(arguments, Sample.ParseCamera(arguments[2]));
            });
    }

    private static void Follow(string[] arguments, Camera camera)
    {
        string deviceId = arguments.Length > 7 ? arguments[7] : null; // null: the fastest
        var sequence = new StereoSequence(arguments[0], arguments[1]);
        using (var scan = new FollowedScan(arguments[3], arguments[4], arguments[5]))
        using (var context = new Context())
        using (var rig = new Rig(context, sequence.Rig(camera)))
        using (var tracker = new Tracker(context, rig, new TrackerOptions { DeviceId = deviceId }))
        using (var file = new StreamWriter(arguments[6]))
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
                    if (i == 0) scan.Register(context, rig, job);
                    scan.Write(file, i, job);
                }
            }
        }
    }
}

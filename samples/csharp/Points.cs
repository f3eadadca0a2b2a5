// Points that are followed: pixels of the first left image, and where they are in each frame.
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
    private bool isLookedUp; // on the first image, whether it showed a surface or not
    private bool isKnown; // it did, and its template is still followed

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
    /// Moves the points to the frame of this job. To be called of every frame, from the first on.
    /// </summary>
    internal void Follow(Rig rig, Job job)
    {
        bool hasSurface = job.GetSummary().VertexCount > 0;
        // The pixels are of the first image: tissue is elsewhere in a later one. What was found on
        // a template that is given up says nothing of the next one.
        if (!hasSurface) isKnown = false;
        if (hasSurface && !isLookedUp) Lift(rig, job);
        isLookedUp = true;
        if (isKnown) Warp(job);
    }

    private void Lift(Rig rig, Job job)
    {
        rig.RectifyPixels(uv, uv);
        using (Template template = job.GetTemplate())
        {
            Sample.WaitForBody(template);
            template.Lift(uv, atRest, found);
        }
        isKnown = true;
    }

    private void Warp(Job job)
    {
        job.WarpPoints(atRest, now, status, expectedErrorMm);
        for (int i = 0; i < status.Length; ++i)
            if (!found[i]) status[i] = PointStatus.Unknown;
    }

    internal int Count
    {
        get
        {
            return ids.Count;
        }
    }

    /// <summary>
    /// Tells the predictor where the points are in a frame, also one that is lost, and moves them
    /// to where they are at a time after it.
    /// </summary>
    internal void Predict(Predictor predictor, FrameSummary frame, long shownNs)
    {
        if (isKnown)
            predictor.AddFrame(
                frame.TimestampNs, frame.State, frame.Epoch, now, status, expectedErrorMm);
        else
            predictor.AddFrame(frame.TimestampNs, FrameState.Initialising, 0, null, null);
        predictor.Predict(shownNs, now, status, expectedErrorMm);
    }

    internal void Write(TextWriter file, int frame)
    {
        for (int i = 0; i < ids.Count; ++i)
        {
            file.Write(frame + "," + ids[i] + ",");
            if (!isKnown || status[i] == PointStatus.Unknown)
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

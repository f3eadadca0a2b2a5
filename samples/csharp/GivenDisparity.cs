// Disparity from outside: follows pixels of the first left image on the disparity of a stereo
// network, a depth camera or another matcher, in place of defrec's own.
//   given_disparity LEFT RIGHT FX,FY,CX,CY,BASELINE_MM DISPARITY SIGMA POINTS.csv OUT.csv
//                   [DEVICE_ID]
// DISPARITY is a folder with a PFM file for each image, in the order of their names: px of the
// rectified left image; 0, inf or NaN where there is none. SIGMA is the standard deviation of the
// error that a pixel shares with those around it: a number of px for all of them, or a folder of
// PFM files with that of each pixel. POINTS.csv has the columns id,u,v (px). OUT.csv has the
// position of each point in each frame: mm, rectified left camera.
using System;
using System.Globalization;
using System.IO;
using System.Text;
using Defrec;

/// <summary>Where the disparity comes from. A live program has its network's output here.</summary>
internal sealed class DisparitySource
{
    private readonly string[] disparityFiles, sigmaFiles; // the latter is null with sigmaPx
    private readonly float sigmaPx;
    private readonly Rig rig;

    internal DisparitySource(string folder, string sigma, int frames, Rig rig)
    {
        this.rig = rig;
        disparityFiles = FilesOf(folder, frames);
        if (!float.TryParse(sigma, NumberStyles.Float, CultureInfo.InvariantCulture, out sigmaPx))
            sigmaFiles = FilesOf(sigma, frames);
    }

    /// <summary>Adds the frame's disparity, with its error.</summary>
    internal void AddTo(ref Frame frame, int number)
    {
        frame.Disparity = ReadPfm(disparityFiles[number]);
        if (sigmaFiles == null)
            frame.DisparitySigmaPx = sigmaPx;
        else
            frame.DisparitySigma = ReadPfm(sigmaFiles[number]);
    }

    private static string[] FilesOf(string folder, int frames)
    {
        if (!Directory.Exists(folder))
            throw new SampleException(folder + ": cannot be read as a folder");
        string[] files = Directory.GetFiles(folder, "*.pfm");
        if (files.Length != frames)
            throw new SampleException(
                folder + " has " + files.Length + " PFM files, but there are " + frames +
                " frames");
        Array.Sort(files, string.CompareOrdinal);
        return files;
    }

    /// <summary>
    /// Values of the rectified image, rows from the top. What is not finite is 0.
    /// </summary>
    private float[] ReadPfm(string path)
    {
        byte[] bytes = File.ReadAllBytes(path);
        int at = 0, width, height;
        float scale;
        string kind = Word(bytes, ref at);
        if (kind != "Pf" || !int.TryParse(Word(bytes, ref at), out width) ||
            !int.TryParse(Word(bytes, ref at), out height) ||
            !float.TryParse(
                Word(bytes, ref at), NumberStyles.Float, CultureInfo.InvariantCulture, out scale))
            throw new SampleException(path + ": a PFM of one channel expected");
        if (width != rig.Width || height != rig.Height)
            throw new SampleException(
                path + ": is " + width + "x" + height + ", the rectified image is " + rig.Width +
                "x" + rig.Height);
        if (bytes.Length - at < 4 * width * height)
            throw new SampleException(path + ": is cut off");
        var values = new float[width * height];
        for (int y = height - 1; y >= 0; --y) // the last row comes first
            for (int x = 0; x < width; ++x, at += 4)
            {
                if (scale < 0 != BitConverter.IsLittleEndian) Array.Reverse(bytes, at, 4);
                float value = BitConverter.ToSingle(bytes, at);
                bool isFinite = !float.IsNaN(value) && !float.IsInfinity(value);
                values[y * width + x] = isFinite ? value : 0;
            }
        return values;
    }

    /// <summary>Up to a blank, and past it.</summary>
    private static string Word(byte[] bytes, ref int at)
    {
        int begin = at;
        while (at < bytes.Length && bytes[at] > ' ') ++at;
        string word = Encoding.ASCII.GetString(bytes, begin, at - begin);
        if (at < bytes.Length) ++at;
        return word;
    }
}

internal static class GivenDisparity
{
    private static int Main(string[] arguments)
    {
        return Sample.Run(
            () =>
            {
                if (arguments.Length < 7 || arguments.Length > 8)
                    throw new UsageException(
                        "given_disparity LEFT RIGHT FX,FY,CX,CY,BASELINE_MM DISPARITY SIGMA " +
                        "POINTS.csv OUT.csv [DEVICE_ID]");
                Track(
                    new StereoSequence(arguments[0], arguments[1]),
                    Sample.ParseCamera(arguments[2]), arguments[3], arguments[4],
                    new FollowedPoints(arguments[5]), arguments[6],
                    arguments.Length > 7 ? arguments[7] : null);
            });
    }

    private static void Track(
        StereoSequence sequence, Camera camera, string disparity, string sigma,
        FollowedPoints followed, string outPath, string deviceId)
    {
        int contradicted = 0;
        using (var context = new Context())
        using (var rig = new Rig(context, sequence.Rig(camera)))
        using (var tracker = new Tracker(context, rig, new TrackerOptions { DeviceId = deviceId }))
        {
            var source = new DisparitySource(disparity, sigma, sequence.Count, rig);
            using (var file = new StreamWriter(outPath))
            {
                file.Write("frame,id,x,y,z,status,expected_error_mm\n");
                for (int i = 0; i < sequence.Count; ++i)
                {
                    sequence.Read(i);
                    // The right image stays required: the disparity is compared with both.
                    var frame = new Frame(
                        sequence.Left.View(), sequence.Right.View(), StereoSequence.TimestampOf(i));
                    source.AddTo(ref frame, i);
                    using (Job job = tracker.Submit(frame))
                    {
                        job.Wait();
                        FrameSummary found = job.GetSummary();
                        // Another unit, another frame or another rectification: do not go on
                        // unnoticed.
                        if ((found.Reasons & Reasons.Disparity) != 0) ++contradicted;
                        followed.Follow(rig, job);
                        followed.Write(file, i);
                    }
                }
            }
        }
        Console.WriteLine(
            sequence.Count + " frames, in " + contradicted +
            " of them the images contradict the disparity");
    }
}

// Input of the samples: a camera on the command line, folders of PNG images.
using System;
using System.Globalization;
using System.IO;
using Defrec;

/// <summary>Ends a sample: an error message on stderr, exit code 1.</summary>
internal sealed class SampleException : Exception
{
    internal SampleException(string message) : base(message) { }
}

/// <summary>The command line was wrong: exit code 2.</summary>
internal sealed class UsageException : Exception
{
    internal UsageException(string usage) : base("usage: " + usage) { }
}

internal static class Sample
{
    /// <summary>
    /// Whether a tracker that had a template has none in this frame: it was given up, which is said
    /// on standard error. All in its frame of reference is void then, and the next template needs a
    /// registration of its own.
    /// </summary>
    internal static bool IsGivenUp(Job job, int frame)
    {
        if (job.GetSummary().VertexCount > 0) return false;
        Console.Error.WriteLine(
            "frame " + frame + ": the template was given up; the targets are lost until they are " +
            "registered to another");
        return true;
    }

    /// <summary>
    /// Waits for the body beneath the surface, as results of a recording must not depend on when it
    /// is ready. A live loop goes on meanwhile: FrameSummary.Body says whether it is. A template of
    /// which no body can be made moves points rigidly beneath its surface.
    /// </summary>
    internal static void WaitForBody(Template template)
    {
        try
        {
            template.WaitForBody();
        }
        catch (DefrecException e) when (e.Status == Status.ErrorUnsupported)
        {
        }
    }

    /// <summary>Runs a sample; prints its exceptions as one line on stderr.</summary>
    internal static int Run(Action sample)
    {
        try
        {
            sample();
            return 0;
        }
        catch (UsageException e)
        {
            Console.Error.WriteLine(e.Message);
            return 2;
        }
        catch (DefrecException e)
        {
            Console.Error.WriteLine(e.Message + " (" + DefrecLibrary.NameOf(e.Status) + ")");
        }
        catch (Exception e) when (
            e is SampleException || e is IOException || e is UnauthorizedAccessException ||
            e is DllNotFoundException)
        {
            Console.Error.WriteLine(e.Message);
        }
        return 1;
    }

    /// <summary>Text with four decimals, as C's "%.4f" writes it, in every locale.</summary>
    internal static string Decimals(double value)
    {
        string text = value.ToString("F4", CultureInfo.InvariantCulture);
        return text == "-0.0000" ? "0.0000" : text;
    }

    internal static double Number(string text, string what)
    {
        double value;
        if (!double.TryParse(text, NumberStyles.Float, CultureInfo.InvariantCulture, out value))
            throw new SampleException(what + ": \"" + text + "\" is no number");
        return value;
    }

    /// <summary>"FX,FY,CX,CY,BASELINE_MM" of a rectified pair.</summary>
    internal static Camera ParseCamera(string text)
    {
        string[] numbers = text.Split(',');
        if (numbers.Length != 5)
            throw new SampleException(
                "the camera is \"" + text + "\"; FX,FY,CX,CY,BASELINE_MM expected");
        double[] n = Array.ConvertAll(numbers, number => Number(number, "the camera"));
        return new Camera(n[0], n[1], n[2], n[3], n[4]);
    }
}

/// <summary>
/// Rows from the top without gaps; the array is kept for the next image of the same size.
/// </summary>
internal sealed class PngImage
{
    internal int Width, Height;
    internal byte[] Pixels = new byte[0]; // blue, green, red

    internal void Read(string path)
    {
        if (!File.Exists(path)) throw new SampleException(path + ": cannot be read");
        var file = new PngFile(path);
        if (Pixels.Length > 0 && (Width != file.Width || Height != file.Height))
            throw new SampleException(
                path + ": is " + file.Width + "x" + file.Height + ", the images before it were " +
                Width + "x" + Height);
        Width = file.Width;
        Height = file.Height;
        if (Pixels.Length == 0) Pixels = new byte[3 * Width * Height];
        file.CopyTo(Pixels);
    }

    /// <summary>The image in the form that the tracker takes.</summary>
    internal Image View() { return new Image(Pixels, Width, Height, PixelFormat.Bgr8); }

    /// <summary>Gray values as stage rectify makes them.</summary>
    internal byte[] Gray()
    {
        var gray = new byte[Width * Height];
        for (int i = 0; i < gray.Length; ++i)
        {
            int blue = Pixels[3 * i], green = Pixels[3 * i + 1], red = Pixels[3 * i + 2];
            gray[i] = (byte)((77 * red + 150 * green + 29 * blue + 128) >> 8);
        }
        return gray;
    }
}

/// <summary>Two folders, frame by frame in the order of the names, at 30 frames a second.</summary>
internal sealed class StereoSequence
{
    private readonly string[] leftFiles, rightFiles;
    internal readonly PngImage Left = new PngImage(), Right = new PngImage();

    /// <summary>With its first frame read.</summary>
    internal StereoSequence(string leftFolder, string rightFolder)
    {
        leftFiles = FilesOf(leftFolder);
        rightFiles = FilesOf(rightFolder);
        if (leftFiles.Length != rightFiles.Length)
            throw new SampleException(
                leftFolder + " has " + leftFiles.Length + " images, " + rightFolder + " has " +
                rightFiles.Length);
        Read(0);
        if (Left.Width != Right.Width || Left.Height != Right.Height)
            throw new SampleException(rightFiles[0] + ": is not of the size of the left image");
    }

    internal int Count => leftFiles.Length;

    internal void Read(int frame) { Read(frame, Left, Right); }

    internal void Read(int frame, PngImage left, PngImage right)
    {
        left.Read(leftFiles[frame]);
        right.Read(rightFiles[frame]);
    }

    internal static long TimestampOf(int frame) { return frame * 1000000000L / 30; }

    /// <summary>Two rectified cameras of these images' size.</summary>
    internal RigDescription Rig(Camera camera)
    {
        return RigDescription.Rectified(Left.Width, Left.Height, camera);
    }

    private static string[] FilesOf(string folder)
    {
        if (!Directory.Exists(folder))
            throw new SampleException(folder + ": cannot be read as a folder");
        string[] files = Directory.GetFiles(folder, "*.png");
        if (files.Length == 0) throw new SampleException(folder + ": no PNG images in it");
        Array.Sort(files, string.CompareOrdinal);
        return files;
    }
}

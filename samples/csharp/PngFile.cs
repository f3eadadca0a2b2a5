// Reads PNG images with nothing but .NET's class library, so that the samples run wherever it does:
// System.Drawing takes libgdiplus on Linux, and newer .NET has it on Windows alone.
using System;
using System.IO;
using System.IO.Compression;
using System.Text;

/// <summary>
/// A PNG image (ISO/IEC 15948) with 8 bits a channel, gray or RGB, not interlaced. Alpha is left
/// out; checksums are not compared.
/// </summary>
internal sealed class PngFile
{
    private const int MaxSide = 32768;
    private static readonly byte[] Signature = { 0x89, 0x50, 0x4E, 0x47, 0x0D, 0x0A, 0x1A, 0x0A };

    internal readonly int Width, Height;
    private readonly string path;
    private readonly int channels;
    private readonly MemoryStream compressed = new MemoryStream();

    /// <summary>Reads the file; what it shows is decoded by CopyTo.</summary>
    internal PngFile(string path)
    {
        this.path = path;
        byte[] file = File.ReadAllBytes(path);
        for (int i = 0; i < Signature.Length; ++i)
            if (i >= file.Length || file[i] != Signature[i]) throw Fault("is no PNG image");
        string type;
        int at = Signature.Length;
        do {
            int length = at + 12 <= file.Length ? Number(file, at) : -1;
            if (length < 0 || length > file.Length - at - 12) throw Fault("is cut short");
            type = Encoding.ASCII.GetString(file, at + 4, 4);
            if ((type == "IHDR") != (at == Signature.Length)) throw Fault("has no header first");
            at += 8;
            if (type == "IHDR")
            {
                if (length != 13) throw Fault("has a header that is none");
                Width = Number(file, at);
                Height = Number(file, at + 4);
                channels = ChannelsOf(file, at + 8);
            }
            if (type == "IDAT") compressed.Write(file, at, length);
            at += length + 4;
        } while (type != "IEND");
        if (Width < 1 || Height < 1 || Width > MaxSide || Height > MaxSide)
            throw Fault("is of " + Width + "x" + Height);
    }

    /// <summary>Blue, green, red of each pixel, rows from the top without gaps.</summary>
    internal void CopyTo(byte[] pixels)
    {
        byte[] row = new byte[Width * channels], above = new byte[row.Length];
        // The first two bytes are the head of zlib's format.
        compressed.Position = Math.Min(2, compressed.Length);
        try
        {
            using (var stream = new DeflateStream(compressed, CompressionMode.Decompress))
                for (int y = 0; y < Height; ++y)
                {
                    int filter = stream.ReadByte();
                    for (int got = 0, more; got < row.Length; got += more)
                    {
                        more = stream.Read(row, got, row.Length - got);
                        if (more <= 0) throw Fault("has too few rows");
                    }
                    Unfilter(filter, row, above);
                    for (int x = 0, from = 0, to = 3 * Width * y; x < Width; ++x, from += channels)
                    {
                        bool isGray = channels < 3;
                        pixels[to++] = row[isGray ? from : from + 2];
                        pixels[to++] = row[isGray ? from : from + 1];
                        pixels[to++] = row[from];
                    }
                    byte[] done = above;
                    above = row;
                    row = done;
                }
        }
        catch (Exception e) when (e is InvalidDataException || e is IOException)
        {
            throw Fault("is damaged");
        }
    }

    /// <summary>Adds what each byte was predicted to be: section 9 of the standard.</summary>
    private void Unfilter(int filter, byte[] row, byte[] above)
    {
        if (filter < 0 || filter > 4) throw Fault("is damaged");
        for (int i = 0; i < row.Length; ++i)
        {
            int left = i < channels ? 0 : row[i - channels];
            int corner = i < channels ? 0 : above[i - channels];
            int predicted = filter == 0   ? 0
                            : filter == 1 ? left
                            : filter == 2 ? above[i]
                            : filter == 3 ? (left + above[i]) / 2
                                          : Nearest(left, above[i], corner);
            row[i] = (byte)(row[i] + predicted);
        }
    }

    /// <summary>The Paeth predictor.</summary>
    private static int Nearest(int left, int above, int corner)
    {
        int fromLeft = Math.Abs(above - corner), fromAbove = Math.Abs(left - corner);
        int fromCorner = Math.Abs(left + above - 2 * corner);
        if (fromLeft <= fromAbove && fromLeft <= fromCorner) return left;
        return fromAbove <= fromCorner ? above : corner;
    }

    /// <summary>
    /// The header's last five bytes are bits, colours, compression, filter and interlace.
    /// </summary>
    private int ChannelsOf(byte[] file, int at)
    {
        int colours = file[at + 1];
        bool isPlain = file[at] == 8 && file[at + 2] == 0 && file[at + 3] == 0 && file[at + 4] == 0;
        if (!isPlain || (colours != 0 && colours != 2 && colours != 4 && colours != 6))
            throw Fault("8 bits a channel, gray or RGB, not interlaced, expected");
        return (colours & 2) + 1 + (colours >> 2);
    }

    private static int Number(byte[] file, int at)
    {
        return file[at] << 24 | file[at + 1] << 16 | file[at + 2] << 8 | file[at + 3];
    }

    private SampleException Fault(string what) { return new SampleException(path + ": " + what); }
}

// A triangle mesh of an OBJ file, for the samples.
using System;
using System.Collections.Generic;
using System.IO;

/// <summary>The lines "v X Y Z" and "f A B C" of an OBJ file.</summary>
internal sealed class Mesh
{
    internal readonly double[] Vertices; // xyz
    internal readonly uint[] Triangles; // three vertices each, counted from 0

    internal Mesh(string path)
    {
        var xyz = new List<double>();
        var corners = new List<uint>();
        foreach (string line in File.ReadAllLines(path))
        {
            string[] words = line.Split(new[] { ' ' }, StringSplitOptions.RemoveEmptyEntries);
            if (words.Length == 0 || (words[0] != "v" && words[0] != "f")) continue;
            if (words.Length != 4)
                throw new SampleException(
                    path + ": \"v X Y Z\" or \"f A B C\" expected, found \"" + line + "\"");
            if (words[0] == "v")
                for (int i = 1; i < 4; ++i) xyz.Add(Sample.Number(words[i], path));
            else
                for (int i = 1; i < 4; ++i) corners.Add(Index(words[i], path));
        }
        Vertices = xyz.ToArray();
        Triangles = corners.ToArray();
        if (Vertices.Length == 0) throw new SampleException(path + ": has no vertices");
        if (corners.Exists(corner => corner >= Vertices.Length / 3))
            throw new SampleException(path + ": a triangle names a vertex that is not there");
    }

    private static uint Index(string text, string path)
    {
        uint index;
        if (!uint.TryParse(text, out index) || index < 1)
            throw new SampleException(path + ": \"" + text + "\" is no vertex");
        return index - 1;
    }
}

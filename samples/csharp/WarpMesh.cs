// Moves a preoperative model along with the tissue: reads a mesh and writes one mesh for each
// frame, with a status and an expected error at each vertex.
//   warp_mesh LEFT RIGHT FX,FY,CX,CY,BASELINE_MM MESH.obj OUT_FOLDER [DEVICE_ID]
// MESH.obj is in the template frame (the rectified left camera of the frame that became the
// template; an application registers its model to that), in mm. OUT_FOLDER/000000.ply and so on are
// in the rectified left camera of their frame; status is PointStatus, expected_error_mm the
// root mean square of the error to be expected.
using System;
using System.Collections.Generic;
using System.IO;
using Defrec;

/// <summary>The lines "v X Y Z" and "f A B C" of an OBJ file.</summary>
internal sealed class Mesh
{
    internal readonly double[] Vertices; // xyz
    internal readonly List<string> Triangles = new List<string>(); // "A B C", counted from 0
    private int last = -1; // the largest of them

    internal Mesh(string path)
    {
        var xyz = new List<double>();
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
                Triangles.Add(
                    Index(words[1], path) + " " + Index(words[2], path) + " " +
                    Index(words[3], path));
        }
        Vertices = xyz.ToArray();
        if (Vertices.Length == 0) throw new SampleException(path + ": has no vertices");
        if (last >= Vertices.Length / 3)
            throw new SampleException(path + ": a triangle names a vertex that is not there");
    }

    private int Index(string text, string path)
    {
        int index;
        if (!int.TryParse(text, out index) || index < 1)
            throw new SampleException(path + ": \"" + text + "\" is no vertex");
        last = Math.Max(last, index - 1);
        return index - 1;
    }
}

internal static class WarpMesh
{
    private static int Main(string[] arguments)
    {
        return Sample.Run(
            () =>
            {
                if (arguments.Length < 5 || arguments.Length > 6)
                    throw new UsageException(
                        "warp_mesh LEFT RIGHT FX,FY,CX,CY,BASELINE_MM MESH.obj OUT_FOLDER " +
                        "[DEVICE_ID]");
                Warp(
                    arguments[0], arguments[1], Sample.ParseCamera(arguments[2]), arguments[3],
                    arguments[4], arguments.Length > 5 ? arguments[5] : null);
            });
    }

    private static void Warp(
        string left, string right, Camera camera, string model, string folder, string deviceId)
    {
        var sequence = new StereoSequence(left, right);
        var mesh = new Mesh(model);
        Directory.CreateDirectory(folder);
        int count = mesh.Vertices.Length / 3;
        double[] xyz = new double[3 * count], expectedErrorMm = new double[count];
        var status = new PointStatus[count];
        using (var context = new Context())
        using (var rig = new Rig(context, sequence.Rig(camera)))
            // null: the fastest
            using (var tracker =
                       new Tracker(context, rig, new TrackerOptions { DeviceId = deviceId }))
            {
                for (int i = 0; i < sequence.Count; ++i)
                {
                    sequence.Read(i);
                    using (Job job = tracker.Submit(
                               sequence.Left.View(), sequence.Right.View(),
                               StereoSequence.TimestampOf(i)))
                    {
                        job.Wait();
                        if (job.GetSummary().VertexCount == 0) continue; // no template yet
                        // Results of a recording must not depend on when the body is ready.
                        using (Template template = job.GetTemplate()) template.WaitForBody();
                        job.WarpPoints(mesh.Vertices, xyz, status, expectedErrorMm);
                        Write(
                            Path.Combine(folder, i.ToString("D6") + ".ply"), mesh, xyz, status,
                            expectedErrorMm);
                    }
                }
            }
    }

    private static void Write(
        string path, Mesh mesh, double[] xyz, PointStatus[] status, double[] expectedErrorMm)
    {
        using (var file = new StreamWriter(path))
        {
            file.Write(
                "ply\nformat ascii 1.0\ncomment millimetres, left rectified camera\n" +
                "element vertex " + status.Length + "\n");
            file.Write(
                "property float x\nproperty float y\nproperty float z\n" +
                "property uchar status\nproperty float expected_error_mm\n");
            file.Write(
                "element face " + mesh.Triangles.Count +
                "\nproperty list uchar uint vertex_indices\nend_header\n");
            for (int i = 0; i < status.Length; ++i)
                file.Write(
                    "{0} {1} {2} {3} {4}\n", Sample.Decimals(xyz[3 * i]),
                    Sample.Decimals(xyz[3 * i + 1]), Sample.Decimals(xyz[3 * i + 2]),
                    (int)status[i], Sample.Decimals(expectedErrorMm[i]));
            foreach (string triangle in mesh.Triangles) file.Write("3 " + triangle + "\n");
        }
    }
}

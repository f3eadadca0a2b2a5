// Moves a preoperative model along with the tissue: reads a mesh and writes one mesh for each
// frame, with a status and an expected error at each vertex.
//   warp_mesh LEFT RIGHT FX,FY,CX,CY,BASELINE_MM MESH.obj OUT_FOLDER [DEVICE_ID]
// MESH.obj is in the template frame (the rectified left camera of the frame that became the
// template; an application registers its model to that), in mm. OUT_FOLDER/000000.ply and so on are
// in the rectified left camera of their frame; status is PointStatus, expected_error_mm the
// root mean square of the error to be expected.
using System;
using System.IO;
using Defrec;

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
                        using (Template template = job.GetTemplate()) Sample.WaitForBody(template);
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
                "element face " + mesh.Triangles.Length / 3 +
                "\nproperty list uchar uint vertex_indices\nend_header\n");
            for (int i = 0; i < status.Length; ++i)
                file.Write(
                    "{0} {1} {2} {3} {4}\n", Sample.Decimals(xyz[3 * i]),
                    Sample.Decimals(xyz[3 * i + 1]), Sample.Decimals(xyz[3 * i + 2]),
                    (int)status[i], Sample.Decimals(expectedErrorMm[i]));
            for (int i = 0; i < mesh.Triangles.Length; i += 3)
                file.Write(
                    "3 {0} {1} {2}\n", mesh.Triangles[i], mesh.Triangles[i + 1],
                    mesh.Triangles[i + 2]);
        }
    }
}

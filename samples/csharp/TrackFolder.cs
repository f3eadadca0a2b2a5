// Follows pixels of the first left image through a stereo sequence.
//   track_folder LEFT RIGHT FX,FY,CX,CY,BASELINE_MM POINTS.csv OUT.csv [DEVICE_ID]
// POINTS.csv has the columns id,u,v (px). OUT.csv has the position of each point in each frame: mm,
// rectified left camera.
using System.IO;
using Defrec;

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
                    followed.Follow(rig, job);
                    followed.Write(file, i);
                }
            }
        }
    }
}

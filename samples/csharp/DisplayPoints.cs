// Points at the time of display: follows pixels of the first left image, and says of each frame
// where they are when it is shown.
//   display_points LEFT RIGHT FX,FY,CX,CY,BASELINE_MM POINTS.csv DELAY_MS OUT.csv [DEVICE_ID]
// POINTS.csv has the columns id,u,v (px). DELAY_MS, at most 100, is the time from when a frame was
// taken to when the screen shows what is drawn for it. OUT.csv has the position of each point that
// long after each frame, with the error to be expected then: mm, rectified left camera.
using System;
using System.IO;
using Defrec;

internal static class DisplayPoints
{
    private static int Main(string[] arguments)
    {
        return Sample.Run(
            () =>
            {
                if (arguments.Length < 6 || arguments.Length > 7)
                    throw new UsageException(
                        "display_points LEFT RIGHT FX,FY,CX,CY,BASELINE_MM POINTS.csv DELAY_MS " +
                        "OUT.csv [DEVICE_ID]");
                Track(
                    arguments[0], arguments[1], Sample.ParseCamera(arguments[2]), arguments[3],
                    Sample.Number(arguments[4], "the delay"), arguments[5],
                    arguments.Length > 6 ? arguments[6] : null);
            });
    }

    private static void Track(
        string left, string right, Camera camera, string points, double delayMs, string outPath,
        string deviceId)
    {
        var sequence = new StereoSequence(left, right);
        var followed = new FollowedPoints(points);
        using (var context = new Context())
        using (var rig = new Rig(context, sequence.Rig(camera)))
        using (var tracker = new Tracker(context, rig, new TrackerOptions { DeviceId = deviceId }))
        using (var predictor = new Predictor(followed.Count))
        using (var file = new StreamWriter(outPath))
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
                    FrameSummary frame = job.GetSummary();
                    followed.Follow(rig, job);
                    // A live program asks when it draws, with the time at which it is shown.
                    followed.Predict(
                        predictor, frame, frame.TimestampNs + (long)Math.Round(1e6 * delayMs));
                    followed.Write(file, i);
                }
            }
        }
    }
}

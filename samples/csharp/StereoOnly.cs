// A single stage: the disparity of a rectified pair of images.
//   stereo_only LEFT.png RIGHT.png OUT.pgm [DEVICE_ID]
// OUT.pgm has 16 bits a pixel: disparity in 1/16 px, 0 where there is none.
using System.IO;
using System.Text;
using Defrec;

internal static class StereoOnly
{
    private static int Main(string[] arguments)
    {
        return Sample.Run(
            () =>
            {
                if (arguments.Length < 3 || arguments.Length > 4)
                    throw new UsageException("stereo_only LEFT.png RIGHT.png OUT.pgm [DEVICE_ID]");
                PngImage left = new PngImage(), right = new PngImage();
                left.Read(arguments[0]);
                right.Read(arguments[1]);
                if (left.Width != right.Width || left.Height != right.Height)
                    throw new SampleException(
                        arguments[1] + ": is not of the size of the left image");
                var disparity = new short[left.Width * left.Height];
                // 0 selects the default.
                var parameters =
                    new StereoParameters { Width = (uint)left.Width, Height = (uint)left.Height };
                using (var context = new Context())
                using (var stereo = new Stage(
                           context, parameters, arguments.Length > 3 ? arguments[3] : null))
                {
                    // docs/stages/stereo.md lists the buffers; optional ones may be left out at the
                    // end.
                    stereo.Run(
                        new StageBuffer[] { left.Gray(), right.Gray() },
                        new StageBuffer[] { disparity });
                }
                Write(arguments[2], disparity, left.Width, left.Height);
            });
    }

    private static void Write(string path, short[] disparity, int width, int height)
    {
        using (var file = new BufferedStream(File.Create(path)))
        {
            byte[] head = Encoding.ASCII.GetBytes("P5\n" + width + " " + height + "\n65535\n");
            file.Write(head, 0, head.Length);
            foreach (short d in disparity)
            {
                int value = d == Constants.DisparityNone ? 0 : d;
                file.WriteByte((byte)(value >> 8)); // the most significant byte first
                file.WriteByte((byte)value);
            }
        }
    }
}

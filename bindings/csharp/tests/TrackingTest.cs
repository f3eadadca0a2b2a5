using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Runtime.InteropServices;
using System.Text.RegularExpressions;
using System.Threading;
using NUnit.Framework;

namespace Defrec.Tests
{
    /// <summary>
    /// A real library and a real sequence: what comes out is what `defrec track` wrote, and the
    /// parts of a result fit together.
    /// </summary>
    [TestFixture]
    public class TrackingTest
    {
        private const int FrameCount = 6;

        // frame,x,y,z,status,expected_error_mm of every point, as `defrec track` prints them.
        private static List<string> Points(TrackingSession session)
        {
            var rows = new List<string>();
            double[] uv = TrackingSession.Pixels(), atRest = null,
                     now = new double[uv.Length / 2 * 3], error = new double[uv.Length / 2];
            var found = new bool[uv.Length / 2];
            var status = new PointStatus[found.Length];
            for (int frame = 0; frame < FrameCount; ++frame)
            {
                using (Job job = session.Track(frame))
                {
                    if (atRest == null)
                    {
                        atRest = new double[now.Length];
                        session.Rig.RectifyPixels(uv, uv);
                        using (Template template = session.Tracker.GetTemplate())
                        {
                            template.WaitForBody();
                            template.Lift(uv, atRest, found);
                        }
                    }
                    job.WarpPoints(atRest, now, status, error);
                }
                for (int i = 0; i < found.Length; ++i)
                {
                    bool isLost = !found[i] || status[i] == PointStatus.Unknown;
                    rows.Add(
                        frame + (isLost
                                     ? ",,,,lost,"
                                     : string.Join("", now.Skip(3 * i).Take(3).Select(Text)) +
                                           (status[i] == PointStatus.Observed ? ",tracked"
                                                                              : ",extrapolated") +
                                           Text(error[i])));
                }
            }
            return rows;
        }

        private static string Text(double value) { return "," + Sample.Decimals(value); }

        private static List<string> PointsOfProgram()
        {
            string[] lines = File.ReadAllLines(Path.Combine(TestPaths.Tracked, "points.csv"));
            List<string> head = lines[0].Split(',').ToList();
            int[] columns = new[] { "frame", "x", "y", "z", "status", "expected_error_mm" }
                                .Select(name => head.IndexOf(name))
                                .ToArray();
            return lines.Skip(1)
                .Select(line => line.Split(','))
                .Where(cells => int.Parse(cells[columns[0]]) < FrameCount)
                .Select(cells => string.Join(",", columns.Select(column => cells[column])))
                .ToList();
        }

        [Test]
        public void PointsEqualThoseOfTheProgram()
        {
            List<string> expected = PointsOfProgram();
            Assert.That(
                expected.Count(row => row.Contains(",tracked,")),
                Is.GreaterThan(expected.Count / 2));
            using (var session = new TrackingSession(null))
                Assert.That(Points(session), Is.EqualTo(expected));
        }

        [Test]
        public void TwoTrackersOnTwoThreads()
        {
            List<string> expected = PointsOfProgram();
            var results = new List<string>[2];
            Thread[] threads = Enumerable.Range(0, 2)
                                   .Select(
                                       i => new Thread(
                                           () =>
                                           {
                                               using (var session = new TrackingSession(null))
                                                   results[i] = Points(session);
                                           }))
                                   .ToArray();
            foreach (Thread thread in threads) thread.Start();
            foreach (Thread thread in threads) thread.Join();
            foreach (List<string> result in results) Assert.That(result, Is.EqualTo(expected));
        }

        [Test]
        public void TrackersAreSpreadOverTheDevicesOfABackend()
        {
            const string Spread = "several_devices:*";
            var options = new ContextOptions { OnlyGivenPlugins = true };
            options.PluginPaths.Add(TestPaths.SeveralDevicesPlugin);
            using (
                var session =
                    new TrackingSession(new TrackerOptions { DeviceId = Spread }, options))
            using (
                var second = new Tracker(
                    session.Context, session.Rig, new TrackerOptions { DeviceId = Spread }))
            using (Job job = session.Track(0))
            using (Job other =
                       second.Submit(session.Frames.Left.View(), session.Frames.Right.View(), 0))
            {
                other.Wait();
                Assert.That(job.GetResult().DeviceId, Is.EqualTo("several_devices:0"));
                Assert.That(
                    other.GetResult().DeviceId, Is.EqualTo("several_devices:2"),
                    "number 1 cannot be opened");
            }
        }

        [Test]
        public void TargetsMoveAsPointsDo()
        {
            using (var session = new TrackingSession(null))
            {
                Template template;
                using (Job job = session.Track(0)) template = job.GetTemplate();
                SurfacePoint[] vertices = template.GetVertices();
                var plan = new double[3 * vertices.Length];
                for (int i = 0; i < vertices.Length; ++i)
                {
                    Float3 at = vertices[i].Position;
                    double depth = 1 + i % 5; // mm, along the line of sight
                    for (int k = 0; k < 3; ++k)
                        plan[3 * i + k] = new[] { at.X, at.Y, at.Z }[k] * (1 + depth / at.Z);
                }
                plan[4] = double.NaN;
                template.SetBody(new BodyDescription { PoissonRatio = 0.45f });
                template.WaitForBody();
                var open = new BodyDescription {
                    Mesh = new TriangleMesh(
                        new float[] { 0, 0, 50, 9, 0, 50, 0, 9, 50 }, new uint[] { 0, 1, 2 })
                };
                Assert.That(
                    Assert.Throws<DefrecException>(() => template.SetBody(open)).Status,
                    Is.EqualTo(Status.ErrorArgument));
                using (var targets = new Targets(template, plan))
                {
                    template.Dispose();
                    Assert.That(targets.Count, Is.EqualTo(vertices.Length));
                    double[] xyz = new double[plan.Length], error = new double[targets.Count],
                             covariance = new double[2 * plan.Length];
                    double[] expectedXyz = new double[plan.Length],
                             expectedError = new double[targets.Count],
                             expectedCovariance = new double[2 * plan.Length];
                    PointStatus[] status = new PointStatus[targets.Count],
                                  expectedStatus = new PointStatus[targets.Count];
                    for (int frame = 1; frame < 4; ++frame)
                    {
                        using (Job job = session.Track(frame))
                        {
                            Assert.That(job.GetSummary().Body, Is.EqualTo(BodyState.Ready));
                            job.MoveTargets(targets, xyz, status, error, covariance);
                            job.WarpPoints(plan, expectedXyz, expectedStatus, expectedError);
                            job.GetPointCovariances(plan, expectedCovariance);
                        }
                        Assert.That(xyz, Is.EqualTo(expectedXyz).Within(1e-6));
                        Assert.That(status, Is.EqualTo(expectedStatus));
                        Assert.That(error, Is.EqualTo(expectedError).Within(1e-6));
                        Assert.That(covariance, Is.EqualTo(expectedCovariance).Within(1e-6));
                        Assert.That(status[1], Is.EqualTo(PointStatus.Unknown), "it is not finite");
                        Assert.That(xyz[3], Is.NaN);
                        Assert.That(status, Has.Some.EqualTo(PointStatus.Extrapolated));
                    }
                }
            }
        }

        [Test]
        public void APlanIsSavedLoadedAndFollowed()
        {
            string file = Path.Combine(Path.GetTempPath(), Path.GetRandomFileName());
            double[] places = { -10, -8, 60, 12, -7, 64, -9, 9, 58, 11, 8, 66 };
            double[] shifted = places.Select((value, i) => value - 5 * (i % 3)).ToArray();
            var errors = new double[24];
            for (int i = 0; i < errors.Length; ++i)
                errors[i] = i % 6 == 0 || i % 6 == 3 || i % 6 == 5 ? 0.09 : 0;
            using (var session = new TrackingSession(null))
            using (Registration found = Registration.FromPairs(new PointPairs {
                ModelXyz = shifted, SeenXyz = places, SeenCovariance = errors
            }))
            {
                Template template;
                using (Job job = session.Track(0)) template = job.GetTemplate();
                template.WaitForBody();
                var model = new TriangleMesh(
                    shifted.Select(value => (float)value).ToArray(), new uint[] { 0, 1, 2 });
                using (Plan made = Plan.Create(
                           template, found, model, new[] { new PlanPart("tumour \u00e9", 0, 1) },
                           shifted, targetNames: new[] { "", "tumour centre", null, "\u00e9" }))
                    made.Save(file);
                using (Plan plan = Plan.Load(template, file))
                using (var targets = new Targets(template, plan.GetTemplateXyz()))
                using (Job job = session.Track(1))
                {
                    Assert.That(plan.Verdict, Is.EqualTo(Verdict.Accepted));
                    Assert.That(plan.VertexCount + plan.TargetCount, Is.EqualTo(8));
                    Assert.That(plan.Parts[0].Name, Is.EqualTo("tumour \u00e9"));
                    Assert.That(plan.Parts[0].TriangleCount, Is.EqualTo(1));
                    Assert.That(
                        plan.TargetNames, Is.EqualTo(new[] { "", "tumour centre", "", "\u00e9" }));
                    Assert.That(plan.PointOf("tumour centre"), Is.EqualTo(5));
                    Assert.That(plan.PointOf("vessel"), Is.EqualTo(-1));
                    Assert.That(plan.GetModel().Triangles, Is.EqualTo(model.Triangles));
                    Assert.That(plan.GetTemplateXyz()[0], Is.EqualTo(-10).Within(1e-6));
                    int count = plan.PointCount;
                    double[] xyz = new double[3 * count], error = new double[count],
                             covariance = new double[6 * count];
                    double[] alone = new double[3 * count], errorAlone = new double[count];
                    PointStatus[] status = new PointStatus[count], same = new PointStatus[count];
                    job.MovePlan(plan, xyz, status, error, covariance);
                    job.MoveTargets(targets, alone, same, errorAlone);
                    Assert.That(xyz, Is.EqualTo(alone));
                    Assert.That(status, Is.EqualTo(same));
                    double[] registration = plan.GetRegistrationErrorMm();
                    for (int i = 0; i < count; ++i)
                    {
                        double sum =
                            errorAlone[i] * errorAlone[i] + registration[i] * registration[i];
                        Assert.That(error[i] * error[i], Is.EqualTo(sum).Within(1e-6 * sum));
                        Assert.That(
                            covariance[6 * i] + covariance[6 * i + 3] + covariance[6 * i + 5],
                            Is.EqualTo(sum).Within(1e-3 * sum));
                    }
                    Assert.Throws<ArgumentException>(() => job.MovePlan(plan, new double[3]));
                    Assert.Throws<ArgumentException>(
                        () => Plan.Create(
                            template, found, model, null, shifted, targetNames: new[] { "one" }));
                    Assert.That(
                        Assert
                            .Throws<DefrecException>(
                                () => Plan.Create(
                                    template, found, model, null, shifted,
                                    targetNames: new[] { "a", "b", "a", "c" }))
                            .Status,
                        Is.EqualTo(Status.ErrorArgument));
                    Assert.Throws<ArgumentNullException>(() => job.MovePlan(null, xyz));
                }
                File.WriteAllText(file, "no plan");
                Assert.That(
                    Assert.Throws<DefrecException>(() => Plan.Load(template, file)).Status,
                    Is.EqualTo(Status.ErrorIo));
                File.Delete(file);
                template.Dispose();
            }
        }

        [Test]
        public void AResultIsWhole()
        {
            using (var session = new TrackingSession(new TrackerOptions { KeepDisparity = true }))
            using (Job first = session.Track(0))
            using (Job job = session.Track(1))
            using (Template template = session.Tracker.GetTemplate())
            {
                FrameResult result = job.GetResult();
                FrameSummary summary = result.Summary;
                Assert.That(summary.State, Is.EqualTo(FrameState.Tracking));
                Assert.That(summary.Frame, Is.EqualTo(1));
                Assert.That(summary.TimestampNs, Is.EqualTo(StereoSequence.TimestampOf(1)));
                Assert.That(summary.ObservedShare, Is.InRange(0.5, 1));
                Assert.That(result.Motions.Length, Is.EqualTo(template.NodeCount));
                Assert.That(result.NodePositions.Length, Is.EqualTo(3 * template.NodeCount));
                Assert.That(result.Vertices.Length, Is.EqualTo(3 * template.VertexCount));
                Assert.That(result.LandmarkMatches.Length, Is.EqualTo(template.LandmarkCount));
                Assert.That(result.PatchObservations.Length, Is.EqualTo(template.PatchCount));
                Assert.That(
                    result.Disparity.Length, Is.EqualTo(session.Rig.Width * session.Rig.Height));
                Assert.That(
                    result.Disparity.Count(d => d != Constants.DisparityNone),
                    Is.GreaterThan(result.Disparity.Length / 2));
                Assert.That(
                    result.Times.Select(time => time.Name).ToList(),
                    Contains.Item("stereo").And.Contains("lm coarse"));
                Assert.That(
                    result.LandmarkMatches.Count(match => match.Weight > 0), Is.GreaterThan(10));
                foreach (Motion motion in result.Motions)
                    Assert.That(
                        Enumerable.Range(0, 4).Sum(i => motion.Real[i] * motion.Real[i]),
                        Is.EqualTo(1).Within(1e-4), "a unit quaternion");
                for (int i = 0; i < result.Normals.Length; i += 3)
                    Assert.That(
                        Math.Sqrt(result.Normals.Skip(i).Take(3).Sum(n => n * n)),
                        Is.EqualTo(1).Within(1e-4), "a unit normal");

                // The same through the caller's arrays.
                var vertices = new float[result.Vertices.Length + 1];
                Assert.That(job.CopyVertices(vertices), Is.EqualTo(result.Vertices.Length));
                Assert.That(vertices.Take(result.Vertices.Length), Is.EqualTo(result.Vertices));
                var status = new PointStatus[template.VertexCount];
                Assert.That(job.CopyVertexStatus(status), Is.EqualTo(status.Length));
                Assert.That(status, Is.EqualTo(result.VertexStatus));
                var errors = new float[template.VertexCount];
                Assert.That(job.CopyExpectedErrorMm(errors), Is.EqualTo(errors.Length));
                Assert.That(errors, Is.EqualTo(result.ExpectedErrorMm));
                var covariance = new float[6 * template.VertexCount];
                Assert.That(job.CopyVertexCovariance(covariance), Is.EqualTo(covariance.Length));
                Assert.That(covariance, Is.EqualTo(result.VertexCovariance));
                for (int i = 0; i < errors.Length; ++i)
                    Assert.That(
                        Math.Sqrt(
                            covariance[6 * i] + covariance[6 * i + 3] + covariance[6 * i + 5]),
                        Is.EqualTo(errors[i]).Within(1e-4));
                var evidence = new Evidence[template.VertexCount];
                Assert.That(job.CopyVertexEvidence(evidence), Is.EqualTo(evidence.Length));
                Assert.That(evidence, Is.EqualTo(result.VertexEvidence));
                Assert.That(evidence.Any(seen => (seen & Evidence.Depth) != 0));
                var pieces = new Piece[template.PieceCount + 1];
                Assert.That(job.CopyPieces(pieces), Is.EqualTo(1));
                Assert.That(pieces[0], Is.EqualTo(result.Pieces[0]));
                Assert.That(pieces[0].State, Is.EqualTo(result.Summary.State));
                Assert.That(
                    pieces[0].VerticesInside, Is.GreaterThan(template.VertexCount / 2)
                                                  .And.LessThanOrEqualTo(template.VertexCount));
                Assert.That(
                    pieces[0].ObservedShare, Is.EqualTo(result.Summary.ObservedShare).Within(1e-6));
                Assert.That(
                    template.GetVertexPieces(),
                    Has.Length.EqualTo(template.VertexCount).And.All.EqualTo(0));
                var disparity = new short[result.Disparity.Length];
                Assert.That(job.CopyDisparity(disparity), Is.EqualTo(disparity.Length));
                Assert.That(disparity, Is.EqualTo(result.Disparity));
                var tooShort = new float[result.Vertices.Length - 1];
                var refusal = Assert.Throws<ArgumentException>(() => job.CopyNormals(tooShort));
                Assert.That(
                    refusal.Message, Is.StringContaining(result.Vertices.Length.ToString()));
                Assert.That(tooShort, Has.All.EqualTo(0));

                // Vertices warp to where the result has them.
                template.WaitForBody();
                double[] atRest =
                    template.GetVertices()
                        .SelectMany(v => new double[] { v.Position.X, v.Position.Y, v.Position.Z })
                        .ToArray(),
                         now = new double[atRest.Length];
                job.WarpPoints(atRest, now);
                var pointCovariances = new double[2 * atRest.Length];
                job.GetPointCovariances(atRest, pointCovariances, evidence);
                Assert.That(
                    evidence.Zip(result.VertexEvidence, (a, b) => a == b).Count(same => same),
                    Is.GreaterThan(evidence.Length / 2));
                Assert.That(
                    pointCovariances.Zip(result.VertexCovariance, (a, b) => Math.Abs(a - b)).Max(),
                    Is.LessThan(1e-4));
                Assert.That(
                    now.Zip(result.Vertices, (a, b) => Math.Abs(a - b)).Max(), Is.LessThan(0.5));

                // A result outlives its job.
                float x = result.Vertices[0];
                job.Dispose();
                Assert.That(result.Vertices[0], Is.EqualTo(x));
            }
        }

        [Test]
        public void ResultsAreCopiedWithoutAllocation()
        {
            using (var session = new TrackingSession(null))
            {
                session.Track(0).Dispose();
                using (Job job = session.Track(1))
                {
                    var result = new FrameResult();
                    job.GetResult(result);
                    float[] vertices = result.Vertices, copy = new float[vertices.Length];
                    double[] xyz = new double[30], moved = new double[30];
                    Action frame = () =>
                    {
                        job.Wait();
                        job.GetSummary();
                        job.GetResult(result);
                        job.CopyVertices(copy);
                        job.WarpPoints(xyz, moved);
                    };
                    frame();
                    int collections = GC.CollectionCount(0);
                    long before = GC.GetTotalMemory(false);
                    for (int i = 0; i < 200; ++i) frame();
                    Assert.That(
                        GC.GetTotalMemory(false) - before, Is.LessThan(200 * 24),
                        "not even one object a round");
                    Assert.That(GC.CollectionCount(0), Is.EqualTo(collections));
                    Assert.That(result.Vertices, Is.SameAs(vertices));
                }
            }
        }

        [Test]
        public void TemplatesAreSavedLoadedAndSet()
        {
            string file = Path.Combine(TestPaths.Scratch, "surface \u00e4\u20ac");
            using (var session = new TrackingSession(null))
            {
                var refusal = Assert.Throws<DefrecException>(() => session.Tracker.GetTemplate());
                Assert.That(refusal.Status, Is.EqualTo(Status.ErrorState));
                session.SaveTemplate(file);
                using (Template saved = session.Tracker.GetTemplate())
                using (Template loaded = Template.Load(session.Context, file))
                {
                    Assert.That(loaded.GetVertices(), Is.EqualTo(saved.GetVertices()));
                    Assert.That(loaded.GetTriangles(), Is.EqualTo(saved.GetTriangles()));
                    Assert.That(loaded.GetTriangles().Max(), Is.LessThan((uint)loaded.VertexCount));
                    Assert.That(loaded.GetNodes(), Is.EqualTo(saved.GetNodes()));
                    Assert.That(loaded.GetEdges(), Is.EqualTo(saved.GetEdges()));
                    Assert.That(loaded.GetLandmarks(), Is.EqualTo(saved.GetLandmarks()));
                    Assert.That(loaded.GetPatches(), Is.EqualTo(saved.GetPatches()));
                    Assert.That(
                        loaded.GetCutPoints(),
                        Is.EqualTo(saved.GetCutPoints()).And.Length.EqualTo(loaded.CutPointCount));
                    Assert.That(loaded.GetImage(), Is.EqualTo(saved.GetImage()));
                    Assert.That(loaded.Camera, Is.EqualTo(session.Rig.Camera));
                    session.Tracker.SetTemplate(loaded);
                    using (Job job = session.Track(1))
                        Assert.That(job.GetSummary().VertexCount, Is.EqualTo(loaded.VertexCount));
                }
                var missing = Assert.Throws<DefrecException>(
                    () => Template.Load(session.Context, file + " that is not there"));
                Assert.That(missing.Status, Is.EqualTo(Status.ErrorIo));
                Assert.That(missing.Message, Is.StringContaining("that is not there"));
            }
        }

        [Test]
        public void TheViewThatIsBlackIsNamed()
        {
            using (var session = new TrackingSession(null))
            {
                using (Job job = session.Track(0))
                    Assert.That(job.GetSummary().FaultyViews, Is.EqualTo(Views.None));
                PngImage left = session.Frames.Left;
                var black = new Image(
                    new byte[left.Pixels.Length], left.Width, left.Height, PixelFormat.Bgr8);
                using (Job job = session.Tracker.Submit(
                           left.View(), black, StereoSequence.TimestampOf(1)))
                {
                    job.Wait();
                    Assert.That(job.GetSummary().FaultyViews, Is.EqualTo(Views.Right));
                }
            }
        }

        [Test]
        public void AFrameInImportedMemory()
        {
            using (var session = new TrackingSession(null))
            {
                session.Track(0).Dispose();
                PngImage left = session.Frames.Left, right = session.Frames.Right;
                session.Frames.Read(1);
                int size = left.Pixels.Length, sampleBytes;
                using (Template template = session.Tracker.GetTemplate())
                    sampleBytes = 32 * template.VertexCount;
                IntPtr block = Marshal.AllocHGlobal(2 * size + sampleBytes + 64),
                       leftAt = Align(block), rightAt = Align(leftAt + size),
                       samplesAt = Align(rightAt + size);
                Marshal.Copy(left.Pixels, 0, leftAt, size);
                Marshal.Copy(right.Pixels, 0, rightAt, size);
                using (
                    var leftMemory =
                        new DeviceMemory(session.Tracker, MemoryKind.Host, leftAt, size))
                using (
                    var rightMemory =
                        new DeviceMemory(session.Tracker, MemoryKind.Host, rightAt, size))
                using (
                    var samples =
                        new DeviceMemory(session.Tracker, MemoryKind.Host, samplesAt, sampleBytes))
                using (Job job = session.Tracker.Submit(new Frame(
                           new Image(leftMemory, left.Width, left.Height, PixelFormat.Bgr8),
                           new Image(rightMemory, left.Width, left.Height, PixelFormat.Bgr8),
                           StereoSequence.TimestampOf(1)) { Samples = samples }))
                {
                    job.Wait();
                    var positions = new float[3];
                    Marshal.Copy(samplesAt, positions, 0, 3);
                    Assert.That(job.GetResult().Vertices.Take(3), Is.EqualTo(positions));
                }
                Marshal.FreeHGlobal(block);
                var refusal = Assert.Throws<DefrecException>(
                    () => new DeviceMemory(session.Tracker, MemoryKind.Cuda, (IntPtr)4096, 4096));
                Assert.That(refusal.Status, Is.EqualTo(Status.ErrorUnsupported));
            }
        }

        private static IntPtr Align(IntPtr address)
        {
            return (IntPtr)((address.ToInt64() + 15) / 16 * 16);
        }

        [Test]
        public void AQueueIsFullUntilAJobIsDisposed()
        {
            using (var session = new TrackingSession(new TrackerOptions { FramesInFlight = 1 }))
            {
                Job job = session.Track(0), second;
                var frame = new Frame(
                    session.Frames.Left.View(), session.Frames.Right.View(),
                    StereoSequence.TimestampOf(1));
                Assert.That(session.Tracker.TrySubmit(frame, out second), Is.False);
                var busy = Assert.Throws<DefrecException>(() => session.Tracker.Submit(frame));
                Assert.That(busy.Status, Is.EqualTo(Status.ErrorBusy));
                job.Dispose();
                Assert.That(session.Tracker.TrySubmit(frame, out second), Is.True);
                session.Tracker.Dispose(); // a job outlives its tracker
                try
                {
                    second.Wait();
                    Assert.That(second.GetSummary().Frame, Is.EqualTo(1), "it was being computed");
                }
                catch (DefrecException e)
                {
                    Assert.That(e.Status, Is.EqualTo(Status.ErrorState), "it was still queued");
                }
                second.Dispose();
            }
        }

        [Test]
        public void ErrorsComeWithTheLibrarysSentence()
        {
            using (var context = new Context())
            {
                var description =
                    RigDescription.Rectified(320, 240, new Camera(-1, 300, 160, 120, 4));
                var refusal = Assert.Throws<DefrecException>(() => new Rig(context, description));
                Assert.That(refusal.Status, Is.EqualTo(Status.ErrorArgument));
                Assert.That(refusal.Message, Is.StringContaining("-1"));
                Assert.That(
                    DefrecLibrary.NameOf(refusal.Status), Is.EqualTo("DEFREC_ERROR_ARGUMENT"));
                Assert.That(
                    DefrecLibrary.NameOf(Status.ErrorBusy), Is.EqualTo("DEFREC_ERROR_BUSY"));
                Assert.That(
                    Regex.IsMatch(DefrecLibrary.Release, @"^\d+\.\d+\.\d+$"),
                    DefrecLibrary.Release);
                var noDevice = Assert.Throws<DefrecException>(
                    () => new Stage(
                        context, new StereoParameters { Width = 64, Height = 48 }, "\u00fcber"));
                Assert.That(noDevice.Message, Is.StringContaining("\u00fcber"));
            }
        }

        [Test]
        public void DisposedDuringAWait()
        {
            using (var session = new TrackingSession(new TrackerOptions { FramesInFlight = 4 }))
            {
                session.Frames.Read(0);
                for (int i = 0; i < 12; ++i)
                {
                    Job job = session.Tracker.Submit(
                        session.Frames.Left.View(), session.Frames.Right.View(), 1000 + i);
                    Exception seen = null;
                    var waiter = new Thread(() =>
                    {
                        try
                        {
                            job.Wait();
                }
                catch (Exception e) { seen = e; }
            });
            waiter.Start();
            if (i % 2 == 0) Thread.Yield();
            job.Dispose();
            waiter.Join();
            Assert.That(
                seen == null || seen is ObjectDisposedException,
                seen == null ? "" : seen.ToString());
        }
    }
}
}
}

using System;
using System.Linq;
using NUnit.Framework;

namespace Defrec.Tests
{
    /// <summary>
    /// Registration and hand-eye calibration with the real library: what comes out, what is
    /// refused.
    /// </summary>
    [TestFixture]
    public class RegistrationTest
    {
        private static readonly double[] Places = { 0,   0,  -50, 60,  10,  -30, -40, 30,
                                                    -35, 10, -45, -20, -70, -10, -20 };
        private static readonly double[] Shift = { 5, -3, 150 };

        private static double[] Shifted(double[] places)
        {
            return places.Select((value, i) => value + Shift[i % 3]).ToArray();
        }

        private static PointPairs Pairs()
        {
            return new PointPairs {
                ModelXyz = Places, SeenXyz = Shifted(Places),
                SeenCovariance = Enumerable.Range(0, 30)
                                     .Select(i => 0.25 * (i % 6 % 5 % 3 == 0 ? 1 : 0))
                                     .ToArray()
            };
        }

        // A closed surface without symmetry.
        private static TriangleMesh Organ()
        {
            const int columns = 36, lines = 18;
            var vertices = new float[3 * columns * (lines + 1)];
            for (int i = 0; i <= lines; ++i)
                for (int j = 0; j < columns; ++j)
                {
                    double t = Math.PI * i / lines, f = 2 * Math.PI * j / columns;
                    double x = Math.Sin(t) * Math.Cos(f), y = Math.Sin(t) * Math.Sin(f),
                           z = Math.Cos(t);
                    double r =
                        50 * (1 + 0.25 * Math.Sin(2 * x + 1) + 0.2 * Math.Cos(3 * y * x + 0.5) +
                              0.15 * Math.Sin(2.5 * z + y));
                    int at = 3 * (i * columns + j);
                    double[] place = { 1.4 * r * x, r * y, 0.8 * r * z };
                    for (int axis = 0; axis < 3; ++axis) // no -0 at the poles
                        vertices[at + axis] = (float)(Math.Round(place[axis], 6) + 0.0);
                }
            var triangles = new uint[6 * columns * lines];
            int corner = 0;
            for (int i = 0; i < lines; ++i)
                for (int j = 0; j < columns; ++j)
                {
                    uint a = (uint)(i * columns + j), b = (uint)(i * columns + (j + 1) % columns);
                    foreach (uint vertex in new[] {
                                 a, a + columns, b, b, a + columns, b + columns
                             })
                        triangles[corner++] = vertex;
                }
            return new TriangleMesh(vertices, triangles);
        }

        // The part that a camera in the origin of the seen frame sees.
        private static float[] Front(TriangleMesh organ)
        {
            return Enumerable.Range(0, organ.Vertices.Length / 3)
                .Where(i => organ.Vertices[3 * i + 2] < -8)
                .SelectMany(
                    i => Enumerable.Range(0, 3).Select(
                        axis => organ.Vertices[3 * i + axis] + (float)Shift[axis]))
                .ToArray();
        }

        private static Context NoPlugins()
        {
            return new Context(new ContextOptions { OnlyGivenPlugins = true, Threads = 1 });
        }

        [Test]
        public void PairsGiveTheTransformAndErrorsOfTargets()
        {
            using (Registration found = Registration.FromPairs(Pairs()))
            {
                Assert.That(found.Verdict, Is.EqualTo(Verdict.Accepted), found.Reason);
                Assert.That(found.Transform[2, 3], Is.EqualTo(150).Within(1e-6));
                Assert.That(found.Used, Is.EqualTo(5));
                Assert.That(found.GetInliers(), Is.EqualTo(Enumerable.Repeat(true, 5)));
                Assert.That(found.GetResiduals().Max(), Is.LessThan(1e-5f));
                Assert.That(found.GetTriangles(), Is.Empty);
                Assert.That(found.GetFreeMotions(), Is.Empty);
                Assert.That(found.GetAlternatives(), Is.Empty);
                double[] xyz = { 0, 0, -40, double.NaN, 0, 0, 300, 0, 0 };
                double[] covariance = new double[18], error = new double[3];
                found.MovePoints(xyz, xyz, covariance, error);
                Assert.That(xyz[2], Is.EqualTo(110).Within(1e-6));
                Assert.That(xyz[3], Is.NaN);
                Assert.That(error[1], Is.NaN);
                Assert.That(error[2], Is.GreaterThan(3 * error[0]));
                Assert.That(
                    error[2],
                    Is.EqualTo(Math.Sqrt(covariance[12] + covariance[15] + covariance[17]))
                        .Within(1e-9));
                double[] whole = found.GetCovariance();
                Assert.That(whole.Length, Is.EqualTo(36));
                Assert.That(whole[1], Is.EqualTo(whole[6]).Within(1e-12));
                found.MovePoints(new double[0], new double[0]);
            }
        }

        [Test]
        public void PairsInALineLeaveATurnOpen()
        {
            double[] line = { 0, 0, 0, 20, 0, 0, 40, 0, 0, 70, 0, 0 };
            using (Registration found = Registration.FromPairs(
                       new PointPairs { ModelXyz = line, SeenXyz = Shifted(line) }))
            {
                Assert.That(found.Verdict, Is.EqualTo(Verdict.Undetermined));
                FreeMotion motion = found.GetFreeMotions().Single();
                Assert.That(motion.Kind, Is.EqualTo(FreeMotionKind.Turn));
                Assert.That(Math.Abs(motion.Axis.X), Is.EqualTo(1).Within(1e-3));
                Assert.That(motion.Text, Is.StringContaining("turn about the axis"));
                Assert.That(motion.ExpectedRad, Is.EqualTo(0));
            }
        }

        [Test]
        public void AnElasticModelThatIsAsItWasIsNotDeformed()
        {
            TriangleMesh organ = Organ();
            using (Context context = NoPlugins())
            using (Registration found = Registration.FromSurface(
                       context, organ, new SeenSurface { Vertices = Front(organ) },
                       new RegistrationOptions {
                           Start = new RigidTransform(1, 0, 0, 9, 0, 1, 0, -7, 0, 0, 1, 156),
                           PointErrorMm = 0.2, Elastic = true, DeformationMm = 5
                       }))
            {
                Assert.That(
                    found.Deformation, Is.EqualTo(Deformation.Refused), found.DeformationText);
                Assert.That(found.DeformationText, Is.StringContaining("rigid motion"));
                Assert.That(found.DeformedRmsMm, Is.EqualTo(0));
                Assert.That(found.DeformedMaxMm, Is.EqualTo(0));
                Assert.That(found.LargestStrain, Is.EqualTo(0));
                Assert.That(found.RigidRmsMm, Is.EqualTo(found.RmsMm));
                Assert.That(found.RigidRobustMm, Is.EqualTo(found.RobustMm));
            }
        }

        [Test]
        public void ASurfaceIsRegistered()
        {
            TriangleMesh organ = Organ();
            float[] front = Front(organ);
            var status = new PointStatus[front.Length / 3];
            status[0] = PointStatus.Unknown;
            using (Context context = NoPlugins())
            using (Registration found = Registration.FromSurface(
                       context, organ, new SeenSurface { Vertices = front, Status = status },
                       new RegistrationOptions {
                           Start = new RigidTransform(1, 0, 0, 9, 0, 1, 0, -7, 0, 0, 1, 156),
                           PointErrorMm = 0.2
                       }))
            {
                Assert.That(found.Verdict, Is.EqualTo(Verdict.Accepted), found.Reason);
                for (int axis = 0; axis < 3; ++axis)
                    Assert.That(found.Transform[axis, 3], Is.EqualTo(Shift[axis]).Within(0.5));
                Assert.That(found.PointCount, Is.EqualTo(status.Length));
                Assert.That(found.GetResiduals()[0], Is.NaN);
                Assert.That(found.GetInliers()[0], Is.False);
                Assert.That(
                    found.TriangleCount + found.DroppedTriangles,
                    Is.EqualTo(organ.Triangles.Length / 3));
                Assert.That(found.GetTriangles().Length, Is.EqualTo(3 * found.TriangleCount));
                Assert.That(found.ModelHasOutside && !found.ModelTurned, Is.True);
                Assert.That(found.InlierShare, Is.GreaterThan(0.9));
            }
        }

        private static RigidTransform Times(RigidTransform a, RigidTransform b)
        {
            var made = new double[12];
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 4; ++j)
                {
                    made[4 * i + j] = j == 3 ? a[i, 3] : 0;
                    for (int k = 0; k < 3; ++k) made[4 * i + j] += a[i, k] * b[k, j];
                }
            return new RigidTransform(made);
        }

        private static RigidTransform Turn(int axis, double angle, double x, double y, double z)
        {
            double c = Math.Cos(angle), s = Math.Sin(angle);
            double[] place = { x, y, z }, made = new double[12];
            for (int i = 0; i < 3; ++i)
            {
                made[4 * i + i] = i == axis ? 1 : c;
                made[4 * i + 3] = place[i];
            }
            int first = (axis + 1) % 3, second = (axis + 2) % 3;
            made[4 * first + second] = -s;
            made[4 * second + first] = s;
            return new RigidTransform(made);
        }

        private static readonly RigidTransform MarkerFromCamera = Turn(1, 0.4, 40, -30, 250);
        private static readonly RigidTransform CameraFromMarker = Times(
            Turn(1, -0.4, 0, 0, 0), new RigidTransform(1, 0, 0, -40, 0, 1, 0, 30, 0, 0, 1, -250));
        private static readonly RigidTransform TrackerFromWorld = Turn(2, 1.1, 200, -100, 1500);

        private static RigidTransform CameraPose(int i)
        {
            return Turn(i % 3, 0.3 + 0.1 * i, 10 * i, 5 * (i % 4), -100 - 7 * (i % 3));
        }

        private static RigidTransform MarkerPose(RigidTransform camera)
        {
            return Times(Times(TrackerFromWorld, camera), CameraFromMarker);
        }

        private static HandEyeOptions Poses()
        {
            RigidTransform[] camera = Enumerable.Range(0, 8).Select(CameraPose).ToArray();
            return new HandEyeOptions {
                CameraPoses = camera, TrackerPoses = camera.Select(MarkerPose).ToArray()
            };
        }

        [Test]
        public void TheCameraIsFoundOnItsMarker()
        {
            using (var found = new HandEye(Poses()))
            {
                Assert.That(found.Verdict, Is.EqualTo(Verdict.Accepted), found.Reason);
                Assert.That(found.IsSolved && !found.OffsetEstimated, Is.True);
                for (int row = 0; row < 3; ++row)
                    for (int column = 0; column < 4; ++column)
                        Assert.That(
                            found.MarkerFromCamera[row, column],
                            Is.EqualTo(MarkerFromCamera[row, column]).Within(1e-5));
                Assert.That(found.Used, Is.EqualTo(8));
                Assert.That(found.InlierCount, Is.EqualTo(8));
                Assert.That(found.GetInliers(), Is.EqualTo(Enumerable.Repeat(true, 8)));
                Assert.That(found.GetResidualsMm().Max(), Is.LessThan(1e-4));
                Assert.That(found.GetResidualsRad().Length, Is.EqualTo(8));
                Assert.That(found.GetCovariance().Length, Is.EqualTo(36));
                Assert.That(found.Notes, Is.EqualTo(""));
                RigidTransform pose = found.GetCameraPose(MarkerPose(CameraPose(9)));
                double[] covariance = found.GetPoseCovariance(MarkerPose(CameraPose(9)));
                Assert.That(covariance.Length, Is.EqualTo(36));
                // The marker's own error is a part of it, here nearly all.
                for (int i = 0; i < 6; ++i)
                    Assert.That(
                        covariance[7 * i],
                        Is.GreaterThan(
                            0.999 *
                            Math.Pow(i < 3 ? found.TrackerErrorRad : found.TrackerErrorMm, 2)));
                RigidTransform expected = Times(TrackerFromWorld, CameraPose(9));
                for (int row = 0; row < 3; ++row)
                    Assert.That(pose[row, 3], Is.EqualTo(expected[row, 3]).Within(1e-4));
            }
        }

        [Test]
        public void ARefusedCalibrationGivesNoPose()
        {
            HandEyeOptions options = Poses();
            for (int i = 0; i < 8; ++i)
            {
                options.CameraPoses[i] = Turn(0, 0, i, i * i, 0);
                options.TrackerPoses[i] = MarkerPose(options.CameraPoses[i]);
            }
            using (var found = new HandEye(options))
            {
                Assert.That(found.Verdict, Is.EqualTo(Verdict.Undetermined));
                Assert.That(found.IsSolved, Is.False);
                Assert.That(found.GetResidualsMm(), Is.Empty);
                Assert.That(
                    found.GetFreeMotions().Select(motion => motion.Kind),
                    Is.EqualTo(Enumerable.Repeat(FreeMotionKind.Shift, 3)));
                var error = Assert.Throws<DefrecException>(
                    () => found.GetCameraPose(
                        new RigidTransform(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0)));
                Assert.That(error.Status, Is.EqualTo(Status.ErrorState));
                Assert.That(error.Message, Is.StringContaining(found.Reason));
                Assert.Throws<DefrecException>(
                    () => found.GetPoseCovariance(
                        new RigidTransform(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0)));
            }
        }

        [Test]
        public void WhatIsRefused()
        {
            TriangleMesh organ = Organ();
            var seen = new SeenSurface { Vertices = Front(organ) };
            PointPairs pairs = Pairs();
            pairs.SeenXyz = new double[12];
            Assert.Throws<ArgumentException>(() => Registration.FromPairs(pairs));
            Assert.Throws<ArgumentNullException>(() => Registration.FromPairs(null));
            pairs.ModelXyz = pairs.SeenXyz = new double[6];
            pairs.SeenCovariance = null;
            var error = Assert.Throws<DefrecException>(() => Registration.FromPairs(pairs));
            Assert.That(error.Message, Is.StringContaining("2 pairs were given"));
            using (Context context = NoPlugins())
            {
                Assert.Throws<ArgumentNullException>(
                    () => Registration.FromSurface(null, organ, seen));
                Assert.Throws<ArgumentNullException>(
                    () => Registration.FromSurface(context, null, seen));
                Assert.Throws<ArgumentNullException>(
                    () => Registration.FromSurface(context, organ, null));
                Assert.Throws<ArgumentNullException>(
                    () => Registration.FromTemplate(context, null, organ));
                var options = new RegistrationOptions { Starts = 10001 };
                error = Assert.Throws<DefrecException>(
                    () => Registration.FromSurface(context, organ, seen, options));
                Assert.That(error.Status, Is.EqualTo(Status.ErrorArgument));
                Assert.That(error.Message, Is.StringContaining("desc.starts is 10001"));
                options.Starts = -1;
                Assert.Throws<OverflowException>(
                    () => Registration.FromSurface(context, organ, seen, options));
                seen.Normals = new float[3];
                Assert.Throws<ArgumentException>(
                    () => Registration.FromSurface(context, organ, seen));
            }
            Assert.Throws<ArgumentNullException>(() => new HandEye(null));
            HandEyeOptions poses = Poses();
            poses.CameraTimes = new double[8];
            Assert.Throws<ArgumentNullException>(() => new HandEye(poses));
            poses.TrackerTimes = new double[7];
            Assert.Throws<ArgumentException>(() => new HandEye(poses));
            poses = Poses();
            poses.CameraErrorMm = 0.1;
            error = Assert.Throws<DefrecException>(() => new HandEye(poses));
            Assert.That(error.Message, Is.StringContaining("of the four errors"));
            Registration disposed = Registration.FromPairs(Pairs());
            disposed.Dispose();
            Assert.Throws<ObjectDisposedException>(() => disposed.GetResiduals());
            Assert.Throws<ObjectDisposedException>(
                () => disposed.MovePoints(new double[3], new double[3]));
        }
    }
}

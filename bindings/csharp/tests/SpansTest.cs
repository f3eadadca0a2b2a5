using System;
using NUnit.Framework;

namespace Defrec.Tests
{
    /// <summary>The overloads for spans do what those for arrays do, on parts of arrays.</summary>
    [TestFixture]
    public class SpansTest : StubTest
    {
        [Test]
        public void Pixels()
        {
            double[] uv = { 9, 1.5, 2.5, 9 }, mapped = new double[4];
            Rig.RectifyPixels(new ReadOnlySpan<double>(uv, 1, 2), new Span<double>(mapped, 2, 2));
            Assert.That(mapped, Is.EqualTo(new double[] { 0, 0, 1, 2 }));
            Rig.DistortPixels(new ReadOnlySpan<double>(uv, 2, 2), new Span<double>(mapped, 0, 2));
            Assert.That(mapped, Is.EqualTo(new double[] { 1, 2, 1, 2 }));
            string rig = Stub.Handle(Rig.Handle);
            Assert.That(
                Stub.Calls(), Is.EqualTo(new[] {
                    "defrec_rig_rectify_pixels(rig=" + rig +
                        ", raw_uv=[1.5, 2.5], count=1, rectified_uv=written)",
                    "defrec_rig_distort_pixels(rig=" + rig +
                        ", rectified_uv=[2.5, 9], count=1, raw_uv=written)",
                }));
            Assert.Throws<ArgumentException>(
                () => Rig.RectifyPixels(
                    new ReadOnlySpan<double>(uv, 0, 3), new Span<double>(mapped)));
            Assert.Throws<ArgumentException>(
                () => Rig.DistortPixels(
                    new ReadOnlySpan<double>(uv), new Span<double>(mapped, 0, 2)));
            Rig.RectifyPixels(ReadOnlySpan<double>.Empty, Span<double>.Empty);
            Assert.That(Stub.Calls(), Is.Empty);
        }

        [Test]
        public void Points()
        {
            double[] xyz = { 9, 1, 2, 3 }, moved = new double[4], error = new double[2],
                     covariance = new double[7];
            var status = new PointStatus[2];
            var evidence = new Evidence[2];
            using (Job job = Submit())
            {
                string handle = Stub.Handle(job.Handle);
                Stub.Calls();
                job.WarpPoints(
                    new ReadOnlySpan<double>(xyz, 1, 3), new Span<double>(moved, 1, 3),
                    new Span<PointStatus>(status, 1, 1), new Span<double>(error, 1, 1));
                job.WarpPoints(
                    new ReadOnlySpan<double>(xyz, 1, 3), new Span<double>(moved, 1, 3),
                    Span<PointStatus>.Empty, Span<double>.Empty);
                Assert.That(moved, Is.EqualTo(new double[] { 0, 1, 2, 3 }));
                Assert.That(
                    status, Is.EqualTo(new[] { PointStatus.Observed, PointStatus.Extrapolated }));
                Assert.That(error, Is.EqualTo(new double[] { 0, 1 }));
                Assert.That(
                    Stub.Calls(), Is.EqualTo(new[] {
                        "defrec_job_warp_points(job=" + handle +
                            ", template_xyz=[1, 2, 3], count=1, xyz=written, status=written, " +
                            "expected_error_mm=written)",
                        "defrec_job_warp_points(job=" + handle +
                            ", template_xyz=[1, 2, 3], count=1, xyz=written, status=NULL, " +
                            "expected_error_mm=NULL)",
                    }));
                Assert.Throws<ArgumentException>(
                    () => job.WarpPoints(
                        new ReadOnlySpan<double>(xyz), new Span<double>(moved),
                        Span<PointStatus>.Empty, Span<double>.Empty));
                Assert.Throws<ArgumentException>(
                    () => job.WarpPoints(
                        new ReadOnlySpan<double>(xyz, 0, 3), new Span<double>(moved, 0, 2),
                        Span<PointStatus>.Empty, Span<double>.Empty));

                job.GetPointCovariances(
                    new ReadOnlySpan<double>(xyz, 1, 3), new Span<double>(covariance, 1, 6),
                    new Span<Evidence>(evidence, 1, 1));
                job.GetPointCovariances(
                    new ReadOnlySpan<double>(xyz, 1, 3), new Span<double>(covariance, 1, 6),
                    Span<Evidence>.Empty);
                Assert.That(covariance, Is.EqualTo(new double[] { 0, 1, 2, 3, 4, 5, 6 }));
                Assert.That(evidence, Is.EqualTo(new[] { Evidence.None, Evidence.Depth }));
                Assert.That(
                    Stub.Calls(), Is.EqualTo(new[] {
                        "defrec_job_point_covariances(job=" + handle +
                            ", template_xyz=[1, 2, 3], count=1, covariance=written, " +
                            "evidence=written)",
                        "defrec_job_point_covariances(job=" + handle +
                            ", template_xyz=[1, 2, 3], count=1, covariance=written, evidence=NULL)",
                    }));
                Assert.Throws<ArgumentException>(
                    () => job.GetPointCovariances(
                        new ReadOnlySpan<double>(xyz, 0, 3), new Span<double>(covariance, 0, 5),
                        Span<Evidence>.Empty));

                Stub.Answer("defrec_targets_count", (Status)1, "");
                using (Template template = Tracker.GetTemplate())
                using (var targets = new Targets(template, new ReadOnlySpan<double>(xyz, 1, 3)))
                {
                    string made = Stub.Handle(targets.Handle);
                    Assert.That(
                        Stub.Call("defrec_targets_create"),
                        Is.StringContaining("template_xyz=[1, 2, 3], count=1"));
                    Assert.That(targets.Count, Is.EqualTo(1));
                    double[] now = new double[4], errors = new double[2],
                             covariances = new double[7];
                    var statuses = new PointStatus[2];
                    job.MoveTargets(
                        targets, new Span<double>(now, 1, 3), new Span<PointStatus>(statuses, 1, 1),
                        new Span<double>(errors, 1, 1), new Span<double>(covariances, 1, 6));
                    job.MoveTargets(
                        targets, new Span<double>(now, 1, 3), Span<PointStatus>.Empty,
                        Span<double>.Empty, Span<double>.Empty);
                    Assert.That(now, Is.EqualTo(new double[] { 0, 1, 2, 3 }));
                    Assert.That(
                        statuses,
                        Is.EqualTo(new[] { PointStatus.Observed, PointStatus.Extrapolated }));
                    Assert.That(errors, Is.EqualTo(new double[] { 0, 1 }));
                    Assert.That(covariances, Is.EqualTo(new double[] { 0, 1, 2, 3, 4, 5, 6 }));
                    string call = "defrec_job_move_targets(job=" + handle + ", targets=" + made +
                                  ", count=1, xyz=written, ";
                    Assert.That(
                        Stub.Calls(), Is.EqualTo(new[] {
                            call + "covariance=written, status=written, expected_error_mm=written)",
                            call + "covariance=NULL, status=NULL, expected_error_mm=NULL)",
                        }));
                    Assert.Throws<ArgumentException>(
                        () => job.MoveTargets(
                            targets, new Span<double>(now, 0, 2), Span<PointStatus>.Empty,
                            Span<double>.Empty, Span<double>.Empty));
                    Assert.Throws<ArgumentException>(
                        () => job.MoveTargets(
                            targets, new Span<double>(now), Span<PointStatus>.Empty,
                            Span<double>.Empty, new Span<double>(covariances, 0, 5)));
                    Assert.Throws<ArgumentException>(
                        () => new Targets(template, new ReadOnlySpan<double>(xyz)));
                }

                Assert.That(
                    job.CopyVertexCovariance(Span<float>.Empty) +
                        job.CopyVertexEvidence(Span<Evidence>.Empty),
                    Is.EqualTo(0));
                Assert.That(job.CopyPieces(Span<Piece>.Empty), Is.EqualTo(0));
                Assert.That(
                    job.CopyVertices(Span<float>.Empty) + job.CopyMotions(Span<Motion>.Empty) +
                        job.CopyVertexStatus(Span<PointStatus>.Empty),
                    Is.EqualTo(0));
            }
        }

        [Test]
        public void Lift()
        {
            double[] uv = { 9, 0.5, 1.5 }, xyz = new double[4];
            var found = new bool[2];
            using (Template template = Tracker.GetTemplate())
            {
                template.Lift(
                    new ReadOnlySpan<double>(uv, 1, 2), new Span<double>(xyz, 1, 3),
                    new Span<bool>(found, 1, 1));
                Assert.That(xyz, Is.EqualTo(new double[] { 0, 1, 2, 3 }));
                Assert.That(found, Is.EqualTo(new[] { false, true }));
                Assert.Throws<ArgumentException>(
                    () => template.Lift(
                        new ReadOnlySpan<double>(uv, 1, 2), new Span<double>(xyz),
                        Span<bool>.Empty));
            }
        }
    }
}

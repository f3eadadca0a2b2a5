using System;
using System.Linq;
using NUnit.Framework;

namespace Defrec.Tests
{
    /// <summary>Points at the time of display with the real library.</summary>
    [TestFixture]
    public class PredictorTest
    {
        private const long Frame = 33333333; // ns

        private static double Swing(long ns) { return 4 * Math.Sin(8e-9 * ns); }

        private static double[] Places(long ns)
        {
            return new[] { 0, Swing(ns), 80, 10, Swing(ns), 80 };
        }

        private static long Follow(Predictor predictor, int frames)
        {
            long now = 0;
            for (int i = 0; i < frames; ++i)
                predictor.AddFrame(
                    now += Frame, FrameState.Tracking, 1, Places(now), new PointStatus[2],
                    new[] { 0.1, 0.2 });
            return now;
        }

        [Test]
        public void PointsAreWhereTheyWillBe()
        {
            using (var predictor = new Predictor(2))
            {
                Assert.That(predictor.PointCount, Is.EqualTo(2));
                long now = Follow(predictor, 60), shown = now + 2 * Frame;
                double[] xyz = new double[6], errors = new double[2];
                var status = new[] { PointStatus.Unknown, PointStatus.Unknown };
                var basis = new PredictionBasis[2];
                predictor.Predict(shown, xyz, status, errors, basis);
                Assert.That(xyz[1], Is.EqualTo(Swing(shown)).Within(0.02));
                Assert.That(Math.Abs(Swing(now) - Swing(shown)), Is.GreaterThan(0.2));
                Assert.That(xyz[3], Is.EqualTo(10).Within(1e-6));
                Assert.That(status, Is.EqualTo(new PointStatus[2]));
                Assert.That(errors[1], Is.GreaterThanOrEqualTo(0.2));
                Assert.That(basis, Is.All.EqualTo(PredictionBasis.Learned));
                var alone = new double[6];
                predictor.Predict(shown, alone);
                Assert.That(alone, Is.EqualTo(xyz));
            }
        }

        [Test]
        public void AFrameThatIsLostMakesAllUnknown()
        {
            using (var predictor = new Predictor(2))
            {
                long now = Follow(predictor, 30) + Frame;
                predictor.AddFrame(now, FrameState.Lost, 1, null, null);
                var xyz = new double[6];
                var status = new PointStatus[2];
                predictor.Predict(now, xyz, status);
                Assert.That(status, Is.All.EqualTo(PointStatus.Unknown));
                Assert.That(xyz, Is.All.NaN);
                predictor.AddFrame(
                    now + Frame, FrameState.Relocalised, 2, Places(now + Frame),
                    new PointStatus[2]);
                predictor.Predict(now + Frame, xyz, status);
                Assert.That(xyz, Is.EqualTo(Places(now + Frame)));
            }
        }

        [Test]
        public void WhatCannotBeIsRefused()
        {
            Assert.That(
                Assert.Throws<DefrecException>(() => new Predictor(0)).Message,
                Is.StringContaining("point_count is 0"));
            Assert.Throws<DefrecException>(() => new Predictor(-1));
            var predictor = new Predictor(2);
            var xyz = new double[6];
            DefrecException error = Assert.Throws<DefrecException>(() => predictor.Predict(0, xyz));
            Assert.That(error.Status, Is.EqualTo(Status.ErrorState));
            long now = Follow(predictor, 3);
            Assert.Throws<ArgumentNullException>(() => predictor.Predict(now, null));
            Assert.Throws<ArgumentException>(() => predictor.Predict(now, new double[5]));
            Assert.Throws<ArgumentException>(
                () => predictor.Predict(now, xyz, null, null, new PredictionBasis[1]));
            error = Assert.Throws<DefrecException>(() => predictor.Predict(now + 4 * Frame, xyz));
            Assert.That(error.Status, Is.EqualTo(Status.ErrorArgument));
            Assert.That(error.Message, Is.StringContaining("expected at most 100 ms"));
            Assert.Throws<ArgumentException>(
                () => predictor.AddFrame(
                    now + 1, FrameState.Tracking, 1, new double[5], new PointStatus[2]));
            error = Assert.Throws<DefrecException>(
                () => predictor.AddFrame(now, FrameState.Tracking, 1, xyz, new PointStatus[2]));
            Assert.That(error.Message, Is.StringContaining("not after"));
            error = Assert.Throws<DefrecException>(
                () => predictor.AddFrame(now + 1, FrameState.Tracking, 1, xyz, null));
            Assert.That(error.Message, Is.StringContaining("frame.status is NULL"));
            double[] bad = Places(now);
            bad[4] = double.NaN;
            error = Assert.Throws<DefrecException>(
                () => predictor.AddFrame(now + 1, FrameState.Tracking, 1, bad, new PointStatus[2]));
            Assert.That(error.Message, Is.StringContaining("frame.xyz of point 1 has"));
            predictor.Dispose();
            Assert.Throws<ObjectDisposedException>(() => predictor.Predict(now, xyz));
        }
    }
}

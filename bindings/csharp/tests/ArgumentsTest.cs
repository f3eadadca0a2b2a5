using System;
using System.Collections.Generic;
using System.Linq;
using Defrec.Native;
using NUnit.Framework;

namespace Defrec.Tests
{
    /// <summary>
    /// What a hurried user gets wrong. Nothing that the library could not survive reaches it; the
    /// exception names the argument.
    /// </summary>
    [TestFixture]
    public class ArgumentsTest : StubTest
    {
        private Job job;
        private Template template;
        private Targets targets; // two
        private Stage stage;

        [SetUp]
        public void MakeMoreObjects()
        {
            job = Submit();
            template = Tracker.GetTemplate();
            Stub.Answer("defrec_targets_count", (Status)2, "");
            targets = new Targets(template, new double[6]);
            stage = new Stage(Context, new OrbParameters());
            Stub.Calls();
        }

        [TearDown]
        public void DisposeThem()
        {
            stage.Dispose();
            targets.Dispose();
            template.Dispose();
            job.Dispose();
        }

        private static void AllRefused<TException>(Dictionary<TestDelegate, string> calls)
            where TException : ArgumentException
        {
            int number = 0;
            foreach (KeyValuePair<TestDelegate, string> call in calls)
            {
                string which = call.Value + ", call " + number++;
                var refusal = Assert.Throws<TException>(call.Key, which);
                Assert.That(refusal.ParamName, Is.EqualTo(call.Value), which);
            }
            Assert.That(
                Stub.Calls().Where(call => call != "defrec_version()"), Is.Empty,
                "none of them reached the library");
        }

        [Test]
        public void PixelsOfEveryFormat()
        {
            foreach (PixelFormat format in Enum.GetValues(typeof(PixelFormat)))
                if (format != PixelFormat.Default)
                    Assert.DoesNotThrow(
                        () => new Image(new byte[64 * 48 * 4], 64, 48, format), format.ToString());
        }

        [Test]
        public void Null()
        {
            double[] two = new double[2], three = new double[3];
            var flags = new bool[1];
            RigDescription noLeft = RigDescription.Rectified(Width, Height, Camera),
                           noRotation = RigDescription.Rectified(Width, Height, Camera);
            RigDescription noDistortion = RigDescription.Rectified(Width, Height, Camera),
                           noTranslation = RigDescription.Rectified(Width, Height, Camera);
            noLeft.Left = null;
            noRotation.Rotation = null;
            noDistortion.Right.Distortion = null;
            noTranslation.Translation = null;
            var nullPath = new ContextOptions();
            nullPath.PluginPaths.Add(null);
            AllRefused<ArgumentNullException>(new Dictionary<TestDelegate, string> {
                { () => new Context(null), "options" },
                { () => new Context(nullPath), "PluginPaths" },
                { () => new Rig(null, noLeft), "context" },
                { () => new Rig(Context, null), "description" },
                { () => new Rig(Context, noLeft), "description.Left" },
                { () => new Rig(Context, noRotation), "description.Rotation" },
                { () => new Rig(Context, noTranslation), "description.Translation" },
                { () => new Rig(Context, noDistortion), "Distortion" },
                { () => Rig.RectifyPixels((double[])null, two), "rawUv" },
                { () => Rig.RectifyPixels(two, null), "rectifiedUv" },
                { () => Rig.DistortPixels((double[])null, two), "rectifiedUv" },
                { () => Rig.DistortPixels(two, null), "rawUv" },
                { () => new Tracker(null, Rig), "context" },
                { () => new Tracker(Context, null), "rig" },
                { () => new Tracker(Context, Rig, null), "options" },
                { () => Tracker.SetTemplate(null), "template" },
                { () => new Image((byte[])null, 64, 48, PixelFormat.Gray8), "pixels" },
                { () => new Image(IntPtr.Zero, 64, 48, PixelFormat.Gray8), "pixels" },
                { () => new Image((DeviceMemory)null, 64, 48, PixelFormat.Gray8), "memory" },
                { () => new DeviceMemory(null, MemoryKind.Host, (IntPtr)16, 16), "tracker" },
                { () => job.GetResult(null), "into" },
                { () => job.CopyVertices(null), "destination" },
                { () => job.CopyMotions(null), "destination" },
                { () => job.LiftPoints(null, three, new Found[1]), "uv" },
                { () => job.LiftPoints(two, null, new Found[1]), "xyz" },
                { () => job.LiftPoints(two, three, null), "found" },
                { () => job.WarpPoints(null, three), "templateXyz" },
                { () => job.WarpPoints(three, null), "xyz" },
                { () => job.GetPointCovariances(null, new double[6]), "templateXyz" },
                { () => job.GetPointCovariances(three, null), "covariance" },
                { () => template.Lift(null, three, flags), "uv" },
                { () => template.Lift(two, null, flags), "xyz" },
                { () => template.Lift(two, three, null), "found" },
                { () => template.SetBody(WithRegion(null)), "body.Regions[1]" },
                { () => template.SetBody(WithRegion(new BodyRegion { Mesh = null })),
                  "body.Regions[1].Mesh" },
                { () => template.SetBody(
                      WithRegion(new BodyRegion { Mesh = new TriangleMesh(null, new uint[3]) })),
                  "body.Regions[1].Mesh.Vertices" },
                { () => template.SetBody(
                      new BodyDescription { Mesh = new TriangleMesh(new float[3], null) }),
                  "body.Mesh.Triangles" },
                { () => new Targets(null, three), "template" },
                { () => new Targets(template, null), "templateXyz" },
                { () => job.MoveTargets(null, three), "targets" },
                { () => job.MoveTargets(targets, null), "xyz" },
                { () => new RigidTransform(null), "rows" },
                { () => template.Save(null), "path" },
                { () => Template.Load(null, "/a"), "context" },
                { () => Template.Load(Context, null), "path" },
                { () => new Stage(null, new OrbParameters()), "context" },
                { () => stage.Prepare(null), "inputs" },
                { () => stage.Run(null, new StageBuffer[0]), "inputs" },
                { () => stage.Run(new StageBuffer[0], null), "outputs" },
                { () => new StageBuffer(IntPtr.Zero, 1), "address" },
            });
        }

        [Test]
        public void ArraysOfTheWrongLength()
        {
            double[] three = new double[3], four = new double[4], six = new double[6];
            RigDescription rotation = RigDescription.Rectified(Width, Height, Camera),
                           translation = RigDescription.Rectified(Width, Height, Camera);
            RigDescription distortion = RigDescription.Rectified(Width, Height, Camera);
            rotation.Rotation = new double[8];
            translation.Translation = new double[4];
            distortion.Left.Distortion = new double[15];
            AllRefused<ArgumentException>(new Dictionary<TestDelegate, string> {
                { () => new Rig(Context, rotation), "description.Rotation" },
                { () => new Rig(Context, translation), "description.Translation" },
                { () => new Rig(Context, distortion), "Distortion" },
                { () => Rig.RectifyPixels(three, six), "rawUv" },
                { () => Rig.RectifyPixels(six, four), "rectifiedUv" },
                { () => Rig.DistortPixels(three, six), "rectifiedUv" },
                { () => Rig.DistortPixels(six, four), "rawUv" },
                { () => job.LiftPoints(three, six, new Found[2]), "uv" },
                { () => job.LiftPoints(four, four, new Found[2]), "xyz" },
                { () => job.LiftPoints(four, six, new Found[1]), "found" },
                { () => job.WarpPoints(four, six), "templateXyz" },
                { () => job.WarpPoints(six, four), "xyz" },
                { () => job.WarpPoints(six, six, new PointStatus[1]), "status" },
                { () => job.WarpPoints(six, six, null, new double[1]), "expectedErrorMm" },
                { () => job.GetPointCovariances(four, new double[12]), "templateXyz" },
                { () => job.GetPointCovariances(six, new double[11]), "covariance" },
                { () => job.GetPointCovariances(six, new double[12], new Evidence[1]), "evidence" },
                { () => template.Lift(three, six, new bool[2]), "uv" },
                { () => template.Lift(four, four, new bool[2]), "xyz" },
                { () => template.Lift(four, six, new bool[1]), "found" },
                { () => template.SetBody(
                      new BodyDescription { Mesh = new TriangleMesh(new float[4], new uint[3]) }),
                  "body.Mesh.Vertices" },
                { () => template.SetBody(
                      new BodyDescription { Mesh = new TriangleMesh(new float[3], new uint[4]) }),
                  "body.Mesh.Triangles" },
                { () => template.SetBody(WithRegion(
                      new BodyRegion { Mesh = new TriangleMesh(new float[3], new uint[2]) })),
                  "body.Regions[1].Mesh.Triangles" },
                { () => new Targets(template, four), "templateXyz" },
                { () => job.MoveTargets(targets, new double[5]), "xyz" },
                { () => job.MoveTargets(targets, six, new PointStatus[1]), "status" },
                { () => job.MoveTargets(targets, six, null, new double[1]), "expectedErrorMm" },
                { () => job.MoveTargets(targets, six, null, null, new double[11]), "covariance" },
                { () => new RigidTransform(new double[16]), "rows" },
                { () => stage.Prepare(new StageBuffer[65]), "inputs" },
                { () => stage.Run(new StageBuffer[33], new StageBuffer[32]), "inputs" },
                { () => template.Save("/a\0b"), "path" },
                { () => Template.Load(Context, "/\ud800"), "path" },
                { () => new Tracker(Context, Rig, new TrackerOptions { DeviceId = "cpu\0" }),
                  "options.DeviceId" },
                { () => new Stage(Context, new OrbParameters(), "\udc00"), "deviceId" },
            });
        }

        [Test]
        public void ImagesThatDoNotFitTheirPixels()
        {
            var pixels = new byte[64 * 48];
            AllRefused<ArgumentException>(new Dictionary<TestDelegate, string> {
                { () => new Image(new byte[0], 64, 48, PixelFormat.Gray8), "pixels" },
                { () => new Image(pixels, 64, 49, PixelFormat.Gray8), "pixels" },
                { () => new Image(pixels, 64, 48, PixelFormat.Bgr8), "pixels" },
                { () => new Image(pixels, 64, 48, PixelFormat.Gray8, 65), "pixels" },
                { () => new Image(pixels, 64, 48, PixelFormat.Gray8, 63), "stride" },
                { () => new Image(pixels, 64, 48, PixelFormat.Gray8, long.MaxValue), "pixels" },
                { () => Tracker.Submit(default(Image), GrayImage(), 2), "frame" },
                { () => Tracker.Submit(GrayImage(), default(Image), 2), "frame" },
                { () => Tracker.Submit(default(Frame)), "frame" },
            });
            AllRefused<ArgumentOutOfRangeException>(new Dictionary<TestDelegate, string> {
                { () => new Image(pixels, 0, 48, PixelFormat.Gray8), "width" },
                { () => new Image(pixels, -64, 48, PixelFormat.Gray8), "width" },
                { () => new Image(pixels, 64, -1, PixelFormat.Gray8), "height" },
                { () => new Image(pixels, int.MaxValue, int.MaxValue, PixelFormat.Bgra8), "width" },
                { () => new Image(pixels, 64, 48, PixelFormat.Default), "format" },
                { () => new Image(pixels, 64, 48, (PixelFormat)77), "format" },
                { () => new Image(pixels, 64, 48, PixelFormat.Gray8, -64), "stride" },
                { () => new Image((IntPtr)16, 64, 48, PixelFormat.Gray8, -64), "stride" },
            });
            // The last row needs no gap behind it.
            using (Tracker.Submit(
                new Image(new byte[100 * 47 + 64], 64, 48, PixelFormat.Gray8, 100), GrayImage(), 3))
            {
            }
        }

        [Test]
        public void NumbersThatCannotBe()
        {
            AllRefused<ArgumentOutOfRangeException>(new Dictionary<TestDelegate, string> {
                { () => new Context(new ContextOptions { Threads = -1 }), "options" },
                { () => new Context(new ContextOptions { PluginDeadlineMs = -1 }), "options" },
                { () => new Rig(Context, RigDescription.Rectified(-1, Height, Camera)),
                  "description.Width" },
                { () => new Rig(Context, RigDescription.Rectified(Width, int.MinValue, Camera)),
                  "description.Height" },
                { () => job.Wait(TimeSpan.FromSeconds(-5)), "timeout" },
                { () => job.Wait(TimeSpan.MinValue), "timeout" },
                { () => template.WaitForBody(TimeSpan.FromTicks(-2)), "timeout" },
                { () => new DeviceMemory(Tracker, MemoryKind.Host, (IntPtr)16, -1), "size" },
                { () => new StageBuffer((IntPtr)16, -1), "size" },
            });
        }

        [Test]
        public void NothingToDoIsNoError()
        {
            Rig.RectifyPixels(new double[0], new double[0]);
            job.WarpPoints(new double[0], new double[0], new PointStatus[0], new double[0]);
            job.GetPointCovariances(new double[0], new double[0], new Evidence[0]);
            template.Lift(new double[0], new double[0], new bool[0]);
            Assert.That(Stub.Calls(), Is.Empty);
            Stub.Answer("defrec_targets_count", 0, "");
            using (var none = new Targets(template, new double[0]))
                job.MoveTargets(none, new double[0]);
            Assert.That(
                Stub.Calls().Select(call => call.Split('(')[0]), Is.EqualTo(new[] {
                    "defrec_targets_create", "defrec_targets_count", "defrec_targets_destroy"
                }));
        }

        [Test]
        public void WhatIsNotFiniteIsTheLibrarys()
        {
            using (new Targets(template, new[] { double.NaN, double.PositiveInfinity, 1 }))
                Assert.That(
                    Stub.Call("defrec_targets_create"),
                    Is.StringMatching("template_xyz=\\[-?nan, inf, 1\\], count=1"));
            template.SetBody(new BodyDescription { PoissonRatio = float.NaN });
            Assert.That(
                Stub.Call("defrec_template_set_body"),
                Is.StringContaining("0000c0ff").Or.StringContaining("0000c07f"));
        }

        private static BodyDescription WithRegion(BodyRegion second)
        {
            return new BodyDescription { Regions = { new BodyRegion(), second } };
        }
    }
}

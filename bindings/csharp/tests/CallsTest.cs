using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Runtime.InteropServices;
using Defrec.Native;
using NUnit.Framework;

namespace Defrec.Tests
{
    /// <summary>
    /// Every function of the C API, called through the binding, arrives at the stub with what was
    /// given.
    /// </summary>
    [TestFixture]
    public unsafe class CallsTest : StubTest
    {
        /// <summary>What the stub writes down for a struct that it fills.</summary>
        private static string Written<T>() { return "{" + Marshal.SizeOf(typeof(T)) + "}"; }

        [Test]
        public void Library()
        {
            Stub.Answer("defrec_version_string", 0, "3.2.1 \u00e4\u20ac\ud83d\ude00");
            Assert.That(DefrecLibrary.Release, Is.EqualTo("3.2.1 \u00e4\u20ac\ud83d\ude00"));
            Assert.That(DefrecLibrary.NameOf(Status.ErrorBusy), Is.EqualTo("stub"));
            Assert.That(
                DefrecLibrary.ApiVersion,
                Is.EqualTo(Constants.ApiMajor * 1000 + Constants.ApiMinor));
            Assert.That(
                Stub.Calls(), Is.EqualTo(new[] {
                    "defrec_version()",
                    "defrec_version_string()",
                    "defrec_version()",
                    "defrec_status_name(status=-9)",
                    "defrec_version()",
                }));
        }

        [Test]
        public void ContextAndWhatItHas()
        {
            var options = new ContextOptions {
                OnlyGivenPlugins = true,
                UseEnvironment = true,
                LogLevel = LogLevel.Error,
                Threads = 7,
                Allocator =
                    new NativeAllocator {
                        Allocate = (IntPtr)0x11, Free = (IntPtr)0x22, User = (IntPtr)0x33
                    },
                ParallelFor =
                    new NativeParallelFor { Function = (IntPtr)0x44, User = (IntPtr)0x55 },
            };
            options.PluginPaths.Add("/a");
            options.PluginPaths.Add("/\u00fc");
            string call;
            using (var context = new Context(options)) call = Stub.Call("defrec_context_create");
            var expected = new defrec_context_desc {
                struct_size = 96,
                flags = (ContextFlags)3,
                plugin_path_count = (UIntPtr)2,
                log_level = 4,
                threads = 7,
                alloc = (IntPtr)0x11,
                free = (IntPtr)0x22,
                alloc_user = (IntPtr)0x33,
                parallel_for = (IntPtr)0x44,
                parallel_for_user = (IntPtr)0x55,
            };
            string hex = Stub.Hex(&expected, sizeof(defrec_context_desc));
            string given = call.Substring("defrec_context_create(desc=".Length, hex.Length);
            Assert.That(given.Substring(0, 16), Is.EqualTo(hex.Substring(0, 16)));
            Assert.That(
                given.Substring(16, 16), Is.Not.EqualTo(hex.Substring(16, 16)),
                "plugin_paths is an address");
            Assert.That(given.Substring(32), Is.EqualTo(hex.Substring(32)));

            Stub.Answer("defrec_plugin_count", (Status)2, "");
            Stub.Answer("defrec_device_count", (Status)1, "");
            Stub.Calls();
            PluginInfo[] plugins = Context.GetPlugins();
            DeviceInfo[] devices = Context.GetDevices();
            string handle = Stub.Handle(Context.Handle);
            Assert.That(
                Stub.Calls(), Is.EqualTo(new[] {
                    "defrec_plugin_count(context=" + handle + ")",
                    "defrec_plugin_get(context=" + handle +
                        ", index=0, out=" + Written<defrec_plugin_info>() + ")",
                    "defrec_plugin_get(context=" + handle +
                        ", index=1, out=" + Written<defrec_plugin_info>() + ")",
                    "defrec_device_count(context=" + handle + ")",
                    "defrec_device_get(context=" + handle +
                        ", index=0, out=" + Written<defrec_device_info>() + ")",
                }));
            Assert.That(
                plugins.Select(
                    p =>
                        p.Name + "," + p.Path + "," + p.Version + "," + p.Reason + "," + p.Verdict),
                Is.EqualTo(Enumerable.Repeat(
                    "plugin name,plugin path,plugin version,plugin reason,Ok", 2)));
            Assert.That(
                devices[0].Id + "," + devices[0].Name + "," + devices[0].Driver,
                Is.EqualTo("device id,device name,device driver"));
            Context.Dispose();
            Assert.That(
                Stub.Calls(),
                Is.EqualTo(new[] { "defrec_context_destroy(context=" + handle + ")" }));
        }

        [Test]
        public void ContextWithLog()
        {
            using (new Context(new ContextOptions {
                Log = (level, source, text) =>
                {}
            }))
            {
                string call = Stub.Call("defrec_context_create");
                string given = call.Substring(
                    "defrec_context_create(desc=".Length, 2 * sizeof(defrec_context_desc));
                IntPtr function = ContextLog.Function;
                Assert.That(
                    given.Substring(48, 16), Is.EqualTo(Stub.Hex(&function, sizeof(IntPtr))));
                Assert.That(
                    given.Substring(64, 16), Is.Not.EqualTo("0000000000000000"),
                    "log_user is the log's number");
            }
        }

        [Test]
        public void RigOfTwoRawCameras()
        {
            var description = new RigDescription {
                Width = 640,
                Height = 480,
                Left = new Intrinsics(1.5, 2.5, 3.5, 4.5, 0.1, 0.2, 0.3, 0.4, 0.5),
                Right = new Intrinsics(
                    5.5, 6.5, 7.5, 8.5, Enumerable.Range(1, 14).Select(k => k / 16.0).ToArray()),
                Rotation = Enumerable.Range(1, 9).Select(k => k + 0.25).ToArray(),
                Translation = new[] { -4.5, 0.5, 0.75 },
            };
            var expected = new defrec_rig_desc { struct_size = 416, width = 640, height = 480 };
            Fill(&expected.left, 1.5, 2.5, 3.5, 4.5, 5, k => (k + 1) * 0.1);
            expected.left.distortion[2] = 0.3;
            Fill(&expected.right, 5.5, 6.5, 7.5, 8.5, 14, k => (k + 1) / 16.0);
            for (int i = 0; i < 9; ++i) expected.rotation[i] = i + 1.25;
            expected.translation[0] = -4.5;
            expected.translation[1] = 0.5;
            expected.translation[2] = 0.75;
            using (var rig = new Rig(Context, description))
            {
                string handle = Stub.Handle(rig.Handle);
                Assert.That(
                    Stub.Calls(), Is.EqualTo(new[] {
                        "defrec_rig_create(context=" + Stub.Handle(Context.Handle) +
                            ", desc=" + Stub.Hex(&expected, 416) + ", out=" + handle + ")",
                        "defrec_rig_get(rig=" + handle + ", out=" + Written<defrec_rig_info>() +
                            ")",
                    }));
                var mapped = new double[6];
                rig.RectifyPixels(new[] { 1.5, 2.5, -3, 4 }, mapped);
                Assert.That(mapped, Is.EqualTo(new double[] { 1, 2, 3, 4, 0, 0 }));
                rig.DistortPixels(new[] { 0.5, 0.25 }, mapped);
                Assert.That(
                    Stub.Calls(), Is.EqualTo(new[] {
                        "defrec_rig_rectify_pixels(rig=" + handle +
                            ", raw_uv=[1.5, 2.5, -3, 4], count=2, rectified_uv=written)",
                        "defrec_rig_distort_pixels(rig=" + handle +
                            ", rectified_uv=[0.5, 0.25], count=1, raw_uv=written)",
                    }));
                rig.Dispose();
                Assert.That(
                    Stub.Calls(), Is.EqualTo(new[] { "defrec_rig_destroy(rig=" + handle + ")" }));
            }
        }

        private static void Fill(
            defrec_intrinsics* to, double fx, double fy, double cx, double cy, int count,
            Func<int, double> distortion)
        {
            to->fx = fx;
            to->fy = fy;
            to->cx = cx;
            to->cy = cy;
            for (int k = 0; k < count; ++k) to->distortion[k] = distortion(k);
            to->distortion_count = (uint)count;
        }

        [Test]
        public void RectifiedRig()
        {
            Stub.Calls();
            using (new Rig(Context, RigDescription.Rectified(320, 240, Camera)))
            {
                var expected = new defrec_rig_desc { struct_size = 416, width = 320, height = 240 };
                Fill(&expected.left, 100.5, 101.5, 40.25, 30.75, 0, null);
                Fill(&expected.right, 100.5, 101.5, 40.25, 30.75, 0, null);
                expected.rotation[0] = expected.rotation[4] = expected.rotation[8] = 1;
                expected.translation[0] = -4.5;
                Assert.That(
                    Stub.Call("defrec_rig_create"),
                    Is.StringContaining("desc=" + Stub.Hex(&expected, 416) + ", "));
            }
        }

        [Test]
        public void TrackerWithEveryOption()
        {
            int size = sizeof(defrec_tracker_desc);
            object options = new TrackerOptions { DeviceId = "" },
                   made = new defrec_tracker_desc { struct_size = (uint)size };
            int value = 2;
            foreach (PropertyInfo property in typeof(TrackerOptions)
                         .GetProperties()
                         .Where(
                             property =>
                                 property.Name != "DeviceId" && property.Name != "Fallback"))
            {
                FieldInfo field = typeof(defrec_tracker_desc)
                                      .GetField(
                                          LayoutTest.Snake(property.Name),
                                          BindingFlags.NonPublic | BindingFlags.Instance);
                Type type = property.PropertyType;
                object number = type == typeof(bool) ? true
                                : type.IsEnum        ? Enum.ToObject(type, ++value)
                                                     : Convert.ChangeType(++value, type);
                property.SetValue(options, number, null);
                field.SetValue(made, type == typeof(bool) ? 1u : number);
            }
            var expected = (defrec_tracker_desc)made;
            string hex = Stub.Hex(&expected, size), call;
            using (var tracker = new Tracker(Context, Rig, (TrackerOptions)options))
                call = Stub.Call("defrec_tracker_create");
            string head = "defrec_tracker_create(context=" + Stub.Handle(Context.Handle) +
                          ", rig=" + Stub.Handle(Rig.Handle) + ", desc=";
            Assert.That(call, Is.StringStarting(head));
            string given = call.Substring(head.Length, hex.Length);
            Assert.That(given.Substring(0, 16), Is.EqualTo(hex.Substring(0, 16)));
            Assert.That(
                given.Substring(16, 16), Is.Not.EqualTo(hex.Substring(16, 16)),
                "device_id is an address");
            Assert.That(given.Substring(32), Is.EqualTo(hex.Substring(32)));

            var defaults = new defrec_tracker_desc { struct_size = (uint)size };
            using (new Tracker(Context, Rig))
                Assert.That(
                    Stub.Call("defrec_tracker_create"),
                    Is.StringContaining("desc=" + Stub.Hex(&defaults, size) + ", "));

            var fallback = new defrec_tracker_desc { struct_size = (uint)size, flags = 1 };
            using (new Tracker(Context, Rig, new TrackerOptions { Fallback = true }))
                Assert.That(
                    Stub.Call("defrec_tracker_create"),
                    Is.StringContaining("desc=" + Stub.Hex(&fallback, size) + ", "));
        }

        [Test]
        public void FramesAndJobs()
        {
            string tracker = Stub.Handle(Tracker.Handle);
            var frame = new Frame(GrayImage(), GrayImage(), 0x1122334455667788) {
                CaptureTemplate = true, Ignore = GrayImage(), DeadlineNs = 0x0102030405060708,
                Field = FrameField.Bottom
            };
            using (Job job = Tracker.Submit(frame))
            {
                string handle = Stub.Handle(job.Handle), call = Stub.Call("defrec_tracker_submit");
                string head = "defrec_tracker_submit(tracker=" + tracker +
                              ", frame=08010000010000008877665544332211";
                Assert.That(call, Is.StringStarting(head));
                // left, right, ignore are given, and each lies elsewhere; samples is not.
                string[] addresses = {
                    call.Substring(head.Length, 16), call.Substring(head.Length + 16, 16),
                    call.Substring(head.Length + 32, 16)
                };
                Assert.That(addresses, Is.Unique);
                Assert.That(addresses, Has.None.EqualTo("0000000000000000"));
                Assert.That(
                    call,
                    Is.StringEnding(
                        "00000000000000000807060504030201" + new string('0', 2 * 24 * 8) +
                        "0200000000000000" + new string('0', 2 * 8) + ", out=" + handle + ")"));

                job.Wait();
                Assert.That(job.Wait(TimeSpan.FromTicks(25000)), Is.True);
                Assert.That(job.Wait(TimeSpan.Zero), Is.True);
                Assert.That(job.Wait(TimeSpan.MaxValue), Is.True);
                Assert.That(
                    Stub.Calls().Select(wait => wait.Replace("job=" + handle + ", ", "")),
                    Is.EqualTo(new[] {
                        "defrec_job_wait(timeout_ns=18446744073709551615)",
                        "defrec_job_wait(timeout_ns=2500000)", "defrec_job_wait(timeout_ns=0)",
                        "defrec_job_wait(timeout_ns=18446744073709551615)"
                    }));
                Stub.Answer("defrec_job_wait", Status.Timeout, "");
                Assert.That(job.Wait(TimeSpan.FromSeconds(1)), Is.False);
                Stub.Calls();

                Assert.That(job.GetSummary().VertexCount, Is.EqualTo(0));
                Assert.That(job.GetResult().Vertices, Is.Empty);
                Assert.That(job.CopyVertices(new float[0]), Is.EqualTo(0));
                Assert.That(
                    Stub.Calls(), Is.EqualTo(Enumerable.Repeat(
                                      "defrec_job_result(job=" + handle +
                                          ", out=" + Written<defrec_result>() + ")",
                                      3)));

                var xyz = new double[6];
                var status = new PointStatus[2];
                var error = new double[2];
                job.WarpPoints(new[] { 1.5, -2, 0.25, 4, 5, 6 }, xyz, status, error);
                job.WarpPoints(new double[] { 1, 2, 3 }, xyz);
                var covariance = new double[7];
                var evidence = new Evidence[2];
                job.GetPointCovariances(new double[] { 1, 2, 3 }, covariance);
                job.GetPointCovariances(new double[] { 1, 2, 3 }, covariance, evidence);
                var lifted = new double[3];
                job.LiftPoints(new[] { 0.5, 1.5 }, lifted, new Found[1]);
                Template surface = job.GetTemplate();
                string template = Stub.Handle(surface.Handle);
                surface.Dispose();
                Assert.That(lifted, Is.EqualTo(new double[] { 1, 2, 3 }));
                Assert.That(xyz, Is.EqualTo(new double[] { 1, 2, 3, 4, 5, 6 }));
                Assert.That(
                    status, Is.EqualTo(new[] { PointStatus.Extrapolated, PointStatus.Unknown }));
                Assert.That(error, Is.EqualTo(new double[] { 1, 2 }));
                Assert.That(covariance, Is.EqualTo(new double[] { 1, 2, 3, 4, 5, 6, 0 }));
                Assert.That(evidence, Is.EqualTo(new[] { Evidence.Depth, Evidence.None }));
                Assert.That(
                    Stub.Calls(), Is.EqualTo(new[] {
                        "defrec_job_warp_points(job=" + handle +
                            ", template_xyz=[1.5, -2, 0.25, 4, 5, 6], count=2, xyz=written, " +
                            "status=written, expected_error_mm=written)",
                        "defrec_job_warp_points(job=" + handle +
                            ", template_xyz=[1, 2, 3], count=1, xyz=written, status=NULL, " +
                            "expected_error_mm=NULL)",
                        "defrec_job_point_covariances(job=" + handle +
                            ", template_xyz=[1, 2, 3], count=1, covariance=written, evidence=NULL)",
                        "defrec_job_point_covariances(job=" + handle +
                            ", template_xyz=[1, 2, 3], count=1, covariance=written, " +
                            "evidence=written)",
                        "defrec_job_lift_points(job=" + handle +
                            ", uv=[0.5, 1.5], count=1, xyz=written, found=written)",
                        "defrec_job_get_template(job=" + handle + ", out=" + template + ")",
                        "defrec_template_get(surface=" + template +
                            ", out=" + Written<defrec_template_info>() + ")",
                        "defrec_template_release(surface=" + template + ")",
                    }));
                job.Dispose();
                Assert.That(
                    Stub.Calls(), Is.EqualTo(new[] { "defrec_job_release(job=" + handle + ")" }));
            }
            Tracker.Dispose();
            Assert.That(
                Stub.Calls(),
                Is.EqualTo(new[] { "defrec_tracker_destroy(tracker=" + tracker + ")" }));
        }

        [Test]
        public void FramesWithMotionsThatAreKnown()
        {
            var held = new RigidTransform(1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12);
            var pose = new RigidTransform(Enumerable.Range(1, 12).Select(k => k + 0.5).ToArray());
            Assert.That(held[1, 3], Is.EqualTo(8));
            Assert.That(pose[2, 0], Is.EqualTo(9.5));
            string none = new string('0', 2 * 12 * 8);
            foreach (bool isHeld in new[] { false, true })
            {
                foreach (bool isPosed in new[] { false, true })
                {
                    using (Tracker.Submit(
                        GrayImage(), GrayImage(), 1, isHeld ? held : (RigidTransform?)null,
                        isPosed ? pose : (RigidTransform?)null))
                    {
                        string call = Stub.Call("defrec_tracker_submit");
                        Assert.That(
                            call, Is.StringContaining(
                                      "frame=080100000" + ((isHeld ? 2 : 0) + (isPosed ? 4 : 0)) +
                                      "000000"));
                        Assert.That(
                            call, Is.StringContaining(
                                      (isHeld ? Stub.Hex(&held, 96) : none) +
                                      (isPosed ? Stub.Hex(&pose, 96) : none) +
                                      new string('0', 2 * 16) + ", out="));
                    }
                    Stub.Calls();
                }
            }
        }

        [Test]
        public void BodiesAndTargets()
        {
            Template template = Tracker.GetTemplate();
            string surface = Stub.Handle(template.Handle);
            Stub.Calls();
            template.SetBody(null);
            template.WaitForBody();
            Assert.That(template.WaitForBody(TimeSpan.FromTicks(25000)), Is.True);
            Stub.Answer("defrec_template_wait_body", Status.Timeout, "");
            Assert.That(template.WaitForBody(TimeSpan.Zero), Is.False);
            Assert.That(
                Stub.Calls(), Is.EqualTo(new[] {
                    "defrec_template_set_body(surface=" + surface + ", desc=NULL)",
                    "defrec_template_wait_body(surface=" + surface +
                        ", timeout_ns=18446744073709551615)",
                    "defrec_template_wait_body(surface=" + surface + ", timeout_ns=2500000)",
                    "defrec_template_wait_body(surface=" + surface + ", timeout_ns=0)",
                }));

            template.SetBody(new BodyDescription { PoissonRatio = 0.25f, CutDepthMm = 7.5f });
            var expected = new defrec_body_desc {
                struct_size = 64, poisson_ratio = 0.25f, cut_depth_mm = 7.5f
            };
            Assert.That(
                Stub.Calls(), Is.EqualTo(new[] {
                    "defrec_template_set_body(surface=" + surface +
                    ", desc=" + Stub.Hex(&expected, 64) + ")"
                }));

            Stub.Answer("defrec_targets_count", (Status)2, "");
            var targets = new Targets(template, new[] { 1.5, -2, 0.25, 4, 5, 6 });
            template.Dispose(); // targets do not need it
            Assert.That(targets.Count, Is.EqualTo(2));
            double[] xyz = new double[7], error = new double[2], covariance = new double[12];
            var status = new PointStatus[2];
            string made = Stub.Handle(targets.Handle);
            using (Job job = Submit())
            {
                string handle = Stub.Handle(job.Handle);
                job.MoveTargets(targets, xyz, status, error, covariance);
                job.MoveTargets(targets, xyz);
                Assert.That(xyz, Is.EqualTo(new double[] { 1, 2, 3, 4, 5, 6, 0 }));
                Assert.That(
                    status, Is.EqualTo(new[] { PointStatus.Extrapolated, PointStatus.Unknown }));
                Assert.That(error, Is.EqualTo(new double[] { 1, 2 }));
                Assert.That(covariance, Is.EqualTo(Enumerable.Range(1, 12)));
                targets.Dispose();
                string call = "defrec_job_move_targets(job=" + handle + ", targets=" + made +
                              ", count=2, xyz=written, ";
                Assert.That(
                    Stub.Calls().Where(line => !line.StartsWith("defrec_tracker_submit")),
                    Is.EqualTo(new[] {
                        "defrec_targets_create(surface=" + surface +
                            ", template_xyz=[1.5, -2, 0.25, 4, 5, 6], count=2, out=" + made + ")",
                        "defrec_targets_count(targets=" + made + ")",
                        "defrec_template_release(surface=" + surface + ")",
                        call + "covariance=written, status=written, expected_error_mm=written)",
                        call + "covariance=NULL, status=NULL, expected_error_mm=NULL)",
                        "defrec_targets_destroy(targets=" + made + ")"
                    }));
            }
        }

        [Test]
        public void PointsOfAFixedFrame()
        {
            double[] points = { 1.5, 2.5, 3.5, 4, 5, 6 },
                     errors = { 1, 0, 0, 2, 0, 3, 4, 0, 0, 5, 0, 6 };
            double[] pose = Enumerable.Range(0, 36).Select(i => i % 7 == 0 ? 1.0 : 0.0).ToArray();
            double[] xyz = new double[7], covariance = new double[12];
            using (Job job = Submit())
            {
                string call = "defrec_job_to_fixed_frame(job=" + Stub.Handle(job.Handle);
                Stub.Calls();
                job.ToFixedFrame(points, xyz, errors, covariance, pose);
                Assert.That(xyz, Is.EqualTo(new double[] { 1, 2, 3, 4, 5, 6, 0 }));
                Assert.That(covariance, Is.EqualTo(Enumerable.Range(1, 12)));
                job.ToFixedFrame(points, xyz);
                job.ToFixedFrame(new double[0], new double[0]);
                string given = "count=2, camera_xyz=[1.5, 2.5, 3.5, 4, 5, 6], camera_covariance=";
                Assert.That(
                    Stub.Calls().Take(2), Is.EqualTo(new[] {
                        call + ", pose_covariance=[" + string.Join(", ", pose) + "], " + given +
                            "[" + string.Join(", ", errors) + "], xyz=written, covariance=written)",
                        call + ", pose_covariance=NULL, " + given +
                            "NULL, xyz=written, covariance=NULL)"
                    }));
                Assert.Throws<ArgumentNullException>(() => job.ToFixedFrame(null, xyz));
                Assert.Throws<ArgumentNullException>(() => job.ToFixedFrame(points, null));
                Assert.Throws<ArgumentException>(() => job.ToFixedFrame(new double[4], xyz));
                Assert.Throws<ArgumentException>(() => job.ToFixedFrame(points, new double[5]));
                Assert.Throws<ArgumentException>(
                    () => job.ToFixedFrame(points, xyz, new double[11]));
                Assert.Throws<ArgumentException>(
                    () => job.ToFixedFrame(points, xyz, null, new double[11]));
                Assert.Throws<ArgumentException>(
                    () => job.ToFixedFrame(points, xyz, null, null, new double[35]));
            }
        }

        [Test]
        public void WhatABodyPointsToStaysInPlace()
        {
            var body = new BodyDescription {
                Mesh = new TriangleMesh(new float[] { 1, 2, 3, 4, 5, 6 }, new uint[] { 0, 1, 1 }),
                Regions =
                    { new BodyRegion {
                         Mesh = new TriangleMesh(new float[] { 7, 8, 9 }, new uint[0]),
                         Stiffness = 2.5f, IsHeld = true
                     },
                      new BodyRegion() },
                PoissonRatio = 0.3f,
                CutDepthMm = 4,
            };
            using (var pinned = new PinnedBody(body))
            {
                for (int i = 0; i < 3; ++i)
                {
                    var between = new byte[100000]; // room to move the arrays into
                    GC.Collect();
                    GC.KeepAlive(between);
                }
                defrec_body_desc* desc = pinned.Desc;
                Assert.That(
                    new object[] {
                        desc->struct_size, desc->flags, desc->poisson_ratio, desc->cut_depth_mm,
                        desc->region_count
                    },
                    Is.EqualTo(new object[] { 64u, 0u, 0.3f, 4f, 2ul }));
                fixed (float* vertices = body.Mesh.Vertices)
                    Assert.That(desc->mesh.vertices == vertices);
                fixed (uint* triangles = body.Mesh.Triangles)
                    Assert.That(desc->mesh.triangles == triangles);
                Assert.That(
                    new[] { desc->mesh.vertex_count, desc->mesh.triangle_count },
                    Is.EqualTo(new[] { 2ul, 1ul }));
                fixed (float* vertices = body.Regions[0].Mesh.Vertices)
                    Assert.That(desc->regions[0].mesh.vertices == vertices);
                Assert.That(desc->regions[0].mesh.triangles == null);
                Assert.That(desc->regions[0].stiffness, Is.EqualTo(2.5f));
                Assert.That(desc->regions[0].flags, Is.EqualTo(RegionFlags.Held));
                Assert.That(desc->regions[1].mesh.vertices == null);
                Assert.That(desc->regions[1].flags, Is.EqualTo(RegionFlags.None));
            }
        }

        [Test]
        public void MemoryOfTheDevice()
        {
            var expected = new defrec_memory_desc {
                struct_size = 24, kind = MemoryKind.Cuda, address = (void*)0x7f10,
                size = 0x123456789a
            };
            string tracker = Stub.Handle(Tracker.Handle), handle;
            using (var memory =
                       new DeviceMemory(Tracker, MemoryKind.Cuda, (IntPtr)0x7f10, 0x123456789a))
            {
                handle = Stub.Handle(memory.Handle);
                Assert.That(
                    Stub.Calls(), Is.EqualTo(new[] {
                        "defrec_memory_import(tracker=" + tracker +
                            ", desc=" + Stub.Hex(&expected, 24) + ", out=" + handle + ")",
                    }));
                var image = new Image(memory, Width, Height, PixelFormat.Bgr8);
                using (Tracker.Submit(new Frame(image, image, 1) { Samples = memory }))
                {
                    IntPtr native = memory.Handle.DangerousGetHandle();
                    Assert.That(
                        Stub.Call("defrec_tracker_submit"),
                        Is.StringContaining(
                            Stub.Hex(&native, 8) + new string('0', 2 * 27 * 8) + ", out="));
                }
                Stub.Calls();
            }
            Assert.That(
                Stub.Calls(), Is.EqualTo(new[] { "defrec_memory_release(memory=" + handle + ")" }));
        }

        [Test]
        public void ScanOfTwoImages()
        {
            Stub.Calls();
            Assert.That(Image.DetectScan(GrayImage(), GrayImage()), Is.EqualTo(Scan.Progressive));
            Assert.That(Stub.Call("defrec_detect_scan"), Is.StringEnding(", scan=written)"));
            Assert.Throws<ArgumentException>(() => Image.DetectScan(default(Image), GrayImage()));
            Assert.Throws<ArgumentException>(() => Image.DetectScan(GrayImage(), default(Image)));
        }

        [Test]
        public void Templates()
        {
            Template template = Tracker.GetTemplate();
            string handle = Stub.Handle(template.Handle), tracker = Stub.Handle(Tracker.Handle),
                   context = Stub.Handle(Context.Handle);
            var xyz = new double[6];
            var found = new bool[2];
            template.Lift(new[] { 0.5, 1.5, 2, 3 }, xyz, found);
            Assert.That(xyz, Is.EqualTo(new double[] { 1, 2, 3, 4, 5, 6 }));
            var pieces = new byte[2];
            template.GetPointPieces(new double[] { 1, 2, 3, 4, 5, 6 }, pieces);
            Assert.That(pieces, Is.EqualTo(new byte[] { 1, 2 }));
            template.Save("/tmp/\u00e9");
            Tracker.SetTemplate(template);
            template.Dispose();
            Template loaded = Template.Load(Context, "/b");
            string second = Stub.Handle(loaded.Handle);
            loaded.Dispose();
            Assert.That(
                Stub.Calls(), Is.EqualTo(new[] {
                    "defrec_tracker_get_template(tracker=" + tracker + ", out=" + handle + ")",
                    "defrec_template_get(surface=" + handle +
                        ", out=" + Written<defrec_template_info>() + ")",
                    "defrec_template_lift(surface=" + handle +
                        ", uv=[0.5, 1.5, 2, 3], count=2, xyz=written, found=written)",
                    "defrec_template_point_pieces(surface=" + handle +
                        ", template_xyz=[1, 2, 3, 4, 5, 6], count=2, pieces=written)",
                    "defrec_template_save(surface=" + handle + ", path=\"/tmp/\u00e9\")",
                    "defrec_tracker_set_template(tracker=" + tracker + ", surface=" + handle + ")",
                    "defrec_template_release(surface=" + handle + ")",
                    "defrec_template_load(context=" + context + ", path=\"/b\", out=" + second +
                        ")",
                    "defrec_template_get(surface=" + second +
                        ", out=" + Written<defrec_template_info>() + ")",
                    "defrec_template_release(surface=" + second + ")",
                }));
        }

        [Test]
        public void StageWithBuffers()
        {
            using (var stage = new Stage(
                       Context, new StereoParameters { Width = 64, Height = 48 }, "device \u00fc"))
            {
                string handle = Stub.Handle(stage.Handle);
                stage.Prepare(new byte[3], new Landmark[2], default(StageBuffer));
                fixed (byte* native = new byte[9])
                    stage.Run(
                        new StageBuffer[] { new byte[5], default(StageBuffer), new float[2] },
                        new StageBuffer[] {
                            new short[7], new StageBuffer((IntPtr)native, 9), new SurfaceSample[1]
                        });
                stage.Prepare();
                stage.Dispose();
                string[] calls = Stub.Calls();
                Assert.That(
                    calls[0], Is.StringMatching(
                                  "^defrec_stage_create\\(context=" + Stub.Handle(Context.Handle) +
                                  ", device_id=\"device \u00fc\", stage=1, " +
                                  "params=4c0000004000000030000000(00)+, out=" + handle + "\\)$"));
                Assert.That(
                    calls.Skip(1), Is.EqualTo(new[] {
                        "defrec_stage_prepare(stage=" + handle + ", in=[3, 96, NULL], in_count=3)",
                        "defrec_stage_run(stage=" + handle +
                            ", in=[5, NULL, 8], in_count=3, out=[14, 9, 32], out_count=3)",
                        "defrec_stage_prepare(stage=" + handle + ", in=[], in_count=0)",
                        "defrec_stage_destroy(stage=" + handle + ")",
                    }));
            }
        }

        [Test]
        public void EveryStageWithItsParameters()
        {
            foreach (StageKind kind in Enum.GetValues(typeof(StageKind)))
            {
                Type type = typeof(Stage).Assembly.GetType("Defrec." + kind + "Parameters", true);
                object parameters = Activator.CreateInstance(type);
                FieldInfo first = Array.Find(
                    type.GetFields(), field => (int)Marshal.OffsetOf(type, field.Name) == 4);
                first.SetValue(
                    parameters, first.FieldType.IsEnum ? Enum.ToObject(first.FieldType, 2u) : 2u);
                uint size = (uint)Marshal.SizeOf(type);
                string expected = "device_id=NULL, stage=" + (uint)kind +
                                  ", params=" + Stub.Hex(&size, 4) + "020000000";
                var make =
                    typeof(Stage).GetConstructor(new[] { typeof(Context), type, typeof(string) });
                using ((Stage)make.Invoke(new[] { Context, parameters, null }))
                    Assert.That(Stub.Call("defrec_stage_create"), Is.StringContaining(expected));
            }
        }
    }
}

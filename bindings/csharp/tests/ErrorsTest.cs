using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Reflection;
using Defrec.Native;
using NUnit.Framework;

namespace Defrec.Tests
{
    /// <summary>
    /// Whatever function fails, its status and its error message reach the caller, and no handle is
    /// lost.
    /// </summary>
    [TestFixture]
    public class ErrorsTest : StubTest
    {
        // A way to call functions that can fail.
        private Dictionary<string, TestDelegate> Callers(
            Job job, Template template, Targets targets, Stage stage)
        {
            var uv = new double[2];
            var xyz = new double[3];
            return new Dictionary<string, TestDelegate> {
                { "defrec_context_create", () => new Context(new ContextOptions {
                                               Log = (level, source, text) =>
                                               {}
                                           }) },
                { "defrec_plugin_get", () => Context.GetPlugins() },
                { "defrec_device_get", () => Context.GetDevices() },
                { "defrec_rig_create",
                  () => new Rig(Context, RigDescription.Rectified(Width, Height, Camera)) },
                { "defrec_rig_get",
                  () => new Rig(Context, RigDescription.Rectified(Width, Height, Camera)) },
                { "defrec_rig_rectify_pixels", () => Rig.RectifyPixels(uv, uv) },
                { "defrec_rig_distort_pixels", () => Rig.DistortPixels(uv, uv) },
                { "defrec_stage_create", () => new Stage(Context, new OrbParameters()) },
                { "defrec_stage_prepare", () => stage.Prepare(new byte[1]) },
                { "defrec_stage_run",
                  () => stage.Run(
                      new StageBuffer[] { new byte[1] }, new StageBuffer[] { new byte[1] }) },
                { "defrec_tracker_create", () => new Tracker(Context, Rig) },
                { "defrec_memory_import",
                  () => new DeviceMemory(Tracker, MemoryKind.Host, (IntPtr)16, 16) },
                { "defrec_tracker_submit", () => Submit() },
                { "defrec_job_wait", () => job.Wait() },
                { "defrec_job_result", () => job.GetResult() },
                { "defrec_job_get_template", () => job.GetTemplate() },
                { "defrec_job_lift_points", () => job.LiftPoints(uv, xyz, new Found[1]) },
                { "defrec_job_warp_points", () => job.WarpPoints(xyz, xyz) },
                { "defrec_job_point_covariances",
                  () => job.GetPointCovariances(xyz, new double[6]) },
                { "defrec_tracker_get_template", () => Tracker.GetTemplate() },
                { "defrec_tracker_set_template", () => Tracker.SetTemplate(template) },
                { "defrec_template_get", () => Tracker.GetTemplate() },
                { "defrec_template_lift", () => template.Lift(uv, xyz, new bool[1]) },
                { "defrec_detect_scan", () => Image.DetectScan(GrayImage(), GrayImage()) },
                { "defrec_template_point_pieces", () => template.GetPointPieces(xyz, new byte[1]) },
                { "defrec_template_set_body", () => template.SetBody(new BodyDescription()) },
                { "defrec_template_wait_body", () => template.WaitForBody() },
                { "defrec_targets_create", () => new Targets(template, xyz) },
                { "defrec_job_move_targets", () => job.MoveTargets(targets, xyz) },
                { "defrec_job_to_fixed_frame", () => job.ToFixedFrame(xyz, xyz) },
                { "defrec_template_save", () => template.Save("/a") },
                { "defrec_template_load", () => Template.Load(Context, "/a") },
            };
        }

        [Test]
        public void StatusAndSentenceReachTheCaller()
        {
            Job job = Submit();
            Template template = Tracker.GetTemplate();
            Stub.Answer("defrec_targets_count", (Status)1, "");
            var targets = new Targets(template, new double[3]);
            var stage = new Stage(Context, new OrbParameters());
            Dictionary<string, TestDelegate> callers = Callers(job, template, targets, stage);
            int logs = ContextLog.Count;
            foreach (string function in callers.Keys)
            {
                foreach (Status status in Enum.GetValues(typeof(Status))
                             .Cast<Status>()
                             .Where(status => status < 0))
                {
                    Stub.Reset();
                    Stub.Answer("defrec_plugin_count", (Status)1, "");
                    Stub.Answer("defrec_device_count", (Status)1, "");
                    string message =
                        function + " was given -1\u00a0\u20ac; 5 expected (" + status + ")";
                    Stub.Answer(function, status, message);
                    var failure = Assert.Throws<DefrecException>(callers[function], function);
                    Assert.That(failure.Status, Is.EqualTo(status), function);
                    Assert.That(failure.Message, Is.EqualTo(message), function);
                    string[] calls = Stub.Calls();
                    Assert.That(Stub.Unbalanced(calls), Is.Empty, function);
                    Assert.That(
                        calls.Count(call => call == "defrec_last_error()"), Is.EqualTo(1),
                        function);
                }
            }
            Assert.That(
                ContextLog.Count, Is.EqualTo(logs),
                "the log of a context that was not made is forgotten");
            Stub.Reset();
            stage.Dispose();
            targets.Dispose();
            template.Dispose();
            job.Dispose();
        }

        [Test]
        public void AFullQueueIsNoException()
        {
            Stub.Answer("defrec_tracker_submit", Status.ErrorBusy, "the queue is full");
            Job job;
            Assert.That(
                Tracker.TrySubmit(new Frame(GrayImage(), GrayImage(), 1), out job), Is.False);
            Assert.That(job, Is.Null);
            Stub.Answer(
                "defrec_tracker_submit", Status.ErrorArgument, "the timestamp does not grow");
            var failure = Assert.Throws<DefrecException>(
                () => Tracker.TrySubmit(new Frame(GrayImage(), GrayImage(), 1), out job));
            Assert.That(failure.Status, Is.EqualTo(Status.ErrorArgument));
            Stub.Reset();
            Assert.That(
                Tracker.TrySubmit(new Frame(GrayImage(), GrayImage(), 1), out job), Is.True);
            job.Dispose();
        }

        [Test]
        public void ALibraryOfAnotherVersionIsRefusedAtFirstUse()
        {
            int own = 1000 * Constants.ApiMajor + Constants.ApiMinor;
            foreach (int version in new[] {
                         0, own - 1, own + 1000, 999, 1000 * (Constants.ApiMajor + 1)
                     })
            {
                Stub.Answer("defrec_version", (Status)version, "");
                Stub.Calls();
                foreach (TestDelegate first in new TestDelegate[] {
                             () => new Context(), () => DefrecLibrary.NameOf(Status.Ok),
                             () =>
                             { string release = DefrecLibrary.Release; }
                         })
                {
                    var refusal = Assert.Throws<DefrecException>(first);
                    Assert.That(refusal.Status, Is.EqualTo(Status.ErrorVersion));
                    Assert.That(
                        refusal.Message,
                        Is.EqualTo(
                            "libdefrec.so.1 offers version " + version / 1000 + "." +
                            version % 1000 + " of the C API; this Defrec.dll needs " +
                            Constants.ApiMajor + "." + Constants.ApiMinor + " or a later " +
                            Constants.ApiMajor + ".x."));
                }
                Assert.That(Stub.Calls(), Has.All.EqualTo("defrec_version()"));
            }
            foreach (int version in new[] { own, own + 1, 1000 * Constants.ApiMajor + 999 })
            {
                Stub.Answer("defrec_version", (Status)version, "");
                new Context().Dispose();
            }
        }
    }
}

using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Text;
using Defrec.Native;
using NUnit.Framework;

namespace Defrec.Tests
{
    /// <summary>
    /// The stub libdefrec (bindings/stub): what it was called with, and what it shall answer.
    /// </summary>
    internal static unsafe class Stub
    {
        /// <summary>The stub's functions.</summary>
        [DllImport(NativeMethods.Library, CallingConvention = CallingConvention.Cdecl)]
        private static extern void defrec_stub_answer(byte* function, Status status, byte* message);

        [DllImport(NativeMethods.Library, CallingConvention = CallingConvention.Cdecl)]
        private static extern byte* defrec_stub_calls();

        [DllImport(NativeMethods.Library, CallingConvention = CallingConvention.Cdecl)]
        private static extern void defrec_stub_reset();

        internal static void Answer(string function, Status status, string message)
        {
            fixed (byte* name = Utf8.Bytes(function, "function"),
                   text = Utf8.Bytes(message, "message"))
                defrec_stub_answer(name, status, text);
        }

        /// <summary>Every call since the last time, one a line.</summary>
        internal static string[] Calls()
        {
            return Utf8.Read(defrec_stub_calls())
                .Split(new[] { '\n' }, StringSplitOptions.RemoveEmptyEntries);
        }

        /// <summary>The one call of this function since the last time.</summary>
        internal static string Call(string function)
        {
            string[] calls = Array.FindAll(Calls(), call => call.StartsWith(function + "("));
            Assert.That(calls.Length, Is.EqualTo(1), function);
            return calls[0];
        }

        internal static void Reset() { defrec_stub_reset(); }

        /// <summary>A struct as the stub writes it down.</summary>
        internal static string Hex(void* data, int size)
        {
            var text = new StringBuilder();
            for (int i = 0; i < size; ++i) text.Append(((byte*)data) [i].ToString("x2"));
            return text.ToString();
        }

        internal static string Handle(DefrecHandle handle)
        {
            return "0x" + handle.DangerousGetHandle().ToInt64().ToString("x");
        }

        /// <summary>
        /// Handles that these calls made and that were not destroyed, or not once, with the
        /// function that made or destroyed them.
        /// </summary>
        internal static List<string> Unbalanced(IEnumerable<string> calls)
        {
            var open = new Dictionary<string, string>();
            var wrong = new List<string>();
            foreach (string call in calls)
            {
                string function = call.Substring(0, call.IndexOf('('));
                int made = call.LastIndexOf("out=0x", StringComparison.Ordinal);
                if (made >= 0) open.Add(call.Substring(made + 4, call.Length - made - 5), function);
                if (!function.EndsWith("_destroy") && !function.EndsWith("_release")) continue;
                string handle = call.Substring(call.IndexOf('=') + 1).TrimEnd(')');
                if (!open.ContainsKey(handle) || DestroyerOf(open[handle]) != function)
                    wrong.Add(call);
                open.Remove(handle);
            }
            foreach (KeyValuePair<string, string> left in open)
                wrong.Add(left.Value + ": " + left.Key);
            return wrong;
        }

        private static string DestroyerOf(string maker)
        {
            switch (maker)
            {
                case "defrec_context_create": return "defrec_context_destroy";
                case "defrec_rig_create": return "defrec_rig_destroy";
                case "defrec_stage_create": return "defrec_stage_destroy";
                case "defrec_tracker_create": return "defrec_tracker_destroy";
                case "defrec_memory_import": return "defrec_memory_release";
                case "defrec_tracker_submit": return "defrec_job_release";
                case "defrec_targets_create": return "defrec_targets_destroy";
                case "defrec_tracker_get_template":
                case "defrec_template_load": return "defrec_template_release";
                default: return "unknown maker " + maker;
            }
        }
    }

    /// <summary>
    /// A test with a context, a rig and a tracker of the stub, and no calls written down yet.
    /// </summary>
    public abstract class StubTest
    {
        internal Context Context;
        internal Rig Rig;
        internal Tracker Tracker;

        internal static readonly Camera Camera = new Camera(100.5, 101.5, 40.25, 30.75, 4.5);
        internal const int Width = 64, Height = 48;

        [SetUp]
        public void MakeObjects()
        {
            Stub.Reset();
            Context = new Context();
            Rig = new Rig(Context, RigDescription.Rectified(Width, Height, Camera));
            Tracker = new Tracker(Context, Rig);
            Stub.Reset();
        }

        [TearDown]
        public void DisposeObjects()
        {
            Tracker.Dispose();
            Rig.Dispose();
            Context.Dispose();
        }

        internal static Image GrayImage()
        {
            return new Image(new byte[Width * Height], Width, Height, PixelFormat.Gray8);
        }

        internal Job Submit(long timestampNs = 1)
        {
            return Tracker.Submit(GrayImage(), GrayImage(), timestampNs);
        }
    }
}

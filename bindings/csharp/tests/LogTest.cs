using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Threading;
using Defrec.Native;
using NUnit.Framework;

namespace Defrec.Tests
{
    /// <summary>
    /// The log of a real library: it survives collections, and what its handler does wrong stays in
    /// it.
    /// </summary>
    [TestFixture]
    public class LogTest
    {
        private string folder, nothing;

        /// <summary>A folder in which every candidate is refused, with a warning.</summary>
        [SetUp]
        public void MakeFolder()
        {
            folder = Path.Combine(TestPaths.Scratch, "plugins");
            Directory.CreateDirectory(folder);
            nothing = Path.Combine(folder, "nothing.json");
            File.WriteAllText(nothing, "{ \"no\": \"manifest\" }");
        }

        private ContextOptions Options(LogHandler log)
        {
            var options = new ContextOptions { OnlyGivenPlugins = true, Log = log };
            options.PluginPaths.Add(nothing);
            return options;
        }

        [Test]
        public void LevelSourceAndTextArrive()
        {
            var lines = new List<string>();
            using (new Context(
                Options((level, source, text) => lines.Add(level + " " + source + ": " + text))))
            {
            }
            Assert.That(lines, Has.Count.GreaterThan(0));
            Assert.That(
                lines[0], Is.StringStarting("Warning sdk: ").And.StringContaining("nothing.json"));

            lines.Clear();
            ContextOptions quiet = Options((level, source, text) => lines.Add(text));
            quiet.LogLevel = LogLevel.Error;
            using (new Context(quiet)) { }
            Assert.That(lines, Is.Empty);
        }

        [Test]
        public void TheHandlerSurvivesCollections()
        {
            int[] lines = { 0 };
            WeakReference handler;
            Context context = MakeWithHandler(lines, out handler);
            Collect();
            Assert.That(handler.IsAlive, "nobody but the binding has it");
            int before = lines[0];
            // Loading a template is what a living context logs.
            string file = WriteTemplate();
            for (int i = 0; i < 5; ++i)
            {
                Collect();
                Template.Load(context, file).Dispose();
            }
            Assert.That(lines[0], Is.EqualTo(before + 5));
            context.Dispose();
            Assert.That(ContextLog.Count, Is.EqualTo(0));
        }

        private Context MakeWithHandler(int[] lines, out WeakReference handler)
        {
            LogHandler log = (level, source, text) => ++lines[0];
            handler = new WeakReference(log);
            return new Context(Options(log));
        }

        private static void Collect()
        {
            GC.Collect();
            GC.WaitForPendingFinalizers();
            GC.Collect();
        }

        [Test]
        public void AnExceptionInTheHandlerEndsThere()
        {
            int calls = 0;
            using (var context = new Context(Options(
                       (level, source, text) =>
                       {
                           ++calls;
                           throw new InvalidOperationException("from the handler");
                       })))
                Assert.That(context.GetDevices(), Is.Empty);
            Assert.That(calls, Is.GreaterThan(0));
        }

        [Test]
        public void TheHandlerMustNotCallDefrec()
        {
            var refusals = new List<DefrecException>();
            using (new Context(Options(
                (level, source, text) =>
                {
                    try
                    {
                        new Context().Dispose();
                    }
                    catch (DefrecException e)
                    {
                        refusals.Add(e);
                    }
                })))
            {
            }
            Assert.That(refusals, Has.Count.GreaterThan(0));
            Assert.That(refusals.Select(e => e.Status), Has.All.EqualTo(Status.ErrorState));
        }

        [Test]
        public void LinesComeOnAnyThreadWhileOthersCollect()
        {
            string file = WriteTemplate();
            int lines = 0;
            bool stop = false;
            var collector = new Thread(() =>
            {
                while (!Volatile.Read(ref stop)) GC.Collect();
        });
        collector.Start();
        const int Loads = 25;
        Thread[] loaders =
            Enumerable.Range(0, 3)
                .Select(
                    i => new Thread(
                        () =>
                        {
                            using (var context = new Context(Options(
                                       (level, source, text) =>
                                       {
                                           if (level == LogLevel.Info &&
                                               text.Length == new string(text.ToCharArray()).Length)
                                               Interlocked.Increment(ref lines);
                                       })))
                                for (int k = 0; k < Loads; ++k)
                                    Template.Load(context, file).Dispose();
                        }))
                .ToArray();
        foreach (Thread loader in loaders) loader.Start();
        foreach (Thread loader in loaders) loader.Join();
        Volatile.Write(ref stop, true);
        collector.Join();
        Assert.That(lines, Is.EqualTo(loaders.Length* Loads));
    }

    /// <summary>
    /// A plugin logs from threads of its own, which take no signals: the runtime must be able to
    /// collect all the same.
    /// </summary>
    [Test]
    public void LinesComeFromNativeThreads()
    {
        var threads = new HashSet<int>();
        var options = new ContextOptions {
            OnlyGivenPlugins = true,
            LogLevel = LogLevel.Debug,
            Log =
                (level, source, text) =>
            {
                if (level != LogLevel.Debug) return;
                lock (threads) threads.Add(Thread.CurrentThread.ManagedThreadId);
            },
        };
        options.PluginPaths.Add(TestPaths.AsynchronousPlugin);
        using (var session =
                   new TrackingSession(new TrackerOptions { DeviceId = "asynchronous" }, options))
        {
            for (int frame = 0; frame < 4; ++frame)
            {
                session.Track(frame).Dispose();
                Collect();
            }
        }
        threads.Remove(Thread.CurrentThread.ManagedThreadId);
        Assert.That(threads, Is.Not.Empty);
    }

    private static string WriteTemplate()
    {
        string file = Path.Combine(TestPaths.Scratch, "template");
        if (!File.Exists(file))
            using (var session = new TrackingSession(null)) session.SaveTemplate(file);
        return file;
    }
}
}

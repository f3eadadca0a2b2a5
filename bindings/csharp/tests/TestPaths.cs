using System;
using System.IO;

namespace Defrec.Tests
{
    /// <summary>Where things are: CMakeLists.txt says it in the environment.</summary>
    internal static class TestPaths
    {
        internal static string Header
        {
            get
            {
                return Get("DEFREC_TEST_HEADER");
            }
        }
        internal static string Layout
        {
            get
            {
                return Get("DEFREC_TEST_LAYOUT");
            }
        }
        internal static string Exports
        {
            get
            {
                return Get("DEFREC_TEST_EXPORTS");
            }
        }
        /// <summary>The rendered sequence.</summary>
        internal static string Sequence
        {
            get
            {
                return Get("DEFREC_TEST_SEQUENCE");
            }
        }
        /// <summary>What `defrec track` made of it.</summary>
        internal static string Tracked
        {
            get
            {
                return Get("DEFREC_TEST_TRACKED");
            }
        }
        /// <summary>Folder of the plugin that computes and logs on threads of its own.</summary>
        internal static string AsynchronousPlugin
        {
            get
            {
                return Get("DEFREC_TEST_ASYNCHRONOUS_PLUGIN");
            }
        }
        /// <summary>Folder of the plugin with several devices, one of them broken.</summary>
        internal static string SeveralDevicesPlugin
        {
            get
            {
                return Get("DEFREC_TEST_SEVERAL_DEVICES_PLUGIN");
            }
        }
        /// <summary>Folder of the plugins beside the library.</summary>
        internal static string Plugins
        {
            get
            {
                return Get("DEFREC_TEST_PLUGINS");
            }
        }
        /// <summary>Where tests may write.</summary>
        internal static string Scratch =>
            Directory.CreateDirectory(Get("DEFREC_TEST_SCRATCH")).FullName;

        private static string Get(string name)
        {
            string value = Environment.GetEnvironmentVariable(name);
            if (string.IsNullOrEmpty(value))
                throw new InvalidOperationException(name + " is not set; run the tests by ctest.");
            return value;
        }
    }
}

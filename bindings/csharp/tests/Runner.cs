using System;
using System.Linq;
using System.Reflection;
using NUnit.Framework;

namespace Defrec.Tests
{
    /// <summary>
    /// Runs the tests of one fixture. nunit-console is not used: it leaves by Environment.Exit, in
    /// which Mono now and then waits for ever for nunit-console's own threads.
    /// </summary>
    internal static class Runner
    {
        private static int Main(string[] fixture)
        {
            Type type = Type.GetType("Defrec.Tests." + fixture[0], true);
            MethodInfo[] methods = type.GetMethods();
            int run = 0, failed = 0;
            foreach (MethodInfo test in With<TestAttribute>(methods))
            {
                ++run;
                try
                {
                    object tests = Activator.CreateInstance(type);
                    // Those of a base class first, and at the end last.
                    foreach (MethodInfo prepare in With<SetUpAttribute>(methods).OrderBy(Depth))
                        prepare.Invoke(tests, null);
                    try
                    {
                        test.Invoke(tests, null);
                    }
                    finally
                    {
                        foreach (MethodInfo clear in With<TearDownAttribute>(methods)
                                     .OrderByDescending(Depth))
                            clear.Invoke(tests, null);
                    }
                    Console.WriteLine("passed " + test.Name);
                }
                catch (TargetInvocationException e)
                {
                    ++failed;
                    Console.WriteLine("FAILED " + test.Name + ": " + e.InnerException);
                }
            }
            Console.WriteLine(run + " tests, " + failed + " failed");
            return run > 0 && failed == 0 ? 0 : 1;
        }

        private static MethodInfo[] With<TAttribute>(MethodInfo[] methods)
        {
            return methods.Where(method => method.IsDefined(typeof(TAttribute), true)).ToArray();
        }

        private static int Depth(MethodInfo method)
        {
            int depth = 0;
            for (Type type = method.DeclaringType; type != null; type = type.BaseType) ++depth;
            return depth;
        }
    }
}

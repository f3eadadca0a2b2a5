// Lists the devices of this machine, and the plugins that were refused, with the reason.
//   list_devices
using System;
using Defrec;

internal static class ListDevices
{
    private static int Main()
    {
        return Sample.Run(
            () =>
            {
                using (var context = new Context()) // finds the plugins beside the library
                {
                    int api = DefrecLibrary.ApiVersion;
                    Console.WriteLine(
                        "defrec {0}, API {1}.{2}", DefrecLibrary.Release, api / 1000, api % 1000);
                    foreach (DeviceInfo device in context.GetDevices())
                    {
                        Console.WriteLine(
                            "device {0}: {1} ({2}), driver {3}, {4} MiB, {5} of {6} stages, {7}",
                            device.Id, device.Name, device.Kind,
                            device.Driver == "" ? "none" : device.Driver, device.MemoryBytes >> 20,
                            CountBits((uint)device.Stages), Constants.StageCountV1,
                            device.Conformance != 0
                                ? "conformance suite " + device.Conformance + " passed"
                                : "no conformance certified");
                    }
                    foreach (PluginInfo plugin in context.GetPlugins())
                        if (plugin.Verdict < 0)
                            Console.WriteLine("refused {0}: {1}", plugin.Path, plugin.Reason);
                }
            });
    }

    private static int CountBits(uint mask)
    {
        int count = 0;
        for (; mask != 0; mask &= mask - 1) ++count;
        return count;
    }
}

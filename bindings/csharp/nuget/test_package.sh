#!/usr/bin/env bash
# Installs the NuGet package from its folder, and runs a program with what was installed and nothing
# else of defrec.
#   test_package.sh PACKAGE.nupkg NATIVE_FOLDER_IN_IT WORK_FOLDER NUGET MCS MONO
set -euo pipefail
package=$1 native=$2 work=$3 nuget=$4 mcs=$5 mono=$6

rm -rf "$work"
mkdir -p "$work/home" "$work/program"
# nuget writes settings there; and its folder in /tmp may be another user's.
export HOME=$work/home XDG_CONFIG_HOME=$work/home TMPDIR=$work/home
(cd "$work" && "$nuget" install Defrec -Source "$(dirname "$package")" \
    -OutputDirectory "$work/installed" -NonInteractive -NoCache)
installed=$(echo "$work"/installed/Defrec.*)

# The binaries contain Eigen, whose licence goes with it.
grep -q '^eigen .*libdefrec' "$installed/notices.txt"
grep -q '"bomFormat": "CycloneDX"' "$installed/bom.json"
grep -q '"spdxVersion": "SPDX-2.3"' "$installed/bom.spdx.json"

test -s "$installed/README.md"

# As a build tool lays a program out: assembly and native files beside it.
cp "$installed"/lib/netstandard2.0/Defrec.dll "$installed/$native"/* "$work/program"
cat >"$work/program/Program.cs" <<'PROGRAM'
using System;
using Defrec;

internal static class Program
{
    private static void Main()
    {
        using (var context = new Context())
        {
            foreach (PluginInfo plugin in context.GetPlugins())
                Console.WriteLine("{0} {1} {2}", plugin.Verdict, plugin.Path, plugin.Reason);
            foreach (DeviceInfo device in context.GetDevices())
                Console.WriteLine("device {0} {1}", device.Id, device.Stages);
        }
    }
}
PROGRAM
"$mcs" -nologo -warnaserror "-reference:$work/program/Defrec.dll" \
    "-out:$work/program/program.exe" "$work/program/Program.cs"
cd /
env -u LD_LIBRARY_PATH "$mono" "$work/program/program.exe" | tee "$work/output.txt"
grep -q "^Ok $work/program/defrec_plugin_cpu" "$work/output.txt"
grep -q '^device cpu All$' "$work/output.txt"
if grep '^Error' "$work/output.txt"; then exit 1; fi

#!/usr/bin/env bash
# The commands of the guide's "A plan to try", run as they stand there, follow the tumour.
# test_plan_to_try.sh PLAN.md FOLDER_OF_DEFREC SCRATCH
set -euo pipefail
guide=$1 scratch=$3
export PATH="$2:$PATH"
samples="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
rm -rf "$scratch"
mkdir -p "$scratch"
cd "$scratch"
awk '/^## /{inside = /A plan to try/} inside && /^```sh$/{code = 1; next} /^```$/{code = 0} code' \
    "$guide" | sed "s|^samples=[^ ]*|samples=$samples|" >commands.sh
grep -q '^samples=/' commands.sh
bash -euo pipefail commands.sh
# 12 frames of 16 targets and a part, none of them lost; the middle is within a millimetre of where
# it was put in the first frame.
awk -F, '
    NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
    { ++rows }
    $column["status"] == "lost" { ++lost }
    $column["frame"] == 0 && $column["part"] != "" {
        found = 1
        far = ($column["x"] + 5) ^ 2 + ($column["y"] - 3) ^ 2 + ($column["z"] - 85) ^ 2 > 1
    }
    END { print rows, "rows,", lost + 0, "lost"; exit !(rows == 204 && !lost && found && !far) }
' tracked/plan.csv
test -s tracked/overlay.mp4
grep -q tumour tracked/report.html

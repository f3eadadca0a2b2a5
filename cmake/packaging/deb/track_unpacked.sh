#!/bin/sh
# Tracks a sequence with the program, library and plugin of unpacked packages; its points must be
# those that were found before, byte by byte. And defrec-conformance finds what it needs, shells
# what they complete.
#   track_unpacked.sh ROOT SEQUENCE TRACKED WORK_FOLDER
set -eu
root=$1 sequence=$2 tracked=$3 work=$4
"$root/usr/bin/defrec" devices | grep -F "plugin $root/usr/lib" |
    grep -F "defrec_plugin_cpu.json: loaded"
"$root/usr/bin/defrec" track --left "$sequence/left" --right "$sequence/right" \
    --calibration "$sequence/calibration.yaml" --points "$sequence/points.csv" --backend cpu \
    --no-overlay --quiet --out "$work"
cmp "$tracked/points.csv" "$work/points.csv"
"$root/usr/bin/defrec" demo --no-open --out "$work/demo"
test -s "$work/demo/result/report.html"
# As bash-completion loads it.
bash -euc 'source "$0/usr/share/bash-completion/completions/defrec"
    COMP_WORDS=(defrec render heartb) COMP_CWORD=2
    _defrec
    [ "${COMPREPLY[*]}" = heartbeat ]' "$root"
for shell in bash zsh fish; do
    "$root/usr/bin/defrec" completion $shell >"$work/completion"
    cmp "$work/completion" "$root"/usr/share/$shell*/*completions*/*defrec*
done
"$root/usr/bin/defrec-conformance" --backend cpu --case abi/table_complete --out "$work/conformance"

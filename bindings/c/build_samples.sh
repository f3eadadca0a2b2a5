#!/bin/sh
# Builds the samples in C of an installed SDK, as its guide says. Every sample of the source tree
# must be among them, but for those whose libraries this machine lacks; list_devices runs.
#   build_samples.sh CMAKE SDK FOLDER_OF_SAMPLES_THERE SAMPLES_OF_THE_SOURCE_TREE WORK_FOLDER
set -eu
cmake=$1 sdk=$2 folder=$3 source=$4 work=$5
rm -rf "$work"
"$cmake" -S "$sdk/$folder" -B "$work" -DCMAKE_PREFIX_PATH="$sdk"
"$cmake" --build "$work"
for sample in $(cd "$source" && grep -l '^int main' -- *.c); do
    [ "$sample" != gstreamer_points.c ] || pkg-config --exists gstreamer-app-1.0 || continue
    [ -x "$work/bin/${sample%.c}" ] || {
        echo "sample ${sample%.c} was not built"
        exit 1
    }
done
"$work/bin/list_devices" | grep '^device cpu: '

#!/bin/sh
# Builds the Debian packages into a folder that has no others: none of an earlier version or
# configuration stays.
#   build_packages.sh CPACK CONFIGURATION_FILE FOLDER
set -eu
cpack=$1 configuration=$2 folder=$3
rm -rf "$folder"
"$cpack" --config "$configuration" -B "$folder"

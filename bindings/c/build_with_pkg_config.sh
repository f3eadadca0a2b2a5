#!/bin/sh
# Builds a C program against an installed SDK by pkg-config, and runs it.
#   build_with_pkg_config.sh FOLDER_OF_LIBRARIES SOURCE.c WORK_FOLDER
set -eu
libraries=$1 source=$2 work=$3
mkdir -p "$work"
export PKG_CONFIG_PATH="$libraries/pkgconfig"
# pkg-config writes for a shell: a folder with spaces comes escaped.
eval "set -- $(pkg-config --cflags --libs 'defrec >= 0.1')"
cc -std=c99 -Wall -Wextra -pedantic -Werror "$source" "$@" -o "$work/application"
LD_LIBRARY_PATH="$libraries" "$work/application"

#!/usr/bin/env bash
# Packs the zip for Windows, unpacks it in a folder whose name has a space and a letter beyond
# ASCII, and uses it as someone would who never saw the sources: builds the projects against it by
# its CMake package, and runs them and its programs in a Wine that was never used.
#   test_zip.sh CPACK BUILD PROJECTS WORK WINE CC DLLTOOL
set -euo pipefail
cpack=$1 build=$2 projects=$3 work=$4 wine=$5 cc=$6 dlltool=$7
rm -rf "$work"
mkdir -p "$work/unpacked ö"
(cd "$build" && "$cpack" -G ZIP -B "$work/packed") >"$work/cpack.log" || {
    cat "$work/cpack.log"
    exit 1
}
unzip -q "$work"/packed/defrec-*-windows-x86_64.zip -d "$work/unpacked ö"
sdk=$(ls -d "$work/unpacked ö"/defrec-*-windows-x86_64)

for file in LICENSE include/defrec_c.h include/defrec_plugin.h \
    lib/libdefrec.dll.a lib/libdefrec.def lib/cmake/defrec/defrec-config.cmake \
    bin/libdefrec.dll bin/defrec_plugin_{cpu,reference,vulkan}.{dll,json} \
    share/defrec/plugin_template/CMakeLists.txt \
    licences/{yaml-cpp,highway,libeigen3-dev,libvulkan-dev,libvulkan-volk-dev}.txt \
    licences/{gcc-mingw-w64-base,mingw-w64-x86-64-dev}.txt; do
    [ -s "$sdk/$file" ] || {
        echo "the zip lacks $file"
        exit 1
    }
done
if grep -rlaF -e "$build" -e "$work" "$sdk"; then
    echo "name the folders of the build"
    exit 1
fi

export WINEDEBUG=-all WINEPREFIX="$work/wine"
end_wine() {
    wineserver -k 2>/dev/null ||
        "$(dirname "$(readlink -f "$wine")")/wineserver64" -k 2>/dev/null || true
}
trap end_wine EXIT
run() { # PROGRAM ARGUMENT...: from another folder than its own
    (cd "$work" && "$wine" "$@" 2>"$work/stderr" | tr -d '\r') || {
        cat "$work/stderr"
        return 1
    }
}

toolchain=$(sed -n 's/^CMAKE_TOOLCHAIN_FILE:[A-Z]*=//p' "$build/CMakeCache.txt")
prefix=$(sed -n 's/^DEFREC_WINDOWS_PREFIX:[A-Z]*=//p' "$build/CMakeCache.txt")
source=$(sed -n 's/^CMAKE_HOME_DIRECTORY:[A-Z]*=//p' "$build/CMakeCache.txt")
case $toolchain in /*) ;; *) toolchain=$source/$toolchain ;; esac
for language in c cxx; do
    DEFREC_WINDOWS_PREFIX="$prefix" cmake -S "$projects/$language" -B "$work/$language" -G Ninja \
        --toolchain "$toolchain" "-Ddefrec_DIR=$sdk/lib/cmake/defrec" \
        >"$work/configure.log" 2>&1 || {
        cat "$work/configure.log"
        exit 1
    }
    cmake --build "$work/$language" >"$work/build.log" 2>&1 || {
        cat "$work/build.log"
        exit 1
    }
    # Beside the DLL, where Windows looks for it.
    cp "$work/$language/application.exe" "$sdk/bin/application_$language.exe"
    run "$sdk/bin/application_$language.exe"
done

# An import library that another tool makes of the list of exports.
(cd "$work" && "$dlltool" -d "$sdk/lib/libdefrec.def" -l defrec.lib)
"$cc" -static "-I$sdk/include" "$projects/c/application.c" "$work/defrec.lib" \
    -o "$sdk/bin/application_def.exe"
run "$sdk/bin/application_def.exe"

if [ -e "$sdk/bin/list_devices.exe" ]; then
    # Every sample but those that need POSIX or GStreamer.
    for sample in $(cd "$source/samples/c" && grep -l '^int main' -- *.c); do
        case $sample in live_view.c | gstreamer_points.c) continue ;; esac
        [ -s "$sdk/bin/${sample%.c}.exe" ] || {
            echo "the zip lacks the sample ${sample%.c}"
            exit 1
        }
    done
    run "$sdk/bin/list_devices.exe" | tee "$work/devices.txt"
    grep -qE '^device cpu: .* ([0-9]+) of \1 stages' "$work/devices.txt"
    grep -qE '^device reference: .* ([0-9]+) of \1 stages' "$work/devices.txt"
    if grep '^refused' "$work/devices.txt"; then exit 1; fi
fi
echo "the zip works where it was unpacked: $(cd "$work/packed" && du -h defrec-*.zip)"

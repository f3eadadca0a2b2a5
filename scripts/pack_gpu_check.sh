#!/usr/bin/env bash
# Packs a folder that checks the GPU of another machine, which needs nothing but its driver and a C
# library (docs/backends/cuda.md).
#   scripts/pack_gpu_check.sh [--build FOLDER] OUT
# OUT is made anew. FOLDER: where the project is configured; default build-packages, which is
# configured for every GPU (preset packages).
set -euo pipefail
root="$(cd "$(dirname "$0")/.." && pwd)"

build=""
if [ "${1:-}" = --build ] && [ $# -gt 1 ]; then
    build="$(realpath -m "$2")"
    shift 2
fi
[ $# = 1 ] && [[ "$1" != -* ]] || {
    echo "usage: scripts/pack_gpu_check.sh [--build FOLDER] OUT" >&2
    exit 2
}
out="$(realpath -m "$1")"
cd "$root"
if [ -e "$out" ] && [ ! -e "$out/check.sh" ]; then
    echo "$out exists, and is no such folder" >&2
    exit 2
fi

if [ -z "$build" ]; then
    cmake --preset packages >/dev/null
    build="$root/build-packages"
fi
cmake --build "$build" --target defrec_gpu_check
rm -rf "$out"
mkdir -p "$out"/{bin,tests,lib/defrec-conformance,lib/spare}

cp scripts/gpu_check/* "$out/"
cp "$build"/bin/defrec-{bench,conformance} "$out/bin/"
while read -r backend tests; do
    echo "$backend" >>"$out/backends.txt"
    for program in $tests; do cp "$build/bin/$program" "$out/tests/"; done
done <"$build/gpu_check.txt"
cp "$build/lib/libdefrec.so.1" "$out/lib/"
cp "$build"/lib/defrec_plugin_*.{so,json} "$out/lib/"
cp "$build"/lib/defrec-conformance/defrec_plugin_relay.{so,json} "$out/lib/defrec-conformance/"

# Libraries beyond the C library's own. The compiler's and the Vulkan loader are for machines that
# lack them: beside an older one a driver there may not find what it was built with.
files=("$out"/bin/* "$out"/tests/* "$out"/lib/*.so* "$out"/lib/defrec-conformance/*.so)
vulkan="$(/sbin/ldconfig -p | sed -n 's/.*libvulkan\.so\.1 (libc6,[^)]*64) => //p')"
vulkan="${vulkan%%$'\n'*}"
{
    LD_LIBRARY_PATH="$out/lib" ldd "${files[@]}" | sed -n 's/.* => \(\/.*\) (0x.*/\1/p' | sort -u
    echo "$vulkan"
} | while read -r library; do
    case "$(basename "$library")" in
        '' | libdefrec.* | ld-linux*) ;;
        libc.so* | libm.so* | libdl.so* | libpthread.so* | librt.so*) ;;
        libstdc++.so* | libgcc_s.so* | libvulkan.so*)
            install -D "$library" "$out/lib/spare/$(basename "$library")/$(basename "$library")"
            ;;
        *) cp "$library" "$out/lib/" ;;
    esac
done

# Without symbols, of which the plugins' manifests, that hold their hash, must hear.
find "$out" -type f \( -path '*/bin/*' -o -path '*/tests/*' -o -name '*.so*' \) \
    -exec strip --strip-unneeded {} +
for manifest in "$out"/lib/defrec_plugin_*.json "$out"/lib/defrec-conformance/*.json; do
    name="$(basename "$manifest" .json)"
    version="$(sed -n 's/.*"version": "\(.*\)".*/\1/p' "$manifest")"
    cmake "-DNAME=${name#defrec_plugin_}" "-DVERSION=$version" \
        "-DLIBRARY=${manifest%.json}.so" -P cmake/WritePluginManifest.cmake
done
plugins="$(cd "$out/lib" && ls defrec_plugin_*.so | sed 's/defrec_plugin_//; s/\.so//')"
echo "$out: $(du -sm "$out" | cut -f1) MB," $(ls "$out/tests") "and the plugins" $plugins

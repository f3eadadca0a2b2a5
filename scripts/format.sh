#!/usr/bin/env bash
# Formats the C, C++, CUDA and GLSL sources with clang-format 14, Debian 12's; other versions format
# differently.
#   scripts/format.sh            writes the files that differ
#   scripts/format.sh --check    names them; exit status 1 if there are any, 77 without clang-format
set -euo pipefail
cd "$(dirname "$0")/.."

case "${1:-}" in
    "" | --check) mode="${1:-write}" ;;
    *) echo "usage: scripts/format.sh [--check]" >&2; exit 2 ;;
esac
clang_format=
for candidate in clang-format-14 clang-format; do
    if "$candidate" --version 2>/dev/null | grep -q ' version 14\.'; then
        clang_format="$candidate"
        break
    fi
done
if [ -z "$clang_format" ]; then
    echo "clang-format 14 is not installed, nothing was checked"
    exit 77
fi
export clang_format mode

# files PATTERN...: the sources of these names, NUL after each.
files() {
    local names=(-name "$1") name
    for name in "${@:2}"; do names+=(-o -name "$name"); done
    find . \( -name '.?*' -o -name 'build*' -o -name out -o -name node_modules \) -prune \
        -o -type f \( "${names[@]}" \) -print0
}

# Shaders one by one: clang-format takes the name of a GLSL block for a statement of its own.
format_shaders() {
    local status=0 file formatted
    for file in "$@"; do
        formatted="$("$clang_format" "$file" | sed -z 's/\n}\n\([a-z_]*;\)/\n} \1/g')"
        [ "$formatted" != "$(cat "$file")" ] || continue
        if [ "$mode" = write ]; then
            printf '%s\n' "$formatted" >"$file"
        else
            echo "$file: differs from its format"
            status=1
        fi
    done
    return "$status"
}
export -f format_shaders

status=0
sources=('*.c' '*.h' '*.cpp' '*.hpp' '*.cu' '*.cuh')
shaders=('*.comp' '*.glsl')
flags=(-i)
[ "$mode" = write ] || flags=(--dry-run --Werror --ferror-limit=1)
files "${sources[@]}" | xargs -0 -P "$(nproc)" -n 32 "$clang_format" "${flags[@]}" || status=1
files "${shaders[@]}" | xargs -0 -P "$(nproc)" -n 16 bash -c 'format_shaders "$@"' _ || status=1
# What clang-format does not break: include/, long strings.
if [ "$mode" = --check ]; then
    ! files "${sources[@]}" "${shaders[@]}" | xargs -0 grep -nH '.\{101\}' |
        sed 's/^\([^:]*:[0-9]*\):.*/\1: more than 100 columns/' | grep . || status=1
    [ "$status" = 0 ] || echo "scripts/format.sh formats; lines of include/ are broken by hand"
fi
exit "$status"

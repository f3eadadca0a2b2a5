#!/usr/bin/env bash
# Formats the sources with the formatters of Debian 12; other versions of them format differently.
# C, C++, CUDA, GLSL, JavaScript, C#: clang-format 14. Python: black 23. Shell: shfmt 3. CMake:
# cmake-format 0.6.
#   scripts/format.sh [--check] [FILE...]
# writes those of the files, or of all sources, that differ. --check names them instead; its exit
# status is 1 if there are any, and else 77 if a formatter is missing.
set -euo pipefail

if [ "${1:-}" = --check ]; then
    mode=check
    clang=(--dry-run --Werror --ferror-limit=1) csharp=(--check) black=(--check) cmake=(--check)
    shift
else
    mode=write
    clang=(-i) csharp=() black=(-q) cmake=(-i)
fi
if [[ ${1:-} == -* ]]; then
    echo "usage: scripts/format.sh [--check] [FILE...]" >&2
    exit 2
fi
given=()
for file; do given+=("$(realpath "$file")"); done
cd "$(dirname "$0")/.."

# formatter NAME VERSION CANDIDATE...: sets $formatter to the command of that version.
missing=
formatter() {
    for formatter in "${@:3}"; do
        ! "$formatter" --version 2>/dev/null | grep -qE "(^|[^.0-9])$2\." || return 0
    done
    echo "$1 $2 is not installed; its files are left out"
    missing=1
    return 1
}

# files PATTERN...: the paths of sources that end so, NUL after each.
files() {
    local wanted=(-path "*$1") end
    for end in "${@:2}"; do wanted+=(-o -path "*$end"); done
    if [ ${#given[@]} -gt 0 ]; then
        find "${given[@]}" -maxdepth 0 -type f \( "${wanted[@]}" \) -print0
    else
        find . -type d \( -name '.?*' ! -name .ci -o -name 'build*' -o -name out \
            -o -name node_modules \) -prune -o -type f \( "${wanted[@]}" \) -print0
    fi
}

# each COUNT COMMAND...: runs it on the files of stdin, COUNT at a time.
each() {
    xargs -0 -r -P "$(nproc)" -n "$@"
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

format_shell() {
    local differing
    if [ "$mode" = write ]; then
        shfmt -w "$@"
    else
        differing="$(shfmt -l "$@")" || return 1
        [ -z "$differing" ] || ! sed 's/$/: differs from its format/' <<<"$differing"
    fi
}
export mode
export -f format_shaders format_shell

status=0
if formatter clang-format 14 clang-format-14 clang-format; then
    export clang_format="$formatter"
    files .c .h .cpp .hpp .cu .cuh .js .mjs | each 32 "$clang_format" "${clang[@]}" || status=1
    files .comp .glsl | each 16 bash -c 'format_shaders "$@"' _ || status=1
    files .cs | each 16 python3 scripts/format_csharp.py "${csharp[@]}" "$clang_format" || status=1
fi
if formatter black 23 black; then
    files .py | each 200 black "${black[@]}" |&
        { grep -E '^(would reformat|error)' || true; } || status=1
fi
if formatter shfmt 3 shfmt; then
    files .sh .ci/run | each 32 bash -c 'format_shell "$@"' _ || status=1
fi
if formatter cmake-format 0.6 cmake-format; then
    files CMakeLists.txt .cmake .cmake.in | each 16 cmake-format "${cmake[@]}" || status=1
fi
[ "$status" = 0 ] || exit 1
[ -z "$missing" ] || exit 77

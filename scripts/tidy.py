#!/usr/bin/env python3
"""Runs clang-tidy 14 with the checks of .clang-tidy over the C, C++ and CUDA sources.

usage: tidy.py [--build FOLDER] [--jobs N] [FILE|FOLDER...]

Needs a folder that is configured and built: its compile_commands.json, and the headers that the
build writes. Most of the time goes into headers that many sources share, so sources that are
compiled alike are checked together, as one translation unit that includes them. Where that does not
compile, the sources at fault are checked apart. A unit without findings is not checked again until one of its files, the
checks or clang-tidy change. CUDA sources are checked as the C++ that tests without a GPU compile.
Left out: tests, the plugins that are faulty on purpose, and the generated program of the layout.

Exit status: 0 no findings, 1 findings, 77 without clang-tidy 14.
"""
import argparse
import concurrent.futures
import hashlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CHECKS = ROOT / ".clang-tidy"
SKIPPED = 77
LANGUAGES = {".c": "c", ".cpp": "c++", ".cu": "c++"}
LEFT_OUT = re.compile(r"_test\.cpp$|test_main\.cpp$|^plugins/faulty/(?!frame)|^sdk/abi/layout\.c$")
# Options that say what a source means; what only names the target would keep sources apart.
MEANING = re.compile(r"-([IDU]|std=|march=|W(all|extra|pedantic|no-[a-z-]+)$)(?!.*_EXPORTS$)")
# What a source declares outside of classes and functions: those lines are not indented.
DECLARATION = re.compile(
    r"^(?!namespace|template|extern|HWY_)\w[^;{=(\n]*?(?<!::)\b(\w+)(?:<[^>]*>)?\s*[\[{=(;]",
    re.MULTILINE)
FINDING = re.compile(r"^(?=\S+:\d+:\d+: (?:warning|error):)", re.MULTILINE)
ERROR = re.compile(r"^(\S+?):\d+:\d+: error:", re.MULTILINE)
INCLUDED = re.compile(r"^\.+ (.*)$", re.MULTILINE)  # what option -H prints


class Unit:
    """Sources that are checked as one."""

    def __init__(self, arguments):
        self.arguments = arguments
        self.sources = []
        self.names = set()

    def add(self, source, names):
        self.sources.append(source)
        self.names |= names

    def size(self):
        return sum(source.stat().st_size for source in self.sources)


def meaning(command, language):
    """Of a compiler's command line the options that say what a source means."""
    kept = ["-x", language]
    words = iter(shlex.split(command))
    for word in words:
        if word in ("-isystem", "-include"):
            kept += [word, next(words)]
        elif MEANING.match(word):
            kept.append(word)
    if "-DHWY_SHARED_DEFINE" in kept:
        kept.append("-DHWY_COMPILE_ONLY_STATIC")  # one instruction set stands for all
    return kept


def sources_of(build):
    """Options of each source of the project that the build compiles."""
    sources = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        source = Path(entry["directory"], entry["file"]).resolve()
        if ROOT not in source.parents or build in source.parents or source in sources:
            continue
        # nvcc's C++ is not clang's.
        if LEFT_OUT.search(str(source.relative_to(ROOT))) or "nvcc" in entry["command"].split()[0]:
            continue
        sources[source] = meaning(entry["command"], LANGUAGES[source.suffix])
    return sources


def units_of(sources):
    """Units of sources of one folder at the top level, with the same options, that declare no name
    twice."""
    units = {}
    for source, arguments in sorted(sources.items()):
        names = set(DECLARATION.findall(source.read_text()))
        alike = units.setdefault((source.relative_to(ROOT).parts[0], *arguments), [])
        unit = next((unit for unit in alike if not names & unit.names), None)
        if unit is None:
            unit = Unit(arguments)
            alike.append(unit)
        unit.add(source, names)
    return [unit for alike in units.values() for unit in alike]


def parts_of(unit, output):
    """Two units in place of one that does not compile: the sources in which clang-tidy says that
    errors are, and the others; or halves, where errors are in headers alone."""
    failed = {Path(path).resolve() for path in ERROR.findall(output)} & set(unit.sources)
    if not failed or len(failed) == len(unit.sources):
        failed = set(unit.sources[:len(unit.sources) // 2])
    parts = Unit(unit.arguments), Unit(unit.arguments)
    for source in unit.sources:
        parts[source in failed].add(source, set())
    return parts


class Checker:
    def __init__(self, clang_tidy, folder):
        self.clang_tidy = clang_tidy
        self.folder = folder
        version = subprocess.run([clang_tidy, "--version"], capture_output=True, check=True).stdout
        self.common = version + CHECKS.read_bytes() + Path(__file__).read_bytes()

    def fingerprint(self, arguments, files):
        digest = hashlib.sha256(self.common)
        for argument in arguments:
            digest.update(argument.encode() + b"\0")
        for file in files:
            digest.update(file.encode() + b"\0" + Path(file).read_bytes())
        return digest.hexdigest()

    def check(self, unit):
        """What clang-tidy says of a unit; nothing where there is nothing to say."""
        includes = "".join(f'#include "{source}"\n' for source in unit.sources)
        name = hashlib.sha256("\0".join([includes, *unit.arguments]).encode()).hexdigest()[:16]
        record = self.folder / f"{name}.json"
        if record.exists():
            clean = json.loads(record.read_text())
            if all(Path(file).exists() for file in clean["files"]) and \
                    clean["fingerprint"] == self.fingerprint(unit.arguments, clean["files"]):
                return ""
        file = unit.sources[0]
        if len(unit.sources) > 1:
            file = self.folder / f"{name}{file.suffix}"
            file.write_text(includes)
        run = subprocess.run(
            [self.clang_tidy, "--quiet", f"--config-file={CHECKS}", str(file), "--",
             *unit.arguments, "-H"], capture_output=True, text=True, cwd=ROOT, check=False)
        if "clang-diagnostic-error" in run.stdout and len(unit.sources) > 1:
            return "".join(self.check(part) for part in parts_of(unit, run.stdout))
        if run.stdout.strip() or run.returncode != 0:
            return run.stdout or run.stderr
        files = sorted({str(source) for source in unit.sources} |
                       {path for path in INCLUDED.findall(run.stderr)
                        if path.startswith(f"{ROOT}/") and path != str(file)})
        record.write_text(json.dumps(
            {"fingerprint": self.fingerprint(unit.arguments, files), "files": files}))
        return ""


def find_clang_tidy():
    for name in ("clang-tidy-14", "clang-tidy"):
        path = shutil.which(name)
        if path and b"version 14." in subprocess.run([path, "--version"], capture_output=True,
                                                     check=False).stdout:
            return path
    return None


def main():
    parser = argparse.ArgumentParser(description="Runs clang-tidy over the project's sources.")
    parser.add_argument("--build", type=Path, default=ROOT / "build", help="a built folder")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="units at a time")
    parser.add_argument("paths", nargs="*", type=Path, help="what to check, default: everything")
    options = parser.parse_args()
    clang_tidy = find_clang_tidy()
    if clang_tidy is None:
        print("clang-tidy 14 is not installed, nothing was checked")
        return SKIPPED

    build = options.build.resolve()
    sources = sources_of(build)
    if options.paths:
        wanted = {path.resolve() for path in options.paths}
        sources = {source: arguments for source, arguments in sources.items()
                   if wanted & {source, *source.parents}}
    folder = build / "tidy"
    folder.mkdir(exist_ok=True)
    checker = Checker(clang_tidy, folder)
    units = sorted(units_of(sources), key=Unit.size, reverse=True)  # no long one at the end
    found = set()
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for done in concurrent.futures.as_completed(pool.submit(checker.check, u) for u in units):
            for finding in FINDING.split(done.result()):
                # A header is checked in every unit that includes it.
                if finding.strip() and finding not in found:
                    found.add(finding)
                    print(finding.strip(), flush=True)
    print(f"{len(sources)} sources in {len(units)} units, {len(found)} findings")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Runs clang-tidy 14 with the checks of .clang-tidy over the C, C++ and CUDA sources.

usage: tidy.py [--build FOLDER] [--jobs N] [FILE|FOLDER...]

Needs a folder that is configured and built: its compile_commands.json, and the headers that the
build writes. Most of the time goes into headers that many sources share, so sources whose options
agree are checked together, as one translation unit that includes them. A name that two of them use
for different things is another one in the second, by a macro, and checks that leave out what macros
make do not see its declaration. Where a unit does not compile, the sources at fault are checked
apart, which takes longer and is reported. A unit without findings is not checked again until one of
its files, the checks or clang-tidy change. CUDA sources are checked as the C++ that tests without a
GPU compile. Left out: tests, the plugins that are faulty on purpose, and the generated program of
the layout.

Exit status: 0 no findings, 1 findings, 77 without clang-tidy 14.
"""
import argparse
import concurrent.futures
import copy
import functools
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
# Those that mean nothing to a source that does without: folders of headers, and macros that stand
# for a value.
PATH = re.compile(r"-I|-isystem ")
VALUE = re.compile(r"-D(\w+)=")
# A check searches the whole unit for each of a hundred functions of these headers, so sources that
# include them have a unit of their own.
SLOW_HEADERS = re.compile(r"^#include <CLI/", re.MULTILINE)
OWN_HEADER = re.compile(r'^#include "(\S+)"', re.MULTILINE)
SYSTEM_HEADER = re.compile(r"^#include <\S+>", re.MULTILINE)
CONDITION = re.compile(r"^#\s*(?:if|ifdef|ifndef)\b.*?^#\s*endif\b", re.MULTILINE | re.DOTALL)
# Names of members, of what is in namespaces, and of macros: another name would not be theirs.
OTHERS_NAME = re.compile(r"(?:\.|->|::)\s*(\w+)|^#define (\w+)", re.MULTILINE)
# What a file declares outside of classes and functions: those lines are not indented.
BEFORE_DECLARATION = re.compile(r"^template <.*>[ \n]|__launch_bounds__\(.*?\)", re.MULTILINE)
DECLARATIONS = [
    re.compile(pattern, re.MULTILINE)
    for pattern in (
        r"^(?:class|struct|union|enum(?: class)?) (?:alignas\(\w+\) )?(\w+)[^;{(]*\{",
        r"^#define (?!HWY_)(\w+)",
        r"^(?!(?:namespace|using|class|struct|union|enum)\b|HWY_)(?:extern \"C\" |\[\[\w+\]\] )?\w"
        r"[^;{=(]*?(?<!::)\b(\w+)(?:<[^>]*>)?\s*[\[{=(;]",
    )
]
CONSTANTS = re.compile(r"^(?:inline |static )*const(?:expr)? [^;{]*;", re.MULTILINE)
ONE_CONSTANT = re.compile(r"[ ,](\w+)(?:\[\w*\])* =")
ENUMERATORS = re.compile(r"^enum \w+[^;{(]*\{([^}]*)\}", re.MULTILINE)
ONE_ENUMERATOR = re.compile(r"(?:^|,)\s*(\w+)", re.MULTILINE)
ALIAS = re.compile(r"^using (?:(\w+) = [^;]+|[\w:]+::(\w+));", re.MULTILINE)
# Names of a namespace that is opened stand beside those of another source's.
OPENED = re.compile(r"^using namespace (defrec::[\w:]+);", re.MULTILINE)
# Every fuzz target defines it, and none calls it.
FUZZ_ENTRY = "LLVMFuzzerTestOneInput"
MAX_UNIT_BYTES = 400_000
FINDING = re.compile(r"^(?=\S+:\d+:\d+: (?:warning|error):)", re.MULTILINE)
ERROR = re.compile(r"^(\S+?):\d+:\d+: error:", re.MULTILINE)
INCLUDED = re.compile(r"^\.+ (.*)$", re.MULTILINE)  # what option -H prints


class Options:
    """The options of a compiler's command line that say what a source means."""

    def __init__(self, command, language):
        self.paths = []
        self.values = {}
        self.others = ["-x", language]
        words = iter(shlex.split(command))
        for word in words:
            if word in ("-isystem", "-include"):
                word += " " + next(words)
            elif not MEANING.match(word):
                continue
            if PATH.match(word):
                self.paths.append(word)
            elif VALUE.match(word):
                self.values[VALUE.match(word)[1]] = word
            else:
                self.others.append(word)
        if "-DHWY_SHARED_DEFINE" in self.others:
            self.others.append("-DHWY_COMPILE_ONLY_STATIC")  # one instruction set stands for all

    def agree_with(self, other):
        return all(
            self.values[name] == other.values[name]
            for name in self.values.keys() & other.values.keys()
        )

    def merge(self, other):
        self.paths += [path for path in other.paths if path not in self.paths]
        self.values |= other.values

    def words(self):
        of_two = re.compile(r"(-isystem|-include) (.*)")
        return [
            word
            for option in (*self.others, *self.values.values(), *self.paths)
            for word in (of_two.match(option).groups() if of_two.match(option) else [option])
        ]


@functools.cache
def names_in(file):
    """What each name stands for that a file declares: the file, or the text of an alias."""
    text = BEFORE_DECLARATION.sub("", file.read_text())
    names = {name for pattern in DECLARATIONS for name in pattern.findall(text)}
    for constants in CONSTANTS.findall(text):
        names.update(ONE_CONSTANT.findall(constants))
    for enumerators in ENUMERATORS.findall(text):
        names.update(ONE_ENUMERATOR.findall(enumerators))
    return dict.fromkeys(names - {FUZZ_ENTRY}, file) | {
        alias[1] or alias[2]: alias[0] for alias in ALIAS.finditer(text)
    }


@functools.cache
def fixed_names_in(file):
    """Names that cannot be others in a file: of macros, of members that it uses, and all of a
    source that is included again and again."""
    text = file.read_text()
    if "foreach_target.h" in text:
        return names_in(file).keys()
    return {name for names in OTHERS_NAME.findall(text) for name in names}


def clashes(names, others):
    """Names that stand for two things."""
    return {name for name in names.keys() & others.keys() if names[name] != others[name]}


@functools.cache
def headers_in(file):
    """Headers of the project that a file includes."""
    paths = [ROOT / name for name in OWN_HEADER.findall(file.read_text())]
    return [path for path in paths if path.exists()]


class Source:
    def __init__(self, path, options):
        self.path = path
        self.options = options
        self.names = names_in(path)
        self.opened = set(OPENED.findall(path.read_text()))
        self.headers = set()
        self.add_headers(path)
        self.is_slow = any(SLOW_HEADERS.search(file.read_text()) for file in (path, *self.headers))

    def clashes(self, names, headers):
        """Its names that stand for something else among these or in those headers that it
        does not include."""
        return clashes(self.names, names).union(
            *(clashes(self.names, names_in(header)) for header in headers - self.headers)
        )

    def add_headers(self, file):
        for header in headers_in(file):
            if header not in self.headers:
                self.headers.add(header)
                self.add_headers(header)


class Unit:
    """Sources that are checked as one."""

    def __init__(self, sources):
        self.options = copy.deepcopy(sources[0].options)
        self.sources = []
        self.names = {}
        self.opened = set()
        self.headers = set()
        for source in sources:
            self.add(source)

    def add(self, source):
        self.options.merge(source.options)
        self.sources.append(source)
        self.names = source.names | self.names
        self.opened |= source.opened
        self.headers |= source.headers

    def takes(self, source):
        """Whether no name would stand twice, in two sources or in a source and a header that it
        does not include, but for those that can be others."""

        def can_be_others(one, names):
            return not names & fixed_names_in(one.path)

        return (
            self.size() + source.path.stat().st_size <= MAX_UNIT_BYTES
            and self.options.agree_with(source.options)
            and len(self.opened | source.opened) <= 1
            and can_be_others(source, source.clashes(self.names, self.headers))
            and all(
                can_be_others(other, other.clashes({}, source.headers)) for other in self.sources
            )
        )

    def size(self):
        return sum(source.path.stat().st_size for source in self.sources)

    def paths(self):
        return [source.path for source in self.sources]

    def text(self):
        """The file that includes the sources. A name that stands for something else in another
        file is another one while its source is read, and so headers come first."""
        included, seen = {}, {}
        for source in self.sources:
            text = CONDITION.sub("", source.path.read_text())
            included |= dict.fromkeys(SYSTEM_HEADER.findall(text))
            included |= dict.fromkeys(f'#include "{header}"' for header in headers_in(source.path))
        lines = list(included)
        for number, source in enumerate(self.sources):
            renamed = source.clashes(seen, self.headers)
            seen = source.names | seen
            if FUZZ_ENTRY in source.path.read_text():
                renamed.add(FUZZ_ENTRY)
            lines += [f"#define {name} {name}_of_{number}" for name in sorted(renamed)]
            lines.append(f'#include "{source.path}"')
            lines += [f"#undef {name}" for name in sorted(renamed)]
        return "".join(line + "\n" for line in lines)


def sources_of(build):
    """Each source of the project that the build compiles."""
    sources = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        path = Path(entry["directory"], entry["file"]).resolve()
        if ROOT not in path.parents or build in path.parents or path in sources:
            continue
        # nvcc's C++ is not clang's.
        if LEFT_OUT.search(str(path.relative_to(ROOT))) or "nvcc" in entry["command"].split()[0]:
            continue
        sources[path] = Source(path, Options(entry["command"], LANGUAGES[path.suffix]))
    return list(sources.values())


def units_of(sources):
    """Units of sources whose options and names agree."""
    units = {}
    # Sources that look for headers in the same folders stand together.
    for source in sorted(sources, key=lambda source: (source.options.paths, source.path)):
        # A plugin's list of makers does not compile where they are overloaded.
        is_plugin = source.path.is_relative_to(ROOT / "plugins")
        alike = units.setdefault((source.is_slow, is_plugin, *source.options.others), [])
        unit = next((unit for unit in alike if unit.takes(source)), None)
        if unit is None:
            alike.append(Unit([source]))
        else:
            unit.add(source)
    return [unit for alike in units.values() for unit in alike]


def parts_of(unit, output):
    """Two units in place of one that does not compile: the sources in which clang-tidy says that
    errors are, and the others; or halves, where errors are in headers alone."""
    failed = {Path(path).resolve() for path in ERROR.findall(output)} & set(unit.paths())
    if not failed or len(failed) == len(unit.sources):
        failed = set(unit.paths()[: len(unit.sources) // 2])
    return [
        Unit([source for source in unit.sources if (source.path in failed) == is_failed])
        for is_failed in (False, True)
    ]


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
        arguments = unit.options.words()
        name = hashlib.sha256("\0".join([unit.text(), *arguments]).encode()).hexdigest()[:16]
        record = self.folder / f"{name}.json"
        if record.exists():
            clean = json.loads(record.read_text())
            if all(Path(file).exists() for file in clean["files"]) and clean[
                "fingerprint"
            ] == self.fingerprint(arguments, clean["files"]):
                return ""
        file = unit.sources[0].path
        if len(unit.sources) > 1:
            file = self.folder / f"{name}{file.suffix}"
            file.write_text(unit.text())
        run = subprocess.run(
            [
                self.clang_tidy,
                "--quiet",
                f"--config-file={CHECKS}",
                str(file),
                "--",
                *arguments,
                "-H",
            ],
            capture_output=True,
            text=True,
            cwd=ROOT,
            check=False,
        )
        if "clang-diagnostic-error" in run.stdout and len(unit.sources) > 1:
            print(f"checked apart: {file}, {len(unit.sources)} sources", flush=True)
            return "".join(self.check(part) for part in parts_of(unit, run.stdout))
        if run.stdout.strip() or run.returncode != 0:
            return run.stdout or run.stderr
        files = sorted(
            {str(path) for path in unit.paths()}
            | {
                path
                for path in INCLUDED.findall(run.stderr)
                if path.startswith(f"{ROOT}/") and path != str(file)
            }
        )
        record.write_text(
            json.dumps({"fingerprint": self.fingerprint(arguments, files), "files": files})
        )
        return ""


def find_clang_tidy():
    for name in ("clang-tidy-14", "clang-tidy"):
        path = shutil.which(name)
        if (
            path
            and b"version 14."
            in subprocess.run([path, "--version"], capture_output=True, check=False).stdout
        ):
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
        sources = [source for source in sources if wanted & {source.path, *source.path.parents}]
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

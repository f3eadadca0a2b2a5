#!/usr/bin/env python3
"""Compiles every C block of the guides and of the README against the headers. Whole programs are
linked too, and run where a block `output` follows, which they must print. A fragment is put into a
function, or, if it defines some, into a file; example_names.h declares what it uses without
declaring it. Fragments of embedding.md use the handles of the program before them instead. Whole
programs in C# are compiled as well, and blocks in Python as far as Python compiles. Blocks in CMake
must ask for this version. The names in the table of names.md must exist in the header, in the C#
assembly's comments and in the Python package.

usage: check_examples.py ROOT COMPILER LIBRARY_FOLDER MCS DEFREC_DLL WORK_FOLDER
"""
import json
import pathlib
import re
import subprocess
import sys

FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.M | re.S)
INCLUDE = re.compile(r"^#include .*$", re.M)


def examples(path):
    """(language, line of the first line, code, expected output or None) of each block of code."""
    text = path.read_text()
    blocks = list(FENCE.finditer(text))
    for i, block in enumerate(blocks):
        follower = blocks[i + 1] if i + 1 < len(blocks) else None
        output = follower[2] if follower and follower[1] == "output" else None
        yield block[1], text.count("\n", 0, block.start(2)) + 1, block[2], output


# A page whose first program sets up what its fragments use, in order.
CONTINUED = pathlib.Path("docs/api/embedding.md")


def source_of(name, line, code, program=None):
    located = f'#line {line} "{name}"\n'
    if "int main(" in code:
        return located + code
    prelude = "\n".join(INCLUDE.findall(code)) + '\n#include "example_names.h"\n'
    if program:
        prelude = f"{program}\n#define EXAMPLE_AFTER_PROGRAM\n{prelude}"
    body = INCLUDE.sub("", code)
    if not re.search(r"^static ", code, re.M):
        return f"{prelude}void fragment(void);\nvoid fragment(void) {{\n{located}{body}}}\n"
    return prelude + located + body


class Examples:
    def __init__(self, root, compiler, library, mcs, assembly, work):
        self.root, self.work, self.compiler, self.library = (
            pathlib.Path(root),
            pathlib.Path(work),
            compiler,
            library,
        )
        self.mcs = [mcs, "-nologo", "-langversion:7", "-warnaserror", f"-reference:{assembly}"]
        self.flags = [
            "-std=c11",
            "-Wall",
            "-Wextra",
            "-Werror",
            f"-I{root}/include",
            f"-I{root}/docs/site",
        ]
        self.counts = {
            "fragments": 0,
            "programs": 0,
            "outputs": 0,
            "programs in C#": 0,
            "blocks in Python": 0,
            "packages in CMake": 0,
        }
        self.version = re.search(
            r"^project\(defrec VERSION (\d+\.\d+)", (self.root / "CMakeLists.txt").read_text(), re.M
        )[1]
        self.program = None  # of the page CONTINUED
        self.work.mkdir(parents=True, exist_ok=True)

    def check(self, name, language, line, code, output):
        base = self.work / f"{'_'.join(name.with_suffix('').parts)}_{line}"
        if language == "c":
            self.check_c(name, line, code, output, base)
        elif language == "csharp" and " Main(" in code:
            base.with_suffix(".cs").write_text(f'#line {line} "{name}"\n{code}')
            subprocess.run([*self.mcs, f"-out:{base}.exe", base.with_suffix(".cs")], check=True)
            self.counts["programs in C#"] += 1
        elif language == "python":
            compile("\n" * (line - 1) + code, str(name), "exec")
            self.counts["blocks in Python"] += 1
        elif language == "cmake":
            for asked in re.findall(r"find_package\(defrec ([\d.]+)", code):
                if asked != self.version:
                    sys.exit(f"{name}:{line}: asks for defrec {asked}; this is {self.version}")
                self.counts["packages in CMake"] += 1

    def check_c(self, name, line, code, output, base):
        source = base.with_suffix(".c")
        source.write_text(source_of(name, line, code, self.program if name == CONTINUED else None))
        if name == CONTINUED and "int main(" in code:
            self.program = source.read_text()
        if "int main(" not in code:
            subprocess.run(
                [self.compiler, *self.flags, "-Wno-unused", "-fsyntax-only", source], check=True
            )
            self.counts["fragments"] += 1
            return
        subprocess.run(
            [
                self.compiler,
                *self.flags,
                "-pedantic",
                source,
                "-o",
                base,
                f"-L{self.library}",
                "-ldefrec",
                "-lm",
                f"-Wl,-rpath,{self.library}",
            ],
            check=True,
        )
        self.counts["programs"] += 1
        if output is not None:
            printed = subprocess.run([base], check=True, capture_output=True, text=True).stdout
            if printed != output:
                sys.exit(f"{name}:{line}: prints\n{printed}instead of\n{output}")
            self.counts["outputs"] += 1


def check_names(root, library, assembly):
    """Checks the names in the columns C, C# and Python of names.md; returns their number."""
    contract = json.loads((root / "sdk" / "contract" / "contract.json").read_text())
    kinds = ("handles", "callbacks", "structs", "functions")
    header = {"defrec_status"} | {each["name"] for kind in kinds for each in contract[kind]}
    comments = re.findall(
        r'name="\w:Defrec\.([\w.]+)', pathlib.Path(assembly).with_suffix(".xml").read_text()
    )
    columns = ["C", "C#", "Python"]
    known = {"C": header.__contains__, "C#": set(comments).__contains__}
    names = {column: set() for column in columns}
    rows = re.findall(
        r"^\|(?!--).*\|$", (root / "docs" / "languages" / "names.md").read_text(), re.M
    )[1:]
    for row in rows:
        for column, cell in zip(columns, row.split("|")[2:5]):
            names[column].update(re.findall(r"`([A-Z]\w+(?:\.\w+)?|defrec_\w+|library_\w+)`", cell))
    for column, is_known in known.items():
        if unknown := sorted(name for name in names[column] if not is_known(name)):
            sys.exit(f"names.md: no {column}: {unknown}")
    program = "import defrec\nfor name in {!r}:\n    eval('defrec.' + name)".format(
        sorted(names["Python"])
    )
    subprocess.run(
        [sys.executable, "-B", "-c", program],
        check=True,
        env={"LD_LIBRARY_PATH": library, "PYTHONPATH": str(root / "bindings" / "python")},
    )
    return sum(map(len, names.values()))


def main():
    found = Examples(*sys.argv[1:])
    for path in [found.root / "README.md", *sorted((found.root / "docs").rglob("*.md"))]:
        for language, line, code, output in examples(path):
            found.check(path.relative_to(found.root), language, line, code, output)
    found.counts["names"] = check_names(found.root, found.library, sys.argv[5])
    print(", ".join(f"{count} {what}" for what, count in found.counts.items()))
    if 0 in found.counts.values():
        sys.exit("nothing was checked of one kind")


main()

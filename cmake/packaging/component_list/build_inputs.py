"""Files that the build of a binary read from outside the source tree, by ninja and the linker:
headers from the depfiles of its objects, and every file that the linker opened.

Ninja's commands say what an archive is made of and how the binary is linked. The link is repeated
with the linker's --trace, because only the linker knows which file -lNAME was, and which archives
the compiler adds itself.
"""
import functools
import os
import pathlib
import re
import shlex
import subprocess
import tempfile

# A folder that a package manager fills with more than one component says nothing of a file.
SHARED_ROOTS = {"/", "/usr", "/usr/local", "/opt"}


class Build:
    def __init__(self, folder, source):
        self.folder = pathlib.Path(folder).resolve()
        self.source = pathlib.Path(source).resolve()
        self.headers = self._headers()
        self._commands = {}

    def ninja(self, *arguments):
        command = ["ninja", "-C", str(self.folder), *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    def _headers(self):
        """{object: what its depfile names}"""
        headers, current = {}, None
        for line in self.ninja("-t", "deps").splitlines():
            if line.startswith("    "):
                headers[current].append(line.strip())
            elif ": #deps" in line:
                current = line.partition(": #deps")[0]
                headers[current] = []
        return headers

    def commands(self, binary):
        """{file: [programs' arguments]} of what has to be made for the binary."""
        if binary in self._commands:
            return self._commands[binary]
        made = {}
        for line in self.ninja("-t", "commands", binary).splitlines():
            for part in line.split(" && "):
                words = shlex.split(part)
                output = output_of(words)
                if output is not None:
                    made[output] = words
        self._commands[binary] = made
        return made

    def objects(self, binary):
        """Objects that its link names, by themselves or in our archives."""
        commands = self.commands(binary)
        seen, waiting = {binary}, [binary]
        while waiting:
            for word in commands.get(waiting.pop(), [])[1:]:
                if word.endswith((".o", ".a")) and word in commands and word not in seen:
                    seen.add(word)
                    waiting.append(word)  # an archive, or an object that is linked from others
        return {name for name in seen if name.endswith(".o")}

    def linked_files(self, binary):
        """Files that the linker opens, and of archives only those that it takes something from."""
        with tempfile.TemporaryDirectory() as scratch:
            words = list(self.commands(binary)[binary])
            words[words.index("-o") + 1] = f"{scratch}/linked"
            run = subprocess.run(
                [*words, "-Wl,--trace"], cwd=self.folder, capture_output=True, text=True, check=True
            )
        # ld names an archive alone, or as (archive)member or archive(member).
        return {
            re.sub(r"^\((.*)\).*$|^([^(]*)\(.*\)$", r"\1\2", line.strip())
            for line in run.stdout.splitlines()
            if line.strip()
        }

    def _foreign(self, path):
        """Its real path; None for a file of the source tree or one that the build makes."""
        real = pathlib.Path(os.path.realpath(self.folder / path))
        if real.is_relative_to(self.folder):
            # Others' sources that CMake fetches lie there.
            return real if "_deps" in real.relative_to(self.folder).parts else None
        return None if real.is_relative_to(self.source) else real

    def foreign_inputs(self, binary):
        """{real path: "read" or "linked"}"""
        read = {name for made in self.objects(binary) for name in self.headers.get(made, [])}
        inputs = {self._foreign(name): "read" for name in read}
        inputs.update({self._foreign(name): "linked" for name in self.linked_files(binary)})
        inputs.pop(None, None)
        return {str(path): how for path, how in inputs.items()}

    def tools(self, binary):
        """Real paths of the programs that the commands call, without CMake and ccache."""
        tools = set()
        for words in self.commands(binary).values():
            program = next((word for word in words if not word.endswith("/ccache")), None)
            if program and os.path.isabs(program):
                tools.add(os.path.realpath(program))
        return tools


def output_of(words):
    """The output of a compiler, linker or archiver; None for other commands."""
    if "-o" in words[:-1]:
        return words[words.index("-o") + 1]
    if len(words) > 3 and os.path.basename(words[0]).endswith("ar") and words[1].startswith("q"):
        return words[2]
    return None


@functools.lru_cache(maxsize=1)
def installed_files():
    """{path: (package, source package, version, architecture)} of all that dpkg installed."""
    fields = r"=${binary:Package}\t${source:Package}\t${Version}\t${Architecture}\n"
    command = ["dpkg-query", "-W", "-f", fields + r"${db-fsys:Files}\n"]
    owners, package = {}, None
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    for line in run.stdout.splitlines():
        if line.startswith("="):
            package = tuple(line[1:].split("\t"))
        elif line.startswith(" /"):
            owners[line[1:]] = package
    return owners


def packages_of(paths):
    """Likewise, of these paths; those without a package are left out."""
    installed = installed_files()
    # Files of /lib are known by that name although /lib is a link to /usr/lib.
    found = {path: installed.get(path, installed.get(path.removeprefix("/usr"))) for path in paths}
    return {path: package for path, package in found.items() if package is not None}


def root_of(path):
    """The folder that a component without a package was unpacked into; None if there is none."""
    real = pathlib.Path(os.path.realpath(path))
    for parent in real.parents:
        if parent.name in ("include", "lib", "lib64", "bin", "share", "targets"):
            root = next(p for p in parent.parents if p.name not in ("targets", "x86_64-linux"))
            return None if str(root) in SHARED_ROOTS else root
    return None

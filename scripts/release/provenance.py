#!/usr/bin/env python3
"""Provenance of a build: an in-toto Statement v1 with a SLSA Provenance v1 predicate, which says
from which sources, by which options, with which packages and by whom library, plugins and artefacts
were built. It has no times, so that the same build gives the same bytes.

provenance.py write BUILD STATEMENT --builder URI [--checkout FOLDER] [--artefacts FILE...]
    BUILD: a build by CMake and Ninja whose sources are those of the checkout's HEAD, nothing else;
    URI: who builds, and where. Refused are other sources, and a file that a Debian package
    installed and somebody changed since.
provenance.py check STATEMENT [--build BUILD] [--folder FOLDER] [--commit COMMIT]
    [--signers FILE] [--revoked FILE]
    Refused are library and plugins of BUILD, or artefacts in FOLDER, that are not the statement's,
    one that the statement does not have, another commit, and an envelope whose signature does not
    hold. STATEMENT: as it was written, with one of the first three options at least, or in the
    envelope that sign.py puts it into.
"""
import argparse
import collections
import hashlib
import json
import os
import pathlib
import platform
import re
import subprocess
import sys
import tempfile
import urllib.parse

import envelope
import sums

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "cmake" / "packaging" / "component_list"))
import build_inputs  # pylint: disable=wrong-import-position

STATEMENT_TYPE = "https://in-toto.io/Statement/v1"
PREDICATE_TYPE = "https://slsa.dev/provenance/v1"
# docs/deployment/provenance.md, which comes with the sources, describes it by this name.
BUILD_TYPE = "urn:uuid:1414eacc-8de7-5645-be69-fa8db7d84333"
LIBRARIES = re.compile(r"libdefrec\.so\.[0-9.]+|defrec_plugin_\w+\.(so|json)")
# Options of this project, and of CMake what changes code; paths are found on each machine.
OPTIONS = re.compile(
    r"^(DEFREC_\w+|CMAKE_BUILD_TYPE|CMAKE_(?:C|CXX|CUDA|SHARED_LINKER|MODULE_LINKER|EXE_LINKER)"
    r"_FLAGS(?:_RELEASE)?|CMAKE_TOOLCHAIN_FILE):(?:BOOL|STRING|UNINITIALIZED)=(.+)$",
    re.MULTILINE,
)
# Programs that a compiler calls; asked by -print-prog-name.
CALLED = ("cc1", "cc1plus", "collect2", "as", "ld")
CALLED_BY_NVCC = ("cudafe++", "ptxas", "fatbinary", "nvlink", "../nvvm/bin/cicc")


def output(*command, **options):
    return subprocess.run(
        command, check=True, stdout=subprocess.PIPE, text=True, **options
    ).stdout.strip()


def tree_of(source, checkout):
    """git's hash of the files in the folder `source` that the checkout does not ignore."""
    objects = output("git", "-C", str(checkout), "rev-parse", "--git-path", "objects")
    git_dir = output("git", "-C", str(checkout), "rev-parse", "--absolute-git-dir")
    with tempfile.TemporaryDirectory() as scratch:
        environment = {
            **os.environ,
            "GIT_DIR": git_dir,
            "GIT_WORK_TREE": str(source),
            "GIT_INDEX_FILE": f"{scratch}/index",
            "GIT_OBJECT_DIRECTORY": f"{scratch}/objects",
            "GIT_ALTERNATE_OBJECT_DIRECTORIES": str(pathlib.Path(checkout, objects).resolve()),
        }
        os.mkdir(f"{scratch}/objects")
        output("git", "add", "-A", ".", cwd=source, env=environment)
        return output("git", "write-tree", cwd=source, env=environment)


def source_of(source, checkout):
    """The sources as a dependency."""
    commit = output("git", "-C", str(checkout), "rev-parse", "HEAD")
    expected = output("git", "-C", str(checkout), "rev-parse", "HEAD^{tree}")
    tree = tree_of(source, checkout)
    if tree != expected:
        raise sums.Refused(f"{source} is tree {tree}, not {expected} of commit {commit}")
    return {"name": "source", "digest": {"gitCommit": commit, "gitTree": tree}}


def cache_of(build):
    return (pathlib.Path(build) / "CMakeCache.txt").read_text()


def entry(cache, name):
    match = re.search(rf"^{name}:\w+=(.*)$", cache, re.MULTILINE)
    return match[1] if match else ""


def options_of(cache):
    return {name: value for name, value in sorted(OPTIONS.findall(cache))}


def libraries_of(build):
    folder = pathlib.Path(build) / "lib"
    found = [path for path in folder.iterdir() if LIBRARIES.fullmatch(path.name)]
    return sorted(path for path in found if path.is_file() and not path.is_symlink())


def called_by(tool):
    """Programs that a compiler calls, as far as they are files of their own."""
    name = pathlib.Path(tool).name
    if name == "nvcc":
        found = [pathlib.Path(tool).parent / called for called in CALLED_BY_NVCC]
        return {os.path.realpath(path) for path in found if path.is_file()}
    if not re.search(r"(gcc|g\+\+|clang)(-\d+)?$", name):
        return set()
    found = {output(tool, f"-print-prog-name={called}") for called in CALLED}
    which = {path if os.path.isabs(path) else output("which", path) for path in found if path}
    return {os.path.realpath(path) for path in which if os.path.isfile(path)}


def inputs_of(build, cache, libraries):
    """Real paths of what they were built from: headers, what was linked, and programs."""
    tree = build_inputs.Build(build, entry(cache, "CMAKE_HOME_DIRECTORY"))
    tools = {entry(cache, name) for name in ("CMAKE_COMMAND", "CMAKE_MAKE_PROGRAM")}
    tools.add(entry(cache, "DEFREC_SYSTEM_PYTHON"))
    inputs = set()
    for library in libraries:
        name = str(library.resolve().relative_to(tree.folder))
        if library.suffix != ".json":
            inputs |= set(tree.foreign_inputs(name))
            tools |= tree.tools(name)
    tools = {os.path.realpath(tool) for tool in tools if os.path.isfile(tool)}
    return inputs | tools | set().union(*map(called_by, tools))


def dir_hash(paths):
    """in-toto's dirHash of these files, as if they lay below /."""
    lines = "".join(
        f"{sums.sha256(path)}  {name}\n" for name, path in sorted((p[1:], p) for p in paths)
    )
    return hashlib.sha256(lines.encode()).hexdigest()


def check_installed(paths, package):
    """Refused are files that are not as the package installed them."""
    command = ["dpkg-query", "--control-show", package, "md5sums"]
    listed = subprocess.run(command, capture_output=True, text=True, check=False).stdout
    expected = {line[34:]: line[:32] for line in listed.splitlines()}
    for path in paths:
        # Files of /lib are known by that name although /lib is a link to /usr/lib.
        known = expected.get(path[1:], expected.get(path.removeprefix("/usr/")))
        md5 = hashlib.md5(pathlib.Path(path).read_bytes(), usedforsecurity=False).hexdigest()
        if known not in (None, md5):
            raise sums.Refused(f"{path} is not as {package} installed it")


def package_url(package, version, architecture):
    release = platform.freedesktop_os_release()
    name, vendor = package.partition(":")[0], release["ID"]
    distro = f"{vendor}-{release['VERSION_ID']}" if "VERSION_ID" in release else vendor
    return (
        f"pkg:deb/{vendor}/{urllib.parse.quote(name)}@{urllib.parse.quote(version, safe='~')}"
        f"?arch={architecture}&distro={distro}"
    )


def dependencies_of(inputs):
    """A package, or a folder that none installed, with the files of it that were used."""
    owners = build_inputs.packages_of(inputs)
    groups = collections.defaultdict(list)
    for path in inputs:
        groups[owners.get(path) or (str(build_inputs.root_of(path) or path),)].append(path)
    for key, paths in sorted(groups.items()):
        used = {"digest": {"dirHash": dir_hash(paths)}, "annotations": {"files": len(paths)}}
        if len(key) == 1:
            yield {"name": key[0].strip("/"), **used}
            continue
        package, _, version, architecture = key
        check_installed(paths, package)
        yield {"uri": package_url(package, version, architecture), **used}


def subjects_of(libraries, artefacts):
    names = {f"lib/{path.name}": path for path in libraries}
    names.update({path.name: path for path in map(pathlib.Path, artefacts)})
    return [{"name": n, "digest": {"sha256": sums.sha256(p)}} for n, p in sorted(names.items())]


def statement_of(build, source, builder, artefacts=()):
    cache, libraries = cache_of(build), libraries_of(build)
    if not libraries:
        raise sums.Refused(f"{build} has no library and no plugin")
    return {
        "_type": STATEMENT_TYPE,
        "subject": subjects_of(libraries, artefacts),
        "predicateType": PREDICATE_TYPE,
        "predicate": {
            "buildDefinition": {
                "buildType": BUILD_TYPE,
                "externalParameters": {
                    "commit": source["digest"]["gitCommit"],
                    "options": options_of(cache),
                },
                "internalParameters": {"machine": platform.machine()},
                "resolvedDependencies": [
                    source,
                    *dependencies_of(inputs_of(build, cache, libraries)),
                ],
            },
            "runDetails": {"builder": {"id": builder}},
        },
    }


def text_of(statement):
    return json.dumps(statement, indent=1, sort_keys=True) + "\n"


def bytes_of(path):
    """Bytes of a statement, with or without envelope; a signature is not looked at."""
    content = pathlib.Path(path).read_bytes()
    in_envelope = json.loads(content)
    return envelope.payload_of(in_envelope) if envelope.is_envelope(in_envelope) else content


def read(path):
    return json.loads(bytes_of(path))


def digests_of(statement):
    """{subject: SHA-256}"""
    types = isinstance(statement, dict) and (statement.get("_type"), statement.get("predicateType"))
    if types != (STATEMENT_TYPE, PREDICATE_TYPE):
        raise sums.Refused(f"no statement with a predicate {PREDICATE_TYPE}")
    if statement["predicate"]["buildDefinition"]["buildType"] != BUILD_TYPE:
        raise sums.Refused(f"not of a build {BUILD_TYPE}")
    digests = {subject["name"]: subject["digest"]["sha256"] for subject in statement["subject"]}
    if not digests or len(digests) != len(statement["subject"]):
        raise sums.Refused("no subject, or one of them twice")
    return digests


def check_files(statement, files, is_expected):
    """files: {subject: path}. All of them are subjects, and all subjects that are expected are
    there."""
    digests = digests_of(statement)
    if unknown := sorted(set(files) - set(digests)):
        raise sums.Refused(f"not in the statement: {', '.join(unknown)}")
    if missing := sorted(set(filter(is_expected, digests)) - set(files)):
        raise sums.Refused(f"missing: {', '.join(missing)}")
    if other := [name for name, path in files.items() if sums.sha256(path) != digests[name]]:
        raise sums.Refused(f"other bytes: {', '.join(sorted(other))}")
    if not files:
        raise sums.Refused("there is nothing to check")


def is_library(subject):
    return subject.startswith("lib/")


def check_build(statement, build):
    files = {f"lib/{path.name}": path for path in libraries_of(build)}
    check_files(statement, files, is_library)


def check_folder(statement, folder):
    """Artefacts; others may lie beside them."""
    digests = digests_of(statement)
    there = [pathlib.Path(folder) / name for name in digests if not is_library(name)]
    files = {path.name: path for path in there if path.is_file()}
    check_files(statement, files, lambda subject: not is_library(subject))


def check_commit(statement, commit):
    definition = statement["predicate"]["buildDefinition"]
    source = definition["resolvedDependencies"][0]["digest"]
    if not definition["externalParameters"]["commit"] == source["gitCommit"] == commit:
        raise sums.Refused(f"built from {source['gitCommit']}, not from {commit}")


def write(given):
    source = source_of(entry(cache_of(given.build), "CMAKE_HOME_DIRECTORY"), given.checkout)
    statement = statement_of(given.build, source, given.builder, given.artefacts)
    pathlib.Path(given.statement).write_text(text_of(statement))
    dependencies = statement["predicate"]["buildDefinition"]["resolvedDependencies"]
    print(f"{len(statement['subject'])} subjects from {len(dependencies)} dependencies")


def check(given):
    path = pathlib.Path(given.statement)
    statement, said = json.loads(path.read_text()), "It is not signed."
    if envelope.is_envelope(statement):
        payload, said = envelope.check(path.name, statement, given.signers, given.revoked)
        statement = json.loads(payload)
    elif (given.build, given.folder, given.commit) == (None, None, None):
        raise sums.Refused("not signed; --build, --folder or --commit says what to compare it with")
    digests_of(statement)
    if given.build is not None:
        check_build(statement, given.build)
    if given.folder is not None:
        check_folder(statement, given.folder)
    if given.commit is not None:
        check_commit(statement, given.commit)
    print(f"{given.statement} holds. {said}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    commands = parser.add_subparsers(required=True)
    command = commands.add_parser("write")
    command.set_defaults(run=write)
    command.add_argument("build")
    command.add_argument("statement")
    command.add_argument("--builder", required=True)
    command.add_argument("--artefacts", nargs="+", default=[])
    command.add_argument("--checkout", default=ROOT)
    command = commands.add_parser("check")
    command.set_defaults(run=check)
    command.add_argument("statement")
    command.add_argument("--build")
    command.add_argument("--folder")
    command.add_argument("--commit")
    command.add_argument("--signers", default=sums.SIGNERS)
    command.add_argument("--revoked", default=sums.REVOKED)
    given = parser.parse_args()
    try:
        given.run(given)
    except (sums.Refused, OSError, KeyError, json.JSONDecodeError) as error:
        sys.exit(f"REFUSED: {error}")


if __name__ == "__main__":
    main()

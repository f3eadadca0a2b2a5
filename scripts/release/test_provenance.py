#!/usr/bin/env python3
"""Provenance of the build that is given, which is library and plugins of a test's build: it is well
formed, the same twice, and every way to spoil it or what it is about is refused.

test_provenance.py BUILD
"""
import copy
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

import jsonschema
import provenance
import sign
import sums

BUILDER = "https://example.org/builders/test"
SOURCE = {"name": "source", "digest": {"gitCommit": "0" * 40, "gitTree": "1" * 40}}


class Provenance(unittest.TestCase):
    build = None

    @classmethod
    def setUpClass(cls):
        cls.good = provenance.statement_of(cls.build, SOURCE, BUILDER)

    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.work = pathlib.Path(scratch.name)
        self.lib = self.work / "lib"
        self.lib.mkdir()
        for path in provenance.libraries_of(self.build):
            shutil.copy(path, self.lib)
        self.statement = copy.deepcopy(self.good)

    def refused(self, why):
        return self.assertRaisesRegex(sums.Refused, why)

    def check(self):
        provenance.check_build(self.statement, self.work)

    def test_form(self):
        schema = pathlib.Path(__file__).with_name("provenance.schema.json")
        jsonschema.validate(self.statement, json.loads(schema.read_text()))

    def test_named_by_its_page(self):
        page = provenance.ROOT / "docs" / "deployment" / "provenance.md"
        script = provenance.ROOT / "scripts" / "check_reproducible.sh"
        named = {provenance.BUILD_TYPE, *re.findall(r"urn:uuid:[0-9a-f-]{36}", script.read_text())}
        self.assertEqual(len(named), 2)
        self.assertEqual(set(re.findall(r"urn:uuid:[0-9a-f-]{36}", page.read_text())), named)

    def test_twice_the_same(self):
        again = provenance.statement_of(self.build, SOURCE, BUILDER)
        self.assertEqual(provenance.text_of(again), provenance.text_of(self.good))
        self.assertNotIn(str(self.build), provenance.text_of(again))

    def test_dependencies(self):
        definition = self.good["predicate"]["buildDefinition"]
        found = {
            re.sub("^.*/|@.*$", "", entry.get("uri", "")): entry
            for entry in definition["resolvedDependencies"]
        }
        for name in ("libeigen3-dev", "libyaml-cpp-dev", "libc6-dev", "cmake", "ninja-build"):
            self.assertIn(name, found)
        self.assertIn("CMAKE_BUILD_TYPE", definition["externalParameters"]["options"])

    def test_subjects_are_the_files(self):
        self.check()
        names = {path.name for path in self.lib.iterdir()}
        self.assertEqual({f"lib/{name}" for name in names}, set(provenance.digests_of(self.good)))
        self.assertIn("defrec_plugin_reference.so", names)

    def test_other_bytes(self):
        for path in self.lib.iterdir():
            good = path.read_bytes()
            path.write_bytes(good[:-1] + bytes([good[-1] ^ 1]))
            with self.refused(f"other bytes: lib/{path.name}"):
                self.check()
            path.write_bytes(good)
        self.check()

    def test_missing_and_unknown(self):
        (self.lib / "defrec_plugin_reference.json").rename(self.lib / "defrec_plugin_x.json")
        with self.refused("not in the statement: lib/defrec_plugin_x.json"):
            self.check()
        (self.lib / "defrec_plugin_x.json").unlink()
        with self.refused("missing: lib/defrec_plugin_reference.json"):
            self.check()

    def test_changed_statement(self):
        self.statement["subject"][0]["digest"]["sha256"] = "0" * 64
        with self.refused("other bytes"):
            self.check()
        del self.statement["subject"][0]
        with self.refused("not in the statement"):
            self.check()
        self.statement["subject"].append(self.statement["subject"][0])
        with self.refused("twice"):
            self.check()
        self.statement["subject"] = []
        with self.refused("no subject"):
            self.check()

    def test_another_type(self):
        for change in (
            lambda statement: statement.update(predicateType="https://slsa.dev/provenance/v0.2"),
            lambda statement: statement.update(_type="https://in-toto.io/Statement/v0.1"),
            lambda statement: statement["predicate"]["buildDefinition"].update(buildType="a:b"),
        ):
            self.statement = copy.deepcopy(self.good)
            change(self.statement)
            with self.refused("no statement|not of a build"):
                self.check()

    def test_commit(self):
        provenance.check_commit(self.statement, "0" * 40)
        with self.refused("built from 0{40}, not from 2"):
            provenance.check_commit(self.statement, "2" * 40)
        self.statement["predicate"]["buildDefinition"]["externalParameters"]["commit"] = "2" * 40
        with self.refused("not from 2"):
            provenance.check_commit(self.statement, "2" * 40)

    def test_artefacts(self):
        wheel = self.work / "defrec-0.1.0-py3-none-any.whl"
        wheel.write_bytes(b"wheel")
        self.statement["subject"] = provenance.subjects_of([], [wheel])
        (self.work / "bom.json").write_text("{}")  # of no build
        provenance.check_folder(self.statement, self.work)
        (self.work / "provenance.intoto.json").write_text(provenance.text_of(self.statement))
        sign.check_provenance(self.work, ["bom.json", wheel.name, "provenance.intoto.json"])
        wheel.write_bytes(b"spoiled")
        with self.refused("other bytes"):
            provenance.check_folder(self.statement, self.work)
        with self.refused("other bytes"):
            sign.check_provenance(self.work, [wheel.name, "provenance.intoto.json"])
        wheel.rename(self.work / "another.whl")
        with self.refused("missing"):
            provenance.check_folder(self.statement, self.work)

    def run_program(self, *arguments):
        """Exit status of the program, for which every folder is the sources of the commit."""
        with unittest.mock.patch.object(sys, "argv", ["provenance.py", *map(str, arguments)]):
            with unittest.mock.patch.object(provenance, "source_of", return_value=SOURCE):
                try:
                    provenance.main()
                except SystemExit as end:
                    return end.code
        return 0

    def test_program(self):
        wheel, statement = self.work / "defrec-0.1.0-py3-none-any.whl", self.work / "statement"
        wheel.write_bytes(b"wheel")
        write = ("write", self.build, statement, "--builder", BUILDER, "--artefacts", wheel)
        self.assertEqual(self.run_program(*write), 0)
        check = ("check", statement, "--build", self.build, "--folder", self.work, "--commit")
        self.assertEqual(self.run_program(*check, "0" * 40), 0)
        self.assertRegex(self.run_program(*check, "1" * 40), "^REFUSED: built from 0")
        self.assertRegex(self.run_program(*check, ""), "^REFUSED: built from 0")
        self.assertRegex(self.run_program("check", statement), "^REFUSED: not signed; --build")
        wheel.write_bytes(b"another")
        self.assertRegex(self.run_program(*check, "0" * 40), "^REFUSED: other bytes")

    def test_program_reads_the_statement_whatever_it_compares(self):
        statement, commit = self.work / "statement", "0" * 40
        check = ("check", statement, "--commit", commit)
        statement.write_text(provenance.text_of(self.statement))
        self.assertEqual(self.run_program(*check), 0)
        for change, why in (
            ({"_type": "another"}, "no statement"),
            ({"predicateType": "another"}, "no statement"),
            ({"subject": []}, "no subject"),
        ):
            statement.write_text(provenance.text_of({**self.statement, **change}))
            self.assertRegex(self.run_program(*check), f"^REFUSED: {why}")
        for empty in ("{}", "[]"):
            statement.write_text(empty)
            self.assertRegex(self.run_program(*check), "^REFUSED: no statement")

    def test_artefact_without_provenance(self):
        wheel, package = (
            self.work / "defrec-0.1.0-py3-none-any.whl",
            self.work / "Defrec.0.1.0.nupkg",
        )
        for path in (wheel, package):
            path.write_bytes(b"artefact")
        self.statement["subject"] = provenance.subjects_of([], [wheel])
        (self.work / "provenance.intoto.json").write_text(provenance.text_of(self.statement))
        with self.refused("no provenance of Defrec.0.1.0.nupkg"):
            sign.check_provenance(self.work, [wheel.name, package.name, "provenance.intoto.json"])

    def test_changed_package(self):
        header = next(iter(pathlib.Path("/usr/include/yaml-cpp").glob("*.h")))
        provenance.check_installed([str(header)], "libyaml-cpp-dev")
        changed = self.work / header.name
        changed.write_bytes(header.read_bytes() + b"\n")
        sums_of_files = f"{'0' * 32}  {str(changed)[1:]}\n"
        with unittest.mock.patch.object(
            provenance.subprocess,
            "run",
            return_value=subprocess.CompletedProcess([], 0, stdout=sums_of_files),
        ), self.refused("is not as libyaml-cpp-dev installed it"):
            provenance.check_installed([str(changed)], "libyaml-cpp-dev")


class Sources(unittest.TestCase):
    """Only the files of the commit are its sources."""

    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.checkout = pathlib.Path(scratch.name) / "checkout"
        self.checkout.mkdir()
        (self.checkout / ".gitignore").write_text("/build*/\n")
        (self.checkout / "a.cpp").write_text("int a;\n")
        self.git("init", "-q")
        self.git("add", "-A")
        self.git("-c", "user.name=a", "-c", "user.email=a@example.org", "commit", "-qm", "a")

    def git(self, *arguments):
        return provenance.output("git", "-C", str(self.checkout), *arguments)

    def test_checkout(self):
        (self.checkout / "build").mkdir()
        (self.checkout / "build" / "made.o").write_bytes(b"made")
        source = provenance.source_of(self.checkout, self.checkout)
        self.assertEqual(source["digest"]["gitCommit"], self.git("rev-parse", "HEAD"))
        self.assertEqual(source["digest"]["gitTree"], self.git("rev-parse", "HEAD^{tree}"))

    def test_unpacked_elsewhere(self):
        with tempfile.TemporaryDirectory() as elsewhere:
            for name in (".gitignore", "a.cpp"):
                shutil.copy(self.checkout / name, elsewhere)
            provenance.source_of(elsewhere, self.checkout)
            (pathlib.Path(elsewhere) / "a.cpp").write_text("int b;\n")
            with self.assertRaisesRegex(sums.Refused, "is tree .*, not"):
                provenance.source_of(elsewhere, self.checkout)
        self.assertEqual(self.git("status", "--porcelain"), "")

    def test_changed_and_added(self):
        (self.checkout / "b.cpp").write_text("int b;\n")
        with self.assertRaisesRegex(sums.Refused, "is tree"):
            provenance.source_of(self.checkout, self.checkout)


if __name__ == "__main__":
    Provenance.build = pathlib.Path(sys.argv.pop()).resolve()
    unittest.main()

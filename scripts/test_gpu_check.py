#!/usr/bin/env python3
"""Tests of gpu_check/check.sh, with scripts in the place of the programs that it runs."""
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
CHECK = ROOT / "scripts" / "gpu_check"
LISTED = """case "$*" in
    *--list-test-cases*) echo '<TestCase name="a" filename="/src/backends/cuda/orb_test.cpp"/>' ;;
    *) echo "$*" ;;
esac
"""


class TestsPart(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        for name in ("check.sh", "stages.txt"):
            shutil.copy(CHECK / name, self.folder)
        (self.folder / "backends.txt").write_text("cuda\n")
        self.program("bin/defrec-bench", "echo vulkan: none; echo cuda:0: a card")

    def program(self, name, commands):
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(f"#!/bin/sh\n{commands}\n")
        path.chmod(0o755)

    def run_check(self):
        """Exit status of the part `tests`, and what the summary says of it."""
        out = self.folder / "out"
        command = [self.folder / "check.sh", "tests", "--out", out]
        status = subprocess.run(command, capture_output=True, check=False).returncode
        return status, (out / "summary.txt").read_text()

    def test_sources_are_run_one_by_one(self):
        self.program("tests/defrec_cuda_tests", LISTED)
        status, summary = self.run_check()
        self.assertEqual(status, 0)
        self.assertRegex(summary, r"^passed +\d+ s  tests/cuda/orb\n$")

    def test_every_program_that_is_packed_is_run(self):
        programs = []
        for built in ROOT.glob("plugins/*/CMakeLists.txt"):
            if packed := re.search(r"GPU_TESTS ([\w\s]*)\)", built.read_text()):
                programs += packed[1].split()
        self.assertIn("defrec_cuda_tests", programs)
        (self.folder / "backends.txt").write_text("cuda\nvulkan\n")
        for program in programs:
            self.program(f"tests/{program}", LISTED.replace("orb", program))
        status, summary = self.run_check()
        self.assertEqual(status, 0)
        for program in programs:
            self.assertRegex(summary, rf"passed +\d+ s  tests/\w+/{program}\n")

    def test_a_program_that_lists_nothing_has_failed(self):
        for commands in ("exit 127", "kill -SEGV $$", "true", f"{LISTED}\nexit 1"):
            self.program("tests/defrec_cuda_tests", LISTED)
            self.program("tests/defrec_cuda_fault_tests", commands)
            status, summary = self.run_check()
            self.assertEqual(status, 1, commands)
            self.assertIn("tests/cuda: defrec_cuda_fault_tests does not list its tests", summary)
            self.assertIn("tests/cuda/orb", summary)

    def test_a_backend_without_its_program_has_failed(self):
        status, summary = self.run_check()
        self.assertEqual(status, 1)
        self.assertRegex(summary, "^FAILED .* defrec_cuda_tests does not list its tests")


if __name__ == "__main__":
    unittest.main()

"""Which libdefrec is loaded, and what import says where there is none that fits. Each case in a
process of its own."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import defrec
from defrec import _library

PACKAGE = pathlib.Path(defrec.__file__).parent
MAPPED = [
    line.split(maxsplit=5)[-1] for line in pathlib.Path("/proc/self/maps").read_text().splitlines()
]
LIBRARY = next(path for path in MAPPED if path.endswith(_library.FILE_NAME))


class Loading(unittest.TestCase):
    def run_import(self, code, library_path="", folder="/"):
        environment = {
            name: value
            for name, value in os.environ.items()
            if name not in ("LD_LIBRARY_PATH", "PYTHONPATH")
        }
        environment.update(PYTHONPATH=str(self.package.parent), PYTHONDONTWRITEBYTECODE="1")
        if library_path:
            environment["LD_LIBRARY_PATH"] = str(library_path)
        return subprocess.run(
            [sys.executable, "-c", code],
            env=environment,
            cwd=folder,
            capture_output=True,
            text=True,
        )

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.package = self.folder / "site" / "defrec"
        shutil.copytree(PACKAGE, self.package, ignore=shutil.ignore_patterns("lib", "__pycache__"))

    def test_from_the_system(self):
        done = self.run_import(
            "import defrec; print(defrec._library.path)", library_path=os.path.dirname(LIBRARY)
        )
        self.assertEqual(
            (done.returncode, done.stdout), (0, _library.FILE_NAME + "\n"), done.stderr
        )

    def test_bundled_before_the_systems(self):
        (self.package / "lib").mkdir()
        shutil.copy(LIBRARY, self.package / "lib" / _library.FILE_NAME)
        done = self.run_import(
            "import defrec; print(defrec._library.path)", library_path=os.path.dirname(LIBRARY)
        )
        self.assertEqual(
            (done.returncode, done.stdout),
            (0, str(self.package / "lib" / _library.FILE_NAME) + "\n"),
            done.stderr,
        )

    def test_bundled_but_broken(self):
        (self.package / "lib").mkdir()
        (self.package / "lib" / _library.FILE_NAME).write_text("no library")
        done = self.run_import("import defrec", library_path=os.path.dirname(LIBRARY))
        self.assertRegex(
            done.stderr,
            (
                "ImportError: .*site/defrec/lib/libdefrec.so.1 cannot be loaded.* It came with this"
                " package"
            ),
        )

    def test_not_from_the_working_directory(self):
        shutil.copy(LIBRARY, self.folder / _library.FILE_NAME)
        done = self.run_import(
            "import defrec; print(defrec._library.native._name)", folder=self.folder
        )
        self.assertNotIn(str(self.folder), done.stdout)
        if done.returncode != 0:  # a system with a libdefrec of its own has loaded that
            self.assertRegex(
                done.stderr, f"ImportError: {_library.FILE_NAME} cannot be loaded.* LD_LIBRARY_PATH"
            )

    def test_versions(self):
        stub = (
            "import ctypes; stub = ctypes.CDLL('libdefrec.so.1'); "
            "stub.defrec_stub_answer(b'defrec_version', {}, b''); import defrec"
        )
        major, minor = _library.API_MAJOR, _library.API_MINOR
        own = 1000 * major + minor
        for version, fits in (
            (own - 1, False),
            (own, True),
            (own + 1, True),
            (own + 1000, False),
            (0, False),
        ):
            done = self.run_import(stub.format(version), library_path=os.path.dirname(LIBRARY))
            if fits:
                self.assertEqual(done.returncode, 0, done.stderr)
            else:
                found = f"{version // 1000}.{version % 1000}"
                message = (
                    f"ImportError: {_library.FILE_NAME} has version {found} of the C API; this"
                    " package needs"
                )
                self.assertIn(f"{message} {major}.{minor}", done.stderr)

    def test_not_a_libdefrec(self):
        libc = next(path for path in MAPPED if "/libc.so" in path)
        (self.package / "lib").mkdir()
        shutil.copy(libc, self.package / "lib" / _library.FILE_NAME)
        self.assertRegex(
            self.run_import("import defrec").stderr, "ImportError: .* is not a libdefrec"
        )


if __name__ == "__main__":
    unittest.main()

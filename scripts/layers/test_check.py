#!/usr/bin/env python3
"""Tests of check.py: what it must find is made in a tree of three folders."""
import pathlib
import tempfile
import unittest

import check

LAYERS = {"include": [], "sdk/base": ["include"], "sdk/api": ["sdk/base"]}


class CheckTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.tree = pathlib.Path(folder.name)
        self.write("include/a.h", "")
        self.write("sdk/base/b.hpp", '#include <vector>\n#include "include/a.h"\n')
        self.write("sdk/api/c.cpp", '#include "sdk/base/b.hpp"\n')

    def write(self, name, text):
        path = self.tree / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def errors(self, layers=LAYERS, tests=None):
        return check.check(self.tree, {"layers": layers, "tests": tests or {}})

    def test_what_is_listed_passes(self):
        self.assertEqual(self.errors(), [])

    def test_an_arrow_upwards_is_found(self):
        self.write("sdk/api/c.hpp", "")
        self.write("sdk/base/b.cpp", '#include "sdk/api/c.hpp"\n')
        self.assertEqual(
            self.errors(),
            ["sdk/base/b.cpp: includes sdk/api/c.hpp, but sdk/base may not include sdk/api"],
        )

    def test_a_circle_cannot_be_listed(self):
        layers = {"include": [], "sdk/base": ["include", "sdk/api"], "sdk/api": ["sdk/base"]}
        self.assertIn(
            "layers.toml: sdk/base lists sdk/api, which does not stand before it",
            self.errors(layers),
        )

    def test_a_folder_must_be_listed_and_exist(self):
        self.write("sdk/new/d.cpp", "")
        self.assertEqual(
            self.errors(), ["sdk/new/d.cpp: layers.toml does not list the folder sdk/new"]
        )
        (self.tree / "sdk/new/d.cpp").unlink()
        self.assertEqual(
            self.errors({**LAYERS, "sdk/gone": []}),
            ["layers.toml: the folder sdk/gone has no sources"],
        )

    def test_a_pattern_stands_for_folders_without_an_entry(self):
        layers = {**LAYERS, "plugins/base": [], "backends/*": ["include"]}
        layers["plugins/*"] = ["backends/*", "plugins/base"]
        self.write("plugins/base/p.hpp", "")
        for name in ("one", "two"):
            self.write(f"backends/{name}/e.hpp", '#include "include/a.h"\n')
            self.write(f"plugins/{name}/f.cpp", f'#include "backends/{name}/e.hpp"\n')
        unused = "layers.toml: nothing in plugins/* includes plugins/base"
        self.assertEqual(self.errors(layers), [unused])
        self.write("plugins/two/g.cpp", '#include "plugins/base/p.hpp"\n')
        self.assertEqual(self.errors(layers), [])
        self.write("plugins/two/h.cpp", '#include "backends/one/e.hpp"\n')
        self.assertEqual(
            self.errors(layers),
            [
                "plugins/two/h.cpp: includes backends/one/e.hpp, but plugins/two may not include"
                " backends/one"
            ],
        )
        self.assertEqual(
            self.errors({**LAYERS, "bindings/*": []})[-1],
            "layers.toml: bindings/* stands for no folder",
        )

    def test_an_entry_must_be_used(self):
        self.assertEqual(
            self.errors({**LAYERS, "sdk/api": ["include", "sdk/base"]}),
            ["layers.toml: nothing in sdk/api includes include"],
        )
        self.assertEqual(
            self.errors(tests={"sdk/base": ["sdk/api"]}),
            ["layers.toml: no test in sdk/base needs sdk/api"],
        )

    def test_tests_may_include_what_is_listed_for_them(self):
        self.write("sdk/base/b_test.cpp", '#include "sdk/api/c.hpp"\n')
        self.write("sdk/api/c.hpp", "")
        self.assertEqual(len(self.errors()), 1)
        self.assertEqual(self.errors(tests={"sdk/base": ["sdk/api"]}), [])

    def test_a_header_beside_the_source_is_found_by_its_name(self):
        self.write("sdk/base/b.cpp", '#include "b.hpp"\n')
        self.assertEqual(self.errors(), [])


if __name__ == "__main__":
    unittest.main()

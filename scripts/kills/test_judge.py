#!/usr/bin/env python3
"""The judge of killed runs finds each planted loss, and none where there is none."""
import hashlib
import json
import pathlib
import tempfile
import unittest

import judge


def write_run(folder, name, frames):
    """A finished run's files, as `defrec track` names them."""
    (folder / judge.MESHES).mkdir(parents=True)
    contents = {
        "points.csv": f"frame,id\n0,{name}\n",
        "frames.csv": "frame,ms\n" + f"0,{name}\n" * frames,
        "report.html": f"<html>{name}</html>\n",
    }
    for file, text in contents.items():
        (folder / file).write_text(text)
    (folder / judge.MESHES / "000000.ply").write_text(name)
    files = [
        {"name": file, "bytes": len(text), "sha256": hashlib.sha256(text.encode()).hexdigest()}
        for file, text in contents.items()
    ]
    (folder / judge.SUMMARY).write_text(json.dumps({"run": name, "files": files}))


class Judge(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        root = pathlib.Path(folder.name)
        self.runs = {}
        for name, frames in (("earlier", 2), ("new", 3)):
            write_run(root / name, name, frames)
            template = root / f"{name}.template"
            template.write_text(name)
            self.runs[name] = judge.Run(root / name, template)
        self.folder, self.template = root / "earlier", root / "earlier.template"

    def faults(self, earlier=True):
        return judge.judge(
            self.folder, self.template, self.runs["earlier"] if earlier else None, self.runs["new"]
        )

    def test_a_finished_run_that_was_not_touched_is_whole(self):
        self.assertEqual(self.faults(), [])

    def test_a_new_run_that_got_to_its_end_is_whole(self):
        self.folder = self.folder.parent / "new"
        self.template.write_text("new")
        self.assertEqual(self.faults(), [])
        self.assertEqual(self.faults(earlier=False), [])

    def test_whole_files_of_two_runs_without_a_summary_are_no_fault(self):
        (self.folder / judge.SUMMARY).unlink()
        (self.folder / "points.csv").write_text("frame,id\n0,new\n")
        (self.folder / "frames.csv").write_text("frame,ms\n" + "0,9\n" * 3)
        (self.folder / "report.html.defrec-0.partial.html").write_text("<html>")
        self.assertEqual(self.faults(), [])

    def test_one_file_of_another_run_beside_a_summary_is_found(self):
        (self.folder / "points.csv").write_text("frame,id\n0,new\n")
        self.assertEqual(
            self.faults(),
            [
                "points.csv is not as summary.json says",
                "points.csv is not the finished run's",
            ],
        )

    def test_a_mesh_that_the_summary_does_not_list_is_compared_as_well(self):
        (self.folder / judge.MESHES / "000000.ply").write_text("new")
        self.assertEqual(self.faults(), ["deformed/000000.ply is not the finished run's"])

    def test_a_file_that_is_missing_or_too_many_beside_a_summary_is_found(self):
        (self.folder / "frames.csv").rename(self.folder / "stale.csv")
        self.assertEqual(
            self.faults(),
            ["frames.csv is missing beside a summary", "stale.csv is of another run"],
        )

    def test_a_torn_summary_is_found(self):
        (self.folder / judge.SUMMARY).write_text('{"run": ')
        self.assertEqual(self.faults(), ["summary.json is torn"])

    def test_torn_files_without_a_summary_are_found(self):
        (self.folder / judge.SUMMARY).unlink()
        (self.folder / "points.csv").write_text("frame,id\n0,ne")
        (self.folder / "frames.csv").write_text("frame,ms\n0,9\n0,")
        (self.folder / "report.html").write_text("<html>")
        self.assertEqual(
            self.faults(), ["frames.csv is torn", "points.csv is torn", "report.html is torn"]
        )

    def test_a_frame_too_few_is_found(self):
        (self.folder / judge.SUMMARY).unlink()
        (self.folder / "frames.csv").write_text("frame,ms\n" + "0,9\n" * 2)
        self.assertEqual(self.faults(), ["frames.csv is torn"])

    def test_a_lost_or_torn_template_is_found(self):
        self.template.write_text("ear")
        self.assertEqual(self.faults(), ["the saved template is torn"])
        self.template.unlink()
        self.assertEqual(self.faults(), ["the earlier saved template is lost"])


if __name__ == "__main__":
    unittest.main()

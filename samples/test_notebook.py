#!/usr/bin/env python3
"""Runs the notebook as a user would, cell by cell, and leaves it as a page for the site.

usage: test_notebook.py NOTEBOOK FOLDER PROGRAMS

Jupyter's nbclient, ipykernel and nbconvert are needed; without them the test is skipped. FOLDER is
made anew: it gets the sequence and <name of the notebook>.html. PROGRAMS has defrec.
"""
import os
import pathlib
import re
import shutil
import sys

try:
    import ipykernel  # noqa: F401
    import matplotlib  # noqa: F401
    import nbclient
    import nbconvert
    import nbformat
except ImportError as missing:
    print(f"skipped: {missing} (python3-nbclient, python3-ipykernel, jupyter-nbconvert)")
    sys.exit(77)

MAX_ERROR_MM = 1.0
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
body {{ max-width: 60rem; margin: 2rem auto; padding: 0 1rem; font: 16px/1.5 sans-serif; }}
pre {{ background: #f4f6f8; padding: .6rem .8rem; overflow-x: auto; line-height: 1.35; }}
img {{ max-width: 100%; }}
.jp-InputPrompt, .jp-OutputPrompt, .anchor-link {{ display: none; }}
table {{ border-collapse: collapse; }} td, th {{ padding: .15rem .6rem; text-align: right; }}
</style></head><body>
<p><a href="languages_python.html">defrec in Python</a></p>
{body}
</body></html>
"""


def outputs_of(notebook):
    return [
        output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs
    ]


def check(notebook):
    outputs = outputs_of(notebook)
    text = "".join(output.text for output in outputs if output.output_type == "stream")
    kinds = [kind for output in outputs for kind in output.get("data", {})]
    assert not [o for o in outputs if o.output_type == "error"]
    assert not [o for o in outputs if o.output_type == "stream" and o.name == "stderr"], text
    assert "image/png" in kinds, "no plot"
    assert any("<img" in o.data["text/html"] for o in outputs if "text/html" in o.get("data", {}))
    measured, expected = map(
        float, re.search(r"median error ([\d.]+) mm, expected ([\d.]+) mm", text).groups()
    )
    assert measured < MAX_ERROR_MM and 0 < expected < MAX_ERROR_MM, text
    moved, frames = re.search(r"moved by ([\d.]+) mm in depth over (\d+) frames", text).groups()
    assert float(moved) > 0 and int(frames) == 20, text
    return text


def main():
    path, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    os.environ["PATH"] = sys.argv[3] + os.pathsep + os.environ["PATH"]
    os.environ["PYDEVD_DISABLE_FILE_VALIDATION"] = "1"  # a remark of the kernel
    stored = nbformat.read(path, as_version=4)
    nbformat.validate(stored)
    assert not outputs_of(stored), "the notebook is stored with outputs"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    client = nbclient.NotebookClient(
        stored, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
    )
    notebook = client.execute()
    print(check(notebook))
    body, _ = nbconvert.HTMLExporter(template_name="basic").from_notebook_node(notebook)
    title = re.search(r"^# (.*)$", stored.cells[0].source, re.M)[1]
    (folder / f"{path.stem}.html").write_text(PAGE.format(title=title, body=body))


if __name__ == "__main__":
    main()

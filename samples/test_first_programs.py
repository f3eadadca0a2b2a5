#!/usr/bin/env python3
"""The first programs of the guides to C# and Python, run with the camera of a rendered sequence:
pixels of the first image are followed where it shows the tissue, and are lost where it is black.

usage: test_first_programs.py ROOT MCS MONO DEFREC_DLL SEQUENCE CAMERA WORK_FOLDER
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys

from PIL import Image

FRAMES = 3
PIXELS = "150, 120), (170.5, 110"


def program_of(guide, language, mark):
    blocks = re.findall(rf"^```{language}\n(.*?)^```$", guide.read_text(), re.M | re.S)
    return next(block for block in blocks if mark in block)


def with_values(code, values):
    """The code, with what each pattern finds replaced."""
    for pattern, value in values.items():
        code, count = re.subn(pattern, value, code)
        if count == 0:
            sys.exit(f"the program has nothing like {pattern}")
    return code


def write_frames(sequence, folder, has_first):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for view in ("left", "right"):
        for i, path in enumerate(sorted((sequence / view).iterdir())[:FRAMES]):
            image = Image.open(path).convert("RGB")
            pixels = (
                image.tobytes() if i > 0 or has_first else bytes(3 * image.width * image.height)
            )
            (folder / f"{view}{i}").write_bytes(pixels)
    return image.size


def main():
    root, mcs, mono, assembly, sequence, camera, work = sys.argv[1:]
    root, sequence, work = map(pathlib.Path, (root, sequence, work))
    frames = {has_first: work / f"frames_{has_first}" for has_first in (True, False)}
    for has_first, folder in frames.items():
        width, height = write_frames(sequence, folder, has_first)
    fx, fy, cx, cy, baseline = camera.split(",")
    csharp = with_values(
        program_of(root / "docs/languages/csharp.md", "csharp", "class TrackPoints"),
        {
            r"\b960\b": str(width),
            r"\b540\b": str(height),
            r"Intrinsics\(.*?\)": f"Intrinsics({fx}, {fy}, {cx}, {cy}, 0, 0, 0, 0, 0)",
            r"Rotation = new\[\] \{.*?\}": "Rotation = new double[] { 1, 0, 0, 0, 1, 0, 0, 0, 1 }",
            r"Translation = new\[\] \{.*?\}": f"Translation = new double[] {{ -{baseline}, 0, 0 }}",
            r"pixels = \{.*?\}": f"pixels = {{ {re.sub('[()]', '', PIXELS)} }}",
        },
    )
    matrix = f"[[{fx}, 0, {cx}], [0, {fy}, {cy}], [0, 0, 1]], [0, 0, 0, 0, 0]"
    python = with_values(
        program_of(root / "docs/languages/python.md", "python", "M1, D1"),
        {
            r"\b960, 540\b": f"{width}, {height}",
            r"(M[12], D[12]) = .*": rf"\1 = {matrix}",
            r"\bR = .*": "R = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]",
            r"\bT = .*": f"T = [-{baseline}, 0, 0]",
            r"pixels = \[.*?\]": f"pixels = [({PIXELS})]",
        },
    )
    (work / "First.cs").write_text(csharp)
    (work / "first.py").write_text(python)
    shutil.copy(assembly, work)
    subprocess.run(
        [mcs, "-nologo", f"-reference:{assembly}", f"-out:{work}/First.exe", work / "First.cs"],
        check=True,
    )
    environment = {**os.environ, "PYTHONPATH": str(root / "bindings/python")}
    for command in ([mono, work / "First.exe"], [sys.executable, "-B", work / "first.py"]):
        for has_first, folder in frames.items():
            run = subprocess.run(
                [*command, folder], env=environment, check=True, stdout=subprocess.PIPE, text=True
            )
            lines = run.stdout.splitlines()
            followed = [line for line in lines if line.startswith("  ")]
            if len(lines) - len(followed) != FRAMES or len(followed) != 2 * FRAMES * has_first:
                sys.exit(f"{command[-1]}, with the first image: {has_first}, prints\n{run.stdout}")


main()

#!/usr/bin/env python3
"""Prints, as a table in Markdown, how much of the code that reads foreign bytes the fuzz targets'
inputs reach.

usage: coverage.py [TARGET...]

Runs build-coverage/fuzz/defrec_TARGET_replay (preset coverage) on sdk/fuzz/corpus/TARGET and on
what the fuzzer has found, build-fuzz/corpus/TARGET. Lines and branches are llvm-cov's. Exit status:
0, or 1 where a target fails on one of its inputs.
"""
import json
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build-coverage"
# Sources that read or check each target's input.
READERS = {
    "api": ["sdk/api/api.cpp", "sdk/api/handles.cpp", "sdk/api/tracking.cpp"],
    "bag": [
        "sdk/bag/chunk_compression.cpp",
        "sdk/bag/mcap_reader.cpp",
        "sdk/bag/ros_messages.cpp",
        "sdk/input/ros_image.cpp",
    ],
    "calibration": [
        "sdk/io/calibration.cpp",
        "sdk/io/calibration_check.cpp",
        "sdk/io/ros_calibration.cpp",
        "sdk/io/yaml_document.cpp",
    ],
    "image_header": ["sdk/io/image_header.cpp"],
    "images": ["sdk/input/decode_image.cpp", "sdk/input/image_stream.cpp"],
    "live_link": ["sdk/live_link/messages.cpp"],
    "manifest": ["sdk/plugin/manifest.cpp"],
    "mesh": ["sdk/io/obj_file.cpp", "sdk/io/ply_file.cpp", "sdk/io/stl_file.cpp"],
    "poses": ["sdk/hand_eye/hand_eye.cpp", "sdk/hand_eye/program/pose_file.cpp"],
    "plan": ["sdk/plan/file.cpp", "sdk/plan/plan.cpp"],
    "plugin_reply": ["sdk/tracking/stages/check_output.cpp"],
    "predictor": ["sdk/predictor/predictor.cpp", "sdk/predictor/point_runs.cpp"],
    "probe_reply": ["sdk/cli/devices/probe_reply.cpp"],
    "score": ["sdk/evaluation/score/scored_rows.cpp", "sdk/io/csv.cpp"],
    "shared_object": ["sdk/plugin/shared_object_posix.cpp"],
    "sqlite_bag": ["sdk/bag/sqlite_reader.cpp"],
    "stages": ["sdk/device/stage_params.cpp", "sdk/device/stage_runner.cpp"],
    "template": ["sdk/template/file.cpp"],
}


def measure(target):
    """[(file, lines covered, lines, branches covered, branches)] and the number of inputs."""
    folders = [
        folder
        for folder in (ROOT / "sdk/fuzz/corpus" / target, ROOT / "build-fuzz/corpus" / target)
        if folder.is_dir()
    ]
    program, raw, merged = (
        BUILD / "fuzz" / f"defrec_{target}_replay{end}" for end in ("", ".profraw", ".profdata")
    )
    # Each object (the library, a plugin) has a counter file of its own name's hash: %m.
    for old in raw.parent.glob(f"{raw.name}*"):
        old.unlink()
    subprocess.run(
        [program, *folders],
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "LLVM_PROFILE_FILE": f"{raw}.%m"},
    )
    subprocess.run(
        ["llvm-profdata", "merge", "-sparse", *raw.parent.glob(f"{raw.name}.*"), "-o", merged],
        check=True,
    )
    objects = [f"-object={BUILD / 'lib/libdefrec.so'}"]
    made = subprocess.run(
        ["llvm-cov", "export", "-summary-only", f"-instr-profile={merged}", program, *objects],
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    files = json.loads(made)["data"][0]["files"]
    rows = []
    for reader in READERS[target]:
        # Names begin with wherever the compiler says that it was.
        (summary,) = [
            entry["summary"] for entry in files if entry["filename"].endswith(f"/{reader}")
        ]
        rows.append(
            (
                reader,
                *(
                    summary[kind][key]
                    for kind in ("lines", "branches")
                    for key in ("covered", "count")
                ),
            )
        )
    return rows, sum(1 for folder in folders for _ in folder.iterdir())


def share(covered, count):
    return f"{100 * covered / count:.1f} %" if count else "-"


def main():
    targets = sys.argv[1:] or sorted(READERS)
    print("| target | inputs | reader | lines reached | branches reached |\n|---|---|---|---|---|")
    failed = False
    for target in targets:
        try:
            rows, inputs = measure(target)
        except subprocess.CalledProcessError as error:
            print(f"{target}: {error}", file=sys.stderr)
            failed = True
            continue
        for i, (reader, lines_covered, lines, branches_covered, branches) in enumerate(rows):
            names = (f"`{target}`", f"{inputs:,}") if i == 0 else ("", "")
            print(
                f"| {names[0]} | {names[1]} | `{reader}` | {share(lines_covered, lines)} of"
                f" {lines} | {share(branches_covered, branches)} of {branches} |"
            )
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()

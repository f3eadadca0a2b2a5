#!/usr/bin/env python3
"""The sample gstreamer_points: it follows points to the bytes of track_folder, from two sources and
from one with both views side by side; faults of a pipeline are told.

test_gstreamer_points.py PROGRAM TRACK_FOLDER SEQUENCE CAMERA WORK
Exit code 77, which ctest counts as skipped, where GStreamer's plugins are not installed.
"""
import ctypes
import ctypes.util
import pathlib
import subprocess
import sys

import numpy
import PIL.Image

FRAME = "framerate=30/1"
ELEMENTS = ("multifilesrc", "pngdec", "videoconvert", "rawvideoparse", "videotestsrc", "filesrc")


def missing_element():
    gst = ctypes.CDLL(ctypes.util.find_library("gstreamer-1.0"))
    gst.gst_init(None, None)
    gst.gst_element_factory_find.restype = ctypes.c_void_p
    for element in ELEMENTS:
        if not gst.gst_element_factory_find(element.encode()):
            return element
    return None


def images_of(folder, name):
    return (
        f'multifilesrc location="{folder}/%06d.png" caps=image/png,{FRAME} '
        f"! pngdec ! videoconvert ! appsink name={name}"
    )


def write_raw(sequence, path):
    """Both views side by side, BGR. Returns the size of an image."""
    with open(path, "wb") as raw:
        for left in sorted((sequence / "left").iterdir()):
            views = [
                numpy.asarray(PIL.Image.open(file).convert("RGB"))[:, :, ::-1]
                for file in (left, sequence / "right" / left.name)
            ]
            raw.write(numpy.hstack(views).tobytes())
    return 2 * views[0].shape[1], views[0].shape[0]


def main():
    program, track_folder, camera = sys.argv[1], sys.argv[2], sys.argv[4]
    sequence, work = pathlib.Path(sys.argv[3]).resolve(), pathlib.Path(sys.argv[5])
    element = missing_element()
    if element:
        print(f"skipped: GStreamer has no element {element}")
        return 77
    work.mkdir(parents=True, exist_ok=True)
    points = sequence / "points.csv"
    left, right = (str(sequence / view) for view in ("left", "right"))
    subprocess.run(
        [track_folder, left, right, camera, points, work / "expected.csv", "cpu"], check=True
    )
    expected = (work / "expected.csv").read_bytes()
    assert expected.count(b",tracked,") > 100, expected[:300]

    def follow(pipeline, out="out.csv"):
        command = [program, camera, points, work / out, pipeline, "cpu"]
        return subprocess.run(command, capture_output=True, text=True, timeout=300)

    def check(pipeline, wanted=expected):
        run = follow(pipeline)
        assert run.returncode == 0, run
        assert (work / "out.csv").read_bytes() == wanted, pipeline
        return run.stdout

    frames = len(list((sequence / "left").iterdir()))
    lines = check(f"{images_of(left, 'left')} {images_of(right, 'right')}").splitlines()
    assert len(lines) == frames and lines[3].startswith("frame 3 at 0.100 s: points"), lines
    width, height = write_raw(sequence, work / "both.bgr")
    parsed = (
        f'filesrc location="{work / "both.bgr"}" '
        f"! rawvideoparse format=bgr width={width} height={height} {FRAME}"
    )
    check(f"{parsed} ! appsink name=both")
    # Images that the tracker copies have rows with gaps, and other formats are converted.
    check(f"{parsed} ! videoconvert ! video/x-raw,format=RGBx ! videoconvert ! appsink name=both")

    def refused(pipeline, reason):
        run = follow(pipeline, "refused.csv")
        assert run.returncode == 1 and run.stderr.count("\n") == 1, run
        assert reason in run.stderr, run.stderr

    refused("nosuchelement ! appsink name=both", 'no element "nosuchelement"')
    refused("videotestsrc ! appsink name=left", "not two named left and right")
    refused("videotestsrc ! fakesink name=both", "the element both is no appsink")
    refused(f'filesrc location="{work}/none" ! appsink name=both', "the pipeline stopped")
    refused(
        "videotestsrc num-buffers=2 ! video/x-raw,format=BGR,width=321 ! appsink name=both",
        "cut into two halves",
    )
    usage = subprocess.run([program], capture_output=True, text=True)
    assert usage.returncode == 2 and usage.stderr.startswith("usage: gstreamer_points"), usage
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""`defrec track` with an RTSP server that is killed and comes back.

rtsp_test.py PROGRAM
Exit code 77, which ctest counts as skipped, where GStreamer's server or its plugins are not
installed.
"""
import csv
import json
import pathlib
import socket
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).parent
FRAMES = 90
IMAGES_OF_THE_FIRST_SERVER = 75


def skip_without_packages():
    try:
        import gi

        gi.require_version("GstRtspServer", "1.0")
        from gi.repository import Gst
        import PIL  # noqa: F401
    except (ImportError, ValueError) as error:
        print(f"skipped: {error}")
        sys.exit(77)
    Gst.init(None)
    for element in ("rtspsrc", "rtpjpegpay", "jpegparse", "jpegdec", "appsrc"):
        if Gst.ElementFactory.find(element) is None:
            print(f"skipped: GStreamer has no element {element}")
            sys.exit(77)


def free_port():
    with socket.socket() as any_port:
        any_port.bind(("127.0.0.1", 0))
        return any_port.getsockname()[1]


def start_server(sequence, port, images=0):
    server = subprocess.Popen(
        [sys.executable, HERE / "rtsp_server.py", sequence, str(port), str(images)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert server.stdout.readline() == "ready\n"
    return server


def main():
    program = sys.argv[1]
    skip_without_packages()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        sequence, tracked = folder / "sequence", folder / "tracked"
        subprocess.run(
            [
                program,
                "render",
                "heartbeat",
                "--out",
                sequence,
                "--size",
                "320x240",
                "--frames",
                "10",
                "--quiet",
            ],
            check=True,
        )
        port = free_port()
        track = [
            program,
            "track",
            "--layout",
            "side-by-side",
            "--calibration",
            sequence / "calibration.yaml",
            "--points",
            sequence / "points.csv",
            "--out",
            tracked,
            "--no-overlay",
            "--frames",
            f":{FRAMES}",
        ]
        address = f"rtspt://user:secret@127.0.0.1:{port}/stereo"
        shown = address.replace("user:secret", "***")

        refused = subprocess.run([*track, "--stereo", address], stderr=subprocess.PIPE, text=True)
        assert (
            refused.returncode == 3 and shown in refused.stderr and ".." not in refused.stderr
        ), refused

        server = start_server(sequence, port, IMAGES_OF_THE_FIRST_SERVER)
        tracker = subprocess.Popen([*track, "--stereo", address], stderr=subprocess.PIPE, text=True)
        assert server.wait() == 1
        notice = tracker.stderr.readline()
        assert "the camera stopped" in notice, notice
        server = start_server(sequence, port)
        rest = tracker.communicate()[1]
        again = subprocess.run(
            [program, "track", "--like", tracked / "summary.json", "--out", folder / "again"]
            + ["--frames", ":2"],
            capture_output=True,
            text=True,
        )
        server.kill()
        server.wait()
        assert tracker.returncode == 0 and "the camera is back after" in rest, (
            tracker.returncode,
            rest,
        )

        assert again.returncode == 0 and "without user and password" in again.stderr, again
        for result in [*tracked.iterdir(), *(folder / "again").iterdir()]:
            assert b"secret" not in result.read_bytes(), result

        summary = json.loads((tracked / "summary.json").read_text())
        cameras = summary["cameras"]
        assert summary["frames"] == FRAMES, summary
        assert cameras["reconnections"] >= 1, cameras
        assert cameras["frames_received"] - cameras["frames_dropped"] >= FRAMES, cameras
        with open(tracked / "frames.csv", newline="") as file:
            times = [float(row["timestamp_ms"]) for row in csv.DictReader(file)]
        assert times[0] == 0 and all(a < b for a, b in zip(times, times[1:])), times
        gap = max(b - a for a, b in zip(times, times[1:]))
        assert abs(gap - cameras["longest_gap_ms"]) < 1, (gap, cameras)
        tracking = sum(
            summary["states"][state] for state in ("tracking", "degraded", "relocalised")
        )
        assert tracking > FRAMES / 2, summary["states"]
        print(cameras, summary["states"])


if __name__ == "__main__":
    main()

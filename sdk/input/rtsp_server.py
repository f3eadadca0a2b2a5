#!/usr/bin/env python3
"""An RTSP server on loopback for tests: a sequence of `defrec render`, over and over.

rtsp_server.py SEQUENCE PORT [IMAGES] [FPS]
Streams are /left, /right, and /stereo with both side by side. With IMAGES above 0 the server kills
itself after so many of a stream, as a camera does whose cable is pulled. Otherwise it ends with its
standard input.
"""
import io
import os
import pathlib
import sys
import time

import gi

gi.require_version("Gst", "1.0")
gi.require_version("GstRtspServer", "1.0")
from gi.repository import GLib, Gst, GstRtspServer  # noqa: E402
from PIL import Image  # noqa: E402


def jpeg(image):
    file = io.BytesIO()
    image.save(file, "JPEG", quality=95)
    return file.getvalue()


def read_streams(sequence):
    """JPEG images of each stream, forward and back again, so that no tissue jumps."""
    names = sorted(path.name for path in (sequence / "left").iterdir())
    streams = {"left": [], "right": [], "stereo": []}
    for name in names + names[-2:0:-1]:
        left, right = (
            Image.open(sequence / side / name).convert("RGB") for side in ("left", "right")
        )
        both = Image.new("RGB", (2 * left.width, left.height))
        both.paste(left, (0, 0))
        both.paste(right, (left.width, 0))
        for stream, image in (("left", left), ("right", right), ("stereo", both)):
            streams[stream].append(jpeg(image))
    return streams


def main():
    sequence, port = pathlib.Path(sys.argv[1]), sys.argv[2]
    limit = int(sys.argv[3]) if len(sys.argv) > 3 else 0
    fps = int(sys.argv[4]) if len(sys.argv) > 4 else 15
    Gst.init(None)
    server = GstRtspServer.RTSPServer()
    server.set_address("127.0.0.1")
    server.set_service(port)

    def configure(factory, media, images):
        source = media.get_element().get_by_name("images")
        sent = 0

        def send():
            nonlocal sent
            if limit and sent == limit:
                os._exit(1)
            # By the clock, so that left and right show the same moment.
            moment = int(time.monotonic() * fps)
            flow = source.emit("push-buffer", Gst.Buffer.new_wrapped(images[moment % len(images)]))
            sent += 1
            return flow == Gst.FlowReturn.OK

        GLib.timeout_add(round(1000 / fps), send)

    for stream, images in read_streams(sequence).items():
        factory = GstRtspServer.RTSPMediaFactory()
        factory.set_launch(
            "( appsrc name=images is-live=true do-timestamp=true format=time"
            f" caps=image/jpeg,framerate={fps}/1 ! jpegparse ! rtpjpegpay name=pay0 )"
        )
        factory.set_shared(True)
        factory.connect("media-configure", configure, images)
        server.get_mount_points().add_factory(f"/{stream}", factory)
    if server.attach(None) == 0:
        sys.exit(f"port {port} is taken")
    loop = GLib.MainLoop()
    GLib.io_add_watch(0, GLib.PRIORITY_DEFAULT, GLib.IOCondition.HUP, lambda *ignored: loop.quit())
    print("ready", flush=True)
    loop.run()


if __name__ == "__main__":
    main()

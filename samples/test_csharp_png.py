#!/usr/bin/env python3
"""The samples in C# read PNG images of each kind alike, and refuse what they cannot read with its
name. stereo_only stands for all of them: the same pixels give the same disparities.

usage: test_csharp_png.py WORK_FOLDER MONO STEREO_ONLY
"""
import pathlib
import struct
import subprocess
import sys
import zlib

import numpy
from PIL import Image

SIGNATURE = b"\x89PNG\r\n\x1a\n"
WIDTH, HEIGHT, DISPARITY = 160, 120, 12


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(pixels, filters=(0,), bits=8, interlace=0, parts=1):
    """The file, row by row with the filters in turn. pixels: (height, width, channels)."""
    height, width, channels = pixels.shape
    rows = pixels.astype(int)
    left, above = numpy.zeros_like(rows), numpy.zeros_like(rows)
    left[:, 1:], above[1:] = rows[:, :-1], rows[:-1]
    corner = numpy.zeros_like(rows)
    corner[1:, 1:] = rows[:-1, :-1]
    distances = [abs(above - corner), abs(left - corner), abs(left + above - 2 * corner)]
    paeth = numpy.choose(numpy.argmin(distances, axis=0), [left, above, corner])
    predicted = [0 * rows, left, above, (left + above) // 2, paeth]
    data = b""
    for y in range(height):
        kind = filters[y % len(filters)]
        data += bytes([kind]) + ((rows - predicted[kind])[y] % 256).astype(numpy.uint8).tobytes()
    packed = zlib.compress(data)
    size = -(-len(packed) // parts)
    colours = {1: 0, 2: 4, 3: 2, 4: 6}[channels]
    header = struct.pack(">IIBBBBB", width, height, bits, colours, 0, 0, interlace)
    pieces = [packed[i : i + size] for i in range(0, len(packed), size)]
    return (
        SIGNATURE
        + chunk(b"IHDR", header)
        + chunk(b"tEXt", b"Comment\0a test")
        + b"".join(chunk(b"IDAT", piece) for piece in pieces)
        + chunk(b"IEND", b"")
    )


class Test:
    def __init__(self, work, mono, program):
        self.work, self.command = pathlib.Path(work), [mono, program]
        self.work.mkdir(parents=True, exist_ok=True)

    def run(self, left, right):
        paths = [self.work / name for name in ("left.png", "right.png", "out.pgm")]
        paths[0].write_bytes(left)
        paths[1].write_bytes(right)
        paths[2].unlink(missing_ok=True)
        done = subprocess.run([*self.command, *paths, "cpu"], capture_output=True, text=True)
        return done.returncode, done.stderr, paths[2].read_bytes() if paths[2].exists() else b""

    def same(self, what, expected, left, right):
        code, message, disparity = self.run(left, right)
        assert code == 0, f"{what}: {message}"
        assert disparity == expected, f"{what}: other disparities"

    def refused(self, what, left, words):
        code, message, _ = self.run(left, left)
        assert code == 1 and message.count("\n") == 1, f"{what}: {code}, {message}"
        assert f"left.png: {words}" in message, f"{what}: {message}"


def main():
    test = Test(*sys.argv[1:])
    scene = numpy.random.default_rng(1).integers(0, 256, (HEIGHT, WIDTH + DISPARITY, 3))
    left, right = scene[:, :WIDTH], scene[:, DISPARITY:]
    views = [left, right]
    code, message, expected = test.run(*(png(view) for view in views))
    assert code == 0, message
    found = numpy.frombuffer(expected[-2 * WIDTH * HEIGHT :], ">u2")
    assert (found == 16 * DISPARITY).mean() > 0.5, "the disparity of the scene is not found"

    for kind in range(5):
        test.same(f"filter {kind}", expected, *(png(view, [kind]) for view in views))
    test.same("all filters", expected, *(png(view, range(5), parts=7) for view in views))
    alpha = [numpy.dstack([view, numpy.full((HEIGHT, WIDTH), 255)]) for view in views]
    test.same("RGBA", expected, *(png(view, range(5)) for view in alpha))
    weights = numpy.array([77, 150, 29])
    gray = [((view @ weights + 128) >> 8)[:, :, None] for view in views]
    test.same("gray", expected, *(png(view, range(5)) for view in gray))
    both = [numpy.dstack([view[:, :, 0], view[:, :, 0] * 0]) for view in gray]
    test.same("gray with alpha", expected, *(png(view, range(5)) for view in both))
    for name, view in zip(("l.png", "r.png"), views):
        Image.fromarray(view.astype(numpy.uint8)).save(test.work / name, optimize=True)
    by_pillow = [(test.work / name).read_bytes() for name in ("l.png", "r.png")]
    test.same("by Pillow", expected, *by_pillow)

    whole = png(left)
    test.refused("empty", b"", "is no PNG image")
    test.refused("text", b"P5 2 2 255 abcd", "is no PNG image")
    for size in (8, 20, 60, len(whole) // 2, len(whole) - 12):
        test.refused(f"{size} bytes", whole[:size], "is cut short")
    test.refused("16 bits", png(left, bits=16), "8 bits a channel")
    test.refused("interlaced", png(left, interlace=1), "8 bits a channel")
    test.refused("filter 5", whole_with(zlib.compress(bytes([5]) * 4)), "is damaged")
    test.refused("few rows", whole_with(zlib.compress(bytes(8))), "has too few rows")
    test.refused("no data", whole_with(b""), "has too few rows")
    test.refused("no zlib", whole_with(b"\x78\x9c" + b"\xff" * 40), "is damaged")
    test.refused("no header", SIGNATURE + chunk(b"IEND", b""), "has no header first")
    huge = struct.pack(">IIBBBBB", 1 << 31, 1, 8, 2, 0, 0, 0)
    test.refused("huge", SIGNATURE + chunk(b"IHDR", huge) + chunk(b"IEND", b""), "is of ")
    print("the samples in C# read PNG images of each kind")


def whole_with(data):
    """An RGB image of 1 x 100 pixels with these compressed bytes."""
    header = struct.pack(">IIBBBBB", 1, 100, 8, 2, 0, 0, 0)
    return SIGNATURE + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


main()

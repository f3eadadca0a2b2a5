#!/usr/bin/env python3
"""A copy of a sequence of 320 x 240 pixels that begins with an image of something else: black, or a
soft texture 77 mm away, whose template is given up as the sequence goes on.

usage: other_scene.py black|soft SEQUENCE OUT
"""
import pathlib
import random
import shutil
import struct
import sys
import zlib

WIDTH, HEIGHT, DISPARITY = 320, 240, 20


def png(rows):
    """Gray rows as a PNG of three equal channels."""

    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    pixels = b"".join(b"\0" + b"".join(bytes((gray,)) * 3 for gray in row) for row in rows)
    head = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        (chunk(b"IHDR", head), chunk(b"IDAT", zlib.compress(pixels)), chunk(b"IEND", b""))
    )


def blurred(row, radius):
    """Running mean, cyclic."""
    count, size = len(row), 2 * radius + 1
    total = sum(row[i % count] for i in range(-radius, radius + 1))
    means = []
    for i in range(count):
        means.append(total / size)
        total += row[(i + radius + 1) % count] - row[(i - radius) % count]
    return means


def texture(width, height):
    source = random.Random(1)
    rows = [[source.random() for _ in range(width)] for _ in range(height)]
    for radius in (1, 1, 2):
        rows = [blurred(row, radius) for row in rows]
        rows = [list(row) for row in zip(*[blurred(column, radius) for column in zip(*rows)])]
    low, high = min(map(min, rows)), max(map(max, rows))
    return [[int(30 + 200 * (value - low) / (high - low)) for value in row] for row in rows]


def main():
    kind, sequence, out = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    wide = texture(WIDTH + DISPARITY, HEIGHT) if kind == "soft" else [[0] * 340] * HEIGHT
    for view, first in (("left", 0), ("right", DISPARITY)):
        folder = out / view
        folder.mkdir(parents=True)
        (folder / "000000.png").write_bytes(png([row[first : first + WIDTH] for row in wide]))
        for i, image in enumerate(sorted((sequence / view).glob("*.png"))):
            shutil.copy(image, folder / f"{i + 1:06}.png")


main()

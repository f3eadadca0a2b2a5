#!/usr/bin/env python3
"""Tracks films with jumps and counts the alarms about the rig that follow them.

scripts/measure_jumps.py [--backend NAME] [--jumps N] [--out FOLDER] SEQUENCE...
SEQUENCE: left/ right/ calibration.yaml, as of `defrec render`, whose views are of one time and
whose calibration is right: each alarm is a false one. The film of a sequence plays on for 45 frames
between two jumps. They are in turn: back to the first frame, frames removed, a feed that stands
still for some frames and goes on with the frame that is due then, and back by some frames; by 1 to
89 frames. Prints a markdown table: frames within the second after a jump, frames beyond it, and
how many of each have an alarm. Needs a build in build/.
"""
import argparse
import csv
import os
import pathlib
import shutil
import subprocess

PLAYED = 45  # frames from one jump to the next
SECOND = 30  # frames
LENGTHS = (21, 2, 55, 8, 34, 1, 89, 13, 5, 3)  # frames
ALARMS = {"calibration", "view-late"}


def film(frames, jumps):
    """Frames of the sequence in their order in the film, and places in it after which it jumps."""
    order, after = list(range(PLAYED)), []
    for jump in range(jumps):
        length = LENGTHS[(jump + jump // 20) % len(LENGTHS)]
        last = order[-1]
        kind = jump % 4
        if kind == 0:
            place = 0
        elif kind == 3:
            place = last - length
        else:
            place = last + 1 + length
        if kind == 2:
            order += [last] * length
        after.append(len(order))
        place %= frames
        while len(order) < after[-1] + PLAYED:
            order.append(place)
            place += 1
            if place == frames:
                after.append(len(order))
                place = 0
    return order, after


def write_film(sequence, order, folder):
    shutil.rmtree(folder, ignore_errors=True)
    for view in ("left", "right"):
        images = sorted((sequence / view).iterdir())
        (folder / view).mkdir(parents=True)
        for i, frame in enumerate(order):
            os.symlink(images[frame].resolve(), folder / view / f"{i:06d}{images[frame].suffix}")


def track(sequence, folder, backend):
    command = [
        "build/bin/defrec",
        "track",
        "--left",
        folder / "left",
        "--right",
        folder / "right",
    ]
    command += ["--calibration", sequence / "calibration.yaml", "--out", folder / "tracked"]
    command += ["--backend", backend, "--no-overlay", "--quiet"]
    subprocess.run(command, check=True)
    with open(folder / "tracked" / "frames.csv", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def alarms(rows, after):
    """(frames within the second after a jump, how many of them have an alarm), and the same of the
    frames beyond; rows: of frames.csv."""
    counts = {True: [0, 0], False: [0, 0]}
    for frame, row in enumerate(rows):
        near = any(0 <= frame - jump < SECOND for jump in after)
        counts[near][0] += 1
        counts[near][1] += not ALARMS.isdisjoint(row["reasons"].split("|"))
    return counts[True], counts[False]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--backend", default="auto")
    parser.add_argument("--jumps", type=int, default=40, help="in each film, besides its ends")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/jumps"))
    parser.add_argument("sequences", type=pathlib.Path, nargs="+")
    arguments = parser.parse_args()
    print(
        "| sequence | jumps | frames in the second after | with an alarm | beyond | with an alarm |"
    )
    print("|---|---|---|---|---|---|")
    for sequence in arguments.sequences:
        folder = arguments.out / sequence.name
        frames = len(list((sequence / "left").iterdir()))
        if frames < PLAYED:
            parser.error(f"{sequence} has {frames} frames; {PLAYED} at least are needed")
        order, after = film(frames, arguments.jumps)
        write_film(sequence, order, folder)
        near, beyond = alarms(track(sequence, folder, arguments.backend), after)
        print(
            f"| {sequence.name} | {len(after)} | {near[0]} | {near[1]} "
            f"| {beyond[0]} | {beyond[1]} |",
            flush=True,
        )


if __name__ == "__main__":
    main()

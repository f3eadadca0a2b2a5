#!/usr/bin/env python3
"""How a navigation system uses defrec: a camera delivers frames at its own pace, and the loop takes
the newest frame, waits for its result until a deadline, and goes on with what is there.

live_loop.py LEFT RIGHT FX,FY,CX,CY,BASELINE_MM DEADLINE_MS [DEVICE_ID]

The camera is a thread that reads a sequence at 30 frames a second. One line is printed for each
result: in time, or late.
"""
import collections
import math
import sys
import threading
import time

import defrec
from input import Sequence, parse_camera, run

USAGE = "live_loop LEFT RIGHT FX,FY,CX,CY,BASELINE_MM DEADLINE_MS [DEVICE_ID]"

Frame = collections.namedtuple(
    "Frame", "number left right arrived"
)  # arrived: seconds of time.monotonic
Pending = collections.namedtuple("Pending", "job number deadline")


class Camera(threading.Thread):
    """Keeps the newest frame; one that was not taken is lost, as with a real camera."""

    def __init__(self, sequence):
        super().__init__(daemon=True)
        self._sequence = sequence
        self._changed = threading.Condition()
        self._newest = None
        self._has_ended = False
        self._failure = None

    def run(self):
        try:
            self._deliver()
        except Exception as error:
            self._failure = error
        with self._changed:
            self._has_ended = True
            self._changed.notify()

    def _deliver(self):
        start = time.monotonic()
        for number in range(len(self._sequence)):
            left, right, timestamp_ns = self._sequence[number]
            time.sleep(max(0, start + timestamp_ns / 1e9 - time.monotonic()))
            with self._changed:
                self._newest = Frame(number, left, right, time.monotonic())
                self._changed.notify()

    def take_newest(self):
        """Waits for a frame; None: the camera has ended. Raises the error that stopped it."""
        with self._changed:
            self._changed.wait_for(lambda: self._newest is not None or self._has_ended)
            newest, self._newest = self._newest, None
        if newest is None and self._failure is not None:
            raise self._failure
        return newest


def show(pending):
    """What a display does with a result: a frame that is tracked or degraded moves the plan; a lost
    one hides it, or shows it as old."""
    result = pending.job.result()
    in_time = "in time" if time.monotonic() <= pending.deadline else "late"
    reasons = ", ".join(
        reason.name.lower().replace("_", " ")
        for reason in defrec.Reason
        if reason in result.reasons
    )
    print(
        f"frame {pending.number} {in_time}: {result.state.name.lower()}"
        f"{': ' if reasons else ''}{reasons}"
    )


def take_results(queue, until):
    """Shows the results that are done by then, oldest first, and releases their places."""
    while queue and queue[0].job.wait(max(0, until - time.monotonic())):
        with queue[0].job:
            show(queue.popleft())


def main(left_folder, right_folder, camera, deadline_ms, device_id=None):
    try:
        deadline = float(deadline_ms) / 1000
    except ValueError:
        deadline = math.nan
    if not 0 <= deadline <= 60:
        print(f"usage: {USAGE}", file=sys.stderr)
        sys.exit(2)
    sequence = Sequence(left_folder, right_folder)

    # Everything that takes long is done before the camera runs: plugins, device, memory.
    with defrec.Context() as context:
        rig = defrec.Rig.rectified(context, sequence.width, sequence.height, parse_camera(camera))
        tracker = defrec.Tracker(
            context, rig, device_id, format=defrec.Format.RGB8, frames_in_flight=2
        )
        source = Camera(sequence)
        source.start()

        queue, submitted = collections.deque(), 0
        while (frame := source.take_newest()) is not None:
            take_results(queue, 0)  # late results
            try:
                job = tracker.submit(
                    frame.left, frame.right, int(frame.arrived * 1e9)
                )  # copies the images
            except defrec.BusyError:
                continue  # both places are taken; the frame is dropped
            submitted += 1
            queue.append(Pending(job, frame.number, frame.arrived + deadline))
            take_results(queue, frame.arrived + deadline)
        take_results(queue, math.inf)
        print(
            f"{len(sequence)} frames from the camera, {submitted} tracked, "
            f"{len(sequence) - submitted} dropped"
        )


if __name__ == "__main__":
    run(main, USAGE, 4, 5)

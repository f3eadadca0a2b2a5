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
from typing import Deque, NamedTuple, Optional

import defrec
from input import Image8, Sequence, parse_camera, run

USAGE = "live_loop LEFT RIGHT FX,FY,CX,CY,BASELINE_MM DEADLINE_MS [DEVICE_ID]"


class Frame(NamedTuple):
    number: int
    left: Image8
    right: Image8
    arrived: float  # seconds of time.monotonic


class Pending(NamedTuple):
    job: defrec.Job
    number: int
    deadline: float


class Camera(threading.Thread):
    """Keeps the newest frame; one that was not taken is lost, as with a real camera."""

    def __init__(self, sequence: Sequence) -> None:
        super().__init__(daemon=True)
        self._sequence = sequence
        self._changed = threading.Condition()
        self._newest: Optional[Frame] = None
        self._has_ended = False
        self._failure: Optional[Exception] = None

    def run(self) -> None:
        try:
            self._deliver()
        except Exception as error:
            self._failure = error
        with self._changed:
            self._has_ended = True
            self._changed.notify()

    def _deliver(self) -> None:
        start = time.monotonic()
        for number in range(len(self._sequence)):
            left, right, timestamp_ns = self._sequence[number]
            time.sleep(max(0, start + timestamp_ns / 1e9 - time.monotonic()))
            with self._changed:
                self._newest = Frame(number, left, right, time.monotonic())
                self._changed.notify()

    def take_newest(self) -> Optional[Frame]:
        """Waits for a frame; None: the camera has ended. Raises the error that stopped it."""
        with self._changed:
            self._changed.wait_for(lambda: self._newest is not None or self._has_ended)
            newest, self._newest = self._newest, None
        if newest is None and self._failure is not None:
            raise self._failure
        return newest


def show(pending: Pending) -> None:
    """What a display does with a result: a frame that is tracked or degraded moves the plan; a lost
    one hides it, or shows it as old."""
    result = pending.job.result()
    in_time = "in time" if time.monotonic() <= pending.deadline else "late"
    reasons = ", ".join(
        (reason.name or "").lower().replace("_", " ")
        for reason in defrec.Reason
        if reason in result.reasons
    )
    print(
        f"frame {pending.number} {in_time}: {result.state.name.lower()}"
        f"{': ' if reasons else ''}{reasons}"
    )


def take_results(queue: Deque[Pending], until: float) -> None:
    """Shows the results that are done by then, oldest first, and releases their places."""
    while queue and queue[0].job.wait(max(0, until - time.monotonic())):
        with queue[0].job:
            show(queue.popleft())


def main(
    left_folder: str,
    right_folder: str,
    camera: str,
    deadline_ms: str,
    device_id: Optional[str] = None,
) -> None:
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

        queue: Deque[Pending] = collections.deque()
        submitted = 0
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

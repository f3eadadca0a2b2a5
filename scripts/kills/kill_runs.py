#!/usr/bin/env python3
"""Kills `defrec track` at random moments and judges what is left (judge.py).

usage: kill_runs.py --defrec PROGRAM --work FOLDER [--kills N] [--seed N] [--frames N]

Every other run is in a folder with an earlier run's results, and replaces its saved template. Half
of the moments are anywhere in a run; the other half are after points.csv got its name, while the
others get theirs. The next run in each folder must end well, remove what is partial, and leave
exactly its own files. Prints a table; exit status 1 if anything was lost or half.
"""
import argparse
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import time

import judge

EARLIER_FRAMES = 4  # the earlier run begins there, so that its template and points differ
POLL_S = 0.0005
SHORTER, LONGER = 0.8, 1.1  # a window of moments after a run that ended, or was killed


class Program:
    def __init__(self, defrec, work, frames):
        self.defrec, self.work, self.frames = defrec, work, frames
        self.sequence = work / "sequence"
        subprocess.run(
            [defrec, "render", "heartbeat", "--quiet", "--size", "160x120"]
            + ["--frames", str(frames), "--out", str(self.sequence)],
            check=True,
        )

    def start(self, folder, template, first=0):
        command = [self.defrec, "track", "--quiet", "--backend", "cpu", "--meshes"]
        for view in ("left", "right"):
            command += [f"--{view}", str(self.sequence / view)]
        command += ["--calibration", str(self.sequence / "calibration.yaml")]
        command += ["--points", str(self.sequence / "points.csv")]
        command += ["--frames", f"{first}:{self.frames}"]
        command += ["--out", str(folder), "--save-template", str(template)]
        return subprocess.Popen(command, stderr=subprocess.PIPE)

    def finish(self, folder, template, first=0):
        process = self.start(folder, template, first)
        _, errors = process.communicate()
        if process.returncode != 0:
            raise SystemExit(f"a run that nobody killed failed: {errors.decode()}")
        return judge.Run(folder, template)


def wait_for_points(process, folder, before):
    """Until the run has named its points.csv, or has ended."""
    points = folder / "points.csv"
    while process.poll() is None:
        try:
            if points.stat().st_ino != before:
                return
        except FileNotFoundError:
            pass
        time.sleep(POLL_S)


def kill_at(process, folder, before, at_end, delay):
    """Whether the run was still there to be killed."""
    if at_end:
        wait_for_points(process, folder, before)
    try:
        process.wait(delay)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
    process.communicate()
    return process.returncode == -signal.SIGKILL


class Trial:
    """One run that is killed, in a folder of its own, and the next one there."""

    def __init__(self, program, new, earlier, has_earlier):
        self.program, self.new = program, new
        self.earlier = earlier[2] if has_earlier else None
        self.folder, self.template = program.work / "out", program.work / "out.template"
        shutil.rmtree(self.folder, ignore_errors=True)
        self.template.unlink(missing_ok=True)
        if has_earlier:
            shutil.copytree(earlier[0], self.folder)
            shutil.copy(earlier[1], self.template)

    def run(self, at_end, delay):
        points = self.folder / "points.csv"
        before = points.stat().st_ino if points.exists() else None
        process = self.program.start(self.folder, self.template)
        was_killed = kill_at(process, self.folder, before, at_end, delay)
        faults = judge.judge(self.folder, self.template, self.earlier, self.new)
        if not was_killed and not (self.folder / judge.SUMMARY).exists():
            faults.append("a run that ended has no summary.json")
        return was_killed, self.state(), faults

    def state(self):
        if not self.folder.exists():
            return "no folder yet"
        if not (self.folder / judge.SUMMARY).exists():
            return "unfinished, and says so"
        if self.earlier is not None and judge.files_of(self.folder) == self.earlier.files:
            return "the earlier run, whole"
        return "the new run, whole"

    def repeat(self):
        again = self.program.finish(self.folder, self.template)
        faults = judge.judge(self.folder, self.template, None, again)
        faults += [f"{name} is left over" for name in judge.partial_files(self.folder.parent)]
        if set(again.files) != set(self.new.files):
            faults.append("the next run's files are not its own alone")
        return [f"after the next run: {fault}" for fault in faults]


def durations(program):
    """Seconds of a run, and of its end from when points.csv has its name."""
    folder = program.work / "timed"
    process = program.start(folder, program.work / "timed.template")
    begin = time.monotonic()
    wait_for_points(process, folder, None)
    named = time.monotonic()
    process.communicate()
    end = time.monotonic()
    return end - begin, end - named


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--defrec", required=True)
    parser.add_argument("--work", required=True, type=pathlib.Path)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--frames", type=int, default=12)
    options = parser.parse_args()
    shutil.rmtree(options.work / "trials", ignore_errors=True)
    work = options.work / "trials"
    work.mkdir(parents=True)
    program = Program(options.defrec, work, options.frames)
    new = program.finish(work / "new", work / "new.template")
    earlier_paths = (work / "earlier", work / "earlier.template")
    earlier = (*earlier_paths, program.finish(*earlier_paths, first=EARLIER_FRAMES))
    whole_s, end_s = durations(program)
    windows = {False: whole_s, True: end_s}  # follow a load that changes meanwhile
    moments = random.Random(options.seed)
    states, faults, killed, trials = {}, [], 0, 0
    while killed < options.kills and trials < 10 * options.kills:
        trial = Trial(program, new, earlier, has_earlier=trials % 2 == 1)
        at_end = trials % 4 >= 2
        delay = moments.uniform(0, windows[at_end])
        was_killed, state, found = trial.run(at_end, delay)
        windows[at_end] *= LONGER if was_killed else SHORTER
        found += trial.repeat()
        faults += [f"trial {trials}, {delay * 1000:.1f} ms: {fault}" for fault in found]
        trials, killed = trials + 1, killed + was_killed
        if was_killed:
            states[state] = states.get(state, 0) + 1
        if trials % 20 == 0:
            print(f"{killed} killed of {trials}, {len(faults)} faults", file=sys.stderr)
    print(f"{killed} runs killed of {trials}, seed {options.seed}")
    for state, count in sorted(states.items()):
        print(f"  {count:4d}  {state}")
    print(f"  {len(faults):4d}  faults")
    print("\n".join(faults))
    return 1 if faults or killed < options.kills else 0


if __name__ == "__main__":
    sys.exit(main())

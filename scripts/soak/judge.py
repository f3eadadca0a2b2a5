#!/usr/bin/env python3
"""Judges a soak run: fits a line to each quantity over time, and says which of them grows.

usage: judge.py SAMPLES.csv [--device-memory MB.txt] [--plot PLOT.svg]

SAMPLES.csv is what defrec-soak printed; MB.txt has the device's memory in use, one number a line,
at equal times. The first fifth of the run is left out: caches fill. Samples that follow each other
depend on each other, so the line is fitted to 20 blocks of equal length: to the largest sample of
each where a quantity goes up and down with the trackers that are alive, to the mean otherwise. The
interval of its slope is Student's, 95 %. A quantity grows where the interval lies above 0 and the
growth over the run is above its limit: below that it is no leak. Exit status 1: something grows.
Errors and frame times are left out where a block has none.
"""
import argparse
import csv
import pathlib
import sys

WARM_UP = 0.2
BLOCKS = 20
STUDENT_95 = 2.101  # 18 degrees of freedom: 20 blocks, 2 parameters


def mean(values):
    return sum(values) / len(values)


# Name in the samples: what it is, its unit, what is taken of a block, growth per run (unit) below
# which it is no leak; None: shown, not judged, since other work on the machine changes it.
QUANTITIES = {
    "resident_mb": ("resident memory, peak", "MB", max, 2.0),
    "heap_mb": ("heap in use, peak", "MB", max, 0.5),
    "device_mb": ("device memory, peak", "MB", max, 8.0),
    "descriptors": ("file descriptors, peak", "", max, 0.5),
    "threads": ("threads, peak", "", max, 0.5),
    "loop_error_mm": ("error at the end of a loop", "mm", mean, 0.01),
    "p99_ms": ("p99 of the frame time", "ms", mean, None),
}
FROM_FRAMES = ("loop_error_mm", "p99_ms")
TOTALS = (
    "frames",
    "lost",
    "trackers",
    "cuts",
    "losses",
    "gaps",
    "templates",
    "growths",
    "lost_devices",
)


def blocks_of(times, values, statistic, blocks=BLOCKS):
    """(time, statistic of the samples) of blocks of equal length of time; empty blocks are left
    out."""
    first, last = times[0], times[-1]
    found = {}
    for time, value in zip(times, values):
        block = min(blocks - 1, int((time - first) / (last - first) * blocks))
        found.setdefault(block, ([], []))
        found[block][0].append(time)
        found[block][1].append(value)
    return [(mean(given), statistic(taken)) for _, (given, taken) in sorted(found.items())]


def fit(points):
    """Least squares: value at time 0, slope, half the width of the slope's 95 % interval."""
    count = len(points)
    mean_t, mean_v = map(mean, zip(*points))
    spread = sum((t - mean_t) ** 2 for t, _ in points)
    slope = sum((t - mean_t) * (v - mean_v) for t, v in points) / spread
    start = mean_v - slope * mean_t
    residual = sum((v - start - slope * t) ** 2 for t, v in points)
    return start, slope, STUDENT_95 * (residual / (count - 2) / spread) ** 0.5


class TooFewSamples(ValueError):
    """A block has none."""


class Line:
    """A quantity's line. Times in hours."""

    def __init__(self, name, times, values):
        self.name, self.times, self.values = name, times, values
        self.what, self.unit, statistic, self.limit = QUANTITIES[name]
        if not times:
            raise TooFewSamples(f"{name}: no samples")
        begin = times[0] + WARM_UP * (times[-1] - times[0])
        used = [(t, v) for t, v in zip(times, values) if t >= begin]
        points = blocks_of(*zip(*used), statistic)
        if len(points) < BLOCKS:
            raise TooFewSamples(
                f"{name}: {len(points)} of {BLOCKS} parts of the run have samples; the run is too"
                " short"
            )
        self.begin = begin
        self.mean = mean([v for _, v in points])
        self.start, self.slope, self.half_width = fit(points)

    @property
    def growth(self):
        """Over the part of the run that was judged."""
        return self.slope * (self.times[-1] - self.begin)

    @property
    def grows(self):
        return self.limit is not None and self.slope > self.half_width and self.growth > self.limit


def read(path, device_memory):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    if not rows:
        raise ValueError(f"{path}: no samples")
    times = [float(row["second"]) / 3600 for row in rows]
    lines = []
    for name in QUANTITIES:
        if name == "device_mb":
            if device_memory:
                values = [float(line) for line in pathlib.Path(device_memory).read_text().split()]
                step = times[-1] / len(values)
                lines.append(Line(name, [step * (i + 1) for i in range(len(values))], values))
            continue
        given = [(t, float(row[name])) for t, row in zip(times, rows) if row[name]]
        try:
            lines.append(Line(name, [t for t, _ in given], [v for _, v in given]))
        except TooFewSamples:
            if name not in FROM_FRAMES:
                raise
    return times[-1], {name: sum(int(row[name]) for row in rows) for name in TOTALS}, lines


def table(hours, totals, lines):
    text = [
        f"{60 * hours:.1f} minutes: "
        + ", ".join(f"{count} {name}" for name, count in totals.items()),
        "",
    ]
    text += [
        "| quantity | mean | slope per hour, 95 % interval | growth in the run | grows |",
        "|---|---|---|---|---|",
    ]
    for line in lines:
        unit = f" {line.unit}" if line.unit else ""
        verdict = "not judged" if line.limit is None else "yes" if line.grows else "no"
        text.append(
            f"| {line.what} | {line.mean:.4g}{unit} |"
            f" {line.slope:+.3g} [{line.slope - line.half_width:+.3g},"
            f" {line.slope + line.half_width:+.3g}]{unit} | {line.growth:+.2g}{unit} | {verdict} |"
        )
    return "\n".join(text)


def plot(lines):
    """SVG: a panel for each quantity, its samples and its line."""
    width, height, left, gap = 760, 120, 90, 34
    out = []
    for i, line in enumerate(lines):
        top = i * (height + gap) + 24
        low, high = min(0.0, min(line.values)), max(line.values) * 1.05 or 1
        last = line.times[-1]

        def at(time, value, top=top, low=low, high=high, last=last):
            x = left + time / last * (width - left - 20)
            y = top + height - (value - low) / (high - low) * height
            return f"{x:.1f},{y:.1f}"

        unit = f", {line.unit}" if line.unit else ""
        ends = [at(time, line.start + line.slope * time) for time in (line.begin, last)]
        out += [
            f'<text x="{left}" y="{top - 6}">{line.what}{unit}</text>',
            (
                f'<rect x="{left}" y="{top}" width="{width - left - 20}" height="{height}"'
                ' fill="none" stroke="#999"/>'
            ),
            f'<text x="{left - 6}" y="{top + 12}" text-anchor="end">{high:.3g}</text>',
            f'<text x="{left - 6}" y="{top + height}" text-anchor="end">{low:.3g}</text>',
            (
                '<polyline fill="none" stroke="#1f77b4"'
                f' points="{" ".join(map(at, line.times, line.values))}"/>'
            ),
            f'<polyline fill="none" stroke="#d62728" stroke-width="2" points="{" ".join(ends)}"/>',
        ]
    total = len(lines) * (height + gap) + 24
    minutes = 60 * lines[0].times[-1]
    out.append(
        f'<text x="{width - 20}" y="{total - 8}" text-anchor="end">{minutes:.0f} minutes; red: the'
        " fitted line</text>"
    )
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{total}"'
        ' font-family="sans-serif" font-size="12">'
    )
    return (
        "\n".join([head, f'<rect width="{width}" height="{total}" fill="white"/>', *out, "</svg>"])
        + "\n"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("samples")
    parser.add_argument("--device-memory")
    parser.add_argument("--plot")
    arguments = parser.parse_args()
    try:
        hours, totals, lines = read(arguments.samples, arguments.device_memory)
    except (OSError, ValueError) as error:
        sys.exit(str(error))
    print(table(hours, totals, lines))
    if arguments.plot:
        pathlib.Path(arguments.plot).write_text(plot(lines))
    sys.exit(any(line.grows for line in lines))


if __name__ == "__main__":
    main()

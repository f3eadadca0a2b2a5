#!/usr/bin/env python3
"""The judge of soak runs finds a leak of a known size, and none where there is none."""
import contextlib
import io
import pathlib
import random
import sys
import tempfile
import unittest
from unittest import mock
from xml.etree import ElementTree

import judge

SECONDS = 600


def samples(leak_mb_per_hour=0.0, descriptors=lambda second: 6, seed=1):
    """Samples of a run with noise whose values depend on those before, as a process's do."""
    noise = random.Random(seed)
    rows, drift = [
        "second,frames,lost,trackers,cuts,losses,gaps,templates,growths,lost_devices,p99_ms,"
        "loop_error_mm,resident_mb,heap_mb,descriptors,threads"
    ], 0
    for second in range(1, SECONDS + 1):
        drift = 0.9 * drift + noise.gauss(0, 0.3)
        memory = 200 + drift + leak_mb_per_hour * second / 3600 + 40 * (1 - 0.9**second)
        loop = f"{0.006 + noise.gauss(0, 0.001):.4f}" if second % 3 == 0 else ""
        rows.append(
            f"{second},30,1,20,0,0,0,0,0,0,{30 + noise.gauss(0, 5):.2f},{loop},{memory:.3f},"
            f"{memory / 2:.3f},{descriptors(second)},8"
        )
    return "\n".join(rows) + "\n"


class Judge(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def judged(self, text, *options):
        (self.folder / "samples.csv").write_text(text)
        output = io.StringIO()
        with mock.patch.object(
            sys, "argv", ["judge.py", str(self.folder / "samples.csv"), *options]
        ):
            with contextlib.redirect_stdout(output), self.assertRaises(SystemExit) as ended:
                judge.main()
        rows = [
            line.strip("| ").split(" | ")
            for line in output.getvalue().splitlines()
            if line.startswith("| ")
        ]
        return ended.exception.code, {row[0]: row[-1] for row in rows[1:]}, output.getvalue()

    def test_a_line_without_noise(self):
        start, slope, half_width = judge.fit([(t, 3 + 2 * t) for t in range(20)])
        self.assertAlmostEqual(start, 3)
        self.assertAlmostEqual(slope, 2)
        self.assertAlmostEqual(half_width, 0)

    def test_the_interval_holds_the_slope_as_often_as_it_says(self):
        held = 0
        for seed in range(400):
            noise = random.Random(seed)
            _, slope, half_width = judge.fit(
                [(t, 5 * t + noise.gauss(0, 40)) for t in range(judge.BLOCKS)]
            )
            held += abs(slope - 5) <= half_width
        self.assertTrue(0.92 <= held / 400 <= 0.98, held)

    def test_no_leak(self):
        for seed in range(5):
            code, grows, text = self.judged(samples(seed=seed))
            self.assertEqual((code, set(grows.values())), (0, {"no", "not judged"}), text)

    def test_a_leak_of_memory(self):
        code, grows, text = self.judged(samples(leak_mb_per_hour=60))
        self.assertEqual(
            (code, grows["resident memory, peak"], grows["heap in use, peak"]),
            (1, "yes", "yes"),
            text,
        )

    def test_a_leak_of_descriptors(self):
        code, grows, text = self.judged(samples(descriptors=lambda second: 6 + second // 100))
        self.assertEqual(
            (code, grows["file descriptors, peak"], grows["resident memory, peak"]),
            (1, "yes", "no"),
            text,
        )

    def test_memory_of_a_device(self):
        memory = self.folder / "memory.txt"
        memory.write_text("".join(f"{1000 + second}\n" for second in range(300)))
        code, grows, _ = self.judged(samples(), "--device-memory", str(memory))
        self.assertEqual((code, grows["device memory, peak"]), (1, "yes"))

    def test_totals(self):
        self.assertIn(
            f"10.0 minutes: {30 * SECONDS} frames, {SECONDS} lost, {20 * SECONDS} trackers",
            self.judged(samples())[2],
        )

    def test_a_run_that_is_too_short(self):
        code, _, _ = self.judged("\n".join(samples().splitlines()[:12]))
        self.assertIn("too short", code)

    def test_without_errors_the_rest_is_judged(self):
        lines = [line.split(",") for line in samples().splitlines()]
        error = lines[0].index("loop_error_mm")
        _, grows, text = self.judged(
            "\n".join(
                ",".join([*line[:error], line[error] if i == 0 else "", *line[error + 1 :]])
                for i, line in enumerate(lines)
            )
        )
        self.assertEqual((len(grows), "error at the end of a loop" in grows), (5, False), text)

    def test_the_plot_has_a_panel_for_each_quantity(self):
        path = self.folder / "plot.svg"
        self.judged(samples(), "--plot", str(path))
        lines = ElementTree.parse(path).findall("{http://www.w3.org/2000/svg}polyline")
        self.assertEqual(len(lines), 2 * 6)


if __name__ == "__main__":
    unittest.main()

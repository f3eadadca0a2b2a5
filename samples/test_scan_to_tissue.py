"""Runs scan_to_tissue on a reference sequence, and compares with its truth.

usage: test_scan_to_tissue.py SEQUENCE CAMERA WORK_FOLDER PROGRAM...

The scan is the true surface of the first frame, in a frame of its own that is turned and shifted
against the camera's. Its landmarks are places of that surface. Its targets are so too; where the
sequence has targets beneath the surface, they are a tumour there.
"""
import csv
import math
import pathlib
import shutil
import subprocess
import sys

TURN, SHIFT = 2.1, (-40.0, 25.0, 900.0)  # rad, mm: where the scanner stood
MOST_ERROR_MM, MOST_MEDIAN_MM = 1.0, 0.5
TUMOUR_DEPTH_MM, TUMOUR_RADIUS_MM = (5.0, 20.0), 15.0  # about the camera's axis


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def place(row):
    return tuple(float(row[axis]) for axis in "xyz")


def to_scan(p):
    """A place of the camera's frame, in the scan's."""
    c, s = math.cos(TURN), math.sin(TURN)
    x, y, z = (c * p[0] + s * p[2], p[1], -s * p[0] + c * p[2])
    return x + SHIFT[0], y + SHIFT[1], z + SHIFT[2]


def write(path, header, lines):
    path.write_text("\n".join([header, *(",".join(map(str, line)) for line in lines)]) + "\n")


def grid_triangles(pixels):
    """Triangles between neighbours of the grid on which the points lie in the first image."""
    columns = sorted({pixel[0] for pixel in pixels.values()})
    lines = sorted({pixel[1] for pixel in pixels.values()})
    at = {pixel: point for point, pixel in pixels.items()}
    for upper, lower in zip(lines, lines[1:]):
        for left, right in zip(columns, columns[1:]):
            corners = [at.get(c) for c in ((left, upper), (right, upper), (left, lower))]
            corners.append(at.get((right, lower)))
            if None not in corners:
                a, b, c, d = corners
                yield from ((a, b, c), (b, d, c))


def prepare(sequence, work):
    pixels = {
        row["id"]: (float(row["u"]), float(row["v"])) for row in rows(sequence / "points.csv")
    }
    truth = {(int(row["frame"]), row["id"]): row for row in rows(sequence / "truth.csv")}
    seen = {point: pixel for point, pixel in pixels.items() if (0, point) in truth}
    index = {point: i + 1 for i, point in enumerate(seen)}
    with open(work / "scan.obj", "w") as file:
        for point in seen:
            file.write("v {} {} {}\n".format(*to_scan(place(truth[0, point]))))
        for triangle in grid_triangles(seen):
            file.write("f {} {} {}\n".format(*(index[point] for point in triangle)))
    order = sorted(seen, key=int)
    landmarks = [order[i * (len(order) - 1) // 6] for i in range(7)]
    write(
        work / "landmarks.csv",
        "x,y,z,u,v",
        [(*to_scan(place(truth[0, point])), *seen[point]) for point in landmarks],
    )
    targets = {point: place(truth[0, point]) for point in order[5:-5:4]}
    if (sequence / "truth_deep.csv").exists():
        targets = {
            row["id"]: place(row)
            for row in rows(sequence / "targets.csv")
            if TUMOUR_DEPTH_MM[0] <= float(row["depth"]) <= TUMOUR_DEPTH_MM[1]
            and math.hypot(*place(row)[:2]) < TUMOUR_RADIUS_MM
        }
        truth = {(int(row["frame"]), row["id"]): row for row in rows(sequence / "truth_deep.csv")}
    write(work / "targets.csv", "id,x,y,z", [(t, *to_scan(p)) for t, p in targets.items()])
    return truth


def middle_error(frame, found, truth):
    """How far the middle of the targets is off in a frame, mm."""
    pairs = [
        (place(row), place(truth[int(frame), row["id"]])) for row in found if row["frame"] == frame
    ]
    return math.dist(*([sum(axis) / len(pairs) for axis in zip(*side)] for side in zip(*pairs)))


def main():
    sequence, camera, work, *program = sys.argv[1:]
    sequence, work = pathlib.Path(sequence), pathlib.Path(work)
    work.mkdir(parents=True, exist_ok=True)
    truth = prepare(sequence, work)
    given = [str(work / name) for name in ("scan.obj", "landmarks.csv", "targets.csv", "out.csv")]
    run = [*program, str(sequence / "left"), str(sequence / "right"), camera, *given, "cpu"]
    said = subprocess.run(run, check=True, stdout=subprocess.PIPE, text=True).stdout
    assert "surface: " in said and "not determined" not in said, said
    errors, ratios = [], []
    for row in rows(work / "out.csv"):
        right = truth[int(row["frame"]), row["id"]]
        if row["status"] == "lost" or right.get("visible", "1") != "1":
            continue
        if "visible" in right and row["status"] != "tracked":
            continue
        errors.append(math.dist(place(row), place(right)))
        ratios.append(errors[-1] / float(row["expected_error_mm"]))
    frames = {row["frame"] for row in rows(work / "out.csv")}
    errors.sort()
    median, share = errors[len(errors) // 2], sum(ratio < 3 for ratio in ratios) / len(ratios)
    found = sum(error < MOST_ERROR_MM for error in errors) / len(errors)
    print(
        f"{said}{len(errors)} positions in {len(frames)} frames: median {median:.3f} mm, largest"
        f" {errors[-1]:.3f} mm,"
        f" {100 * found:.1f} % within {MOST_ERROR_MM} mm, {100 * share:.1f} % within 3 expected"
        " errors"
    )
    assert len(frames) > 5 and len(errors) > 100
    assert median < MOST_MEDIAN_MM and found > 0.95 and share > 0.95
    if (sequence / "truth_deep.csv").exists():
        middles = [middle_error(frame, rows(work / "out.csv"), truth) for frame in frames]
        print(f"the tumour's middle is off by at most {max(middles):.3f} mm")
        assert max(middles) < MOST_ERROR_MM

    # Landmarks are pixels of the first image, and are not looked for in a later one.
    other_scene = pathlib.Path(__file__).with_name("other_scene.py")
    shutil.rmtree(work / "black", ignore_errors=True)
    subprocess.run(
        [sys.executable, "-B", other_scene, "black", sequence, work / "black"], check=True
    )
    images = [str(work / "black" / view) for view in ("left", "right")]
    black = [*program, *images, camera, *given[:-1], str(work / "black.csv"), "cpu"]
    refused = subprocess.run(black, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    assert refused.returncode == 1 and "which shows no surface" in refused.stderr, refused

    # Landmarks that contradict each other end the program, with the reason.
    lines = (work / "landmarks.csv").read_text().splitlines()
    swapped = [
        lines[0],
        *(f"{a.rsplit(',', 2)[0]},{b.split(',', 3)[3]}" for a, b in zip(lines[1:], lines[:0:-1])),
    ]
    (work / "landmarks.csv").write_text("\n".join(swapped) + "\n")
    run[-2] = str(work / "refused.csv")
    refused = subprocess.run(run, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    assert refused.returncode == 1 and "the landmarks give no start" in refused.stderr, refused


main()

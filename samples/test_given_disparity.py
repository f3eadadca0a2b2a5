"""Runs given_disparity on a reference sequence with the disparity of sample stereo_only, and
compares with `defrec track --disparity`.

usage: test_given_disparity.py SEQUENCE CAMERA WORK_FOLDER DEFREC STEREO_ONLY PROGRAM...
"""
import array
import math
import pathlib
import re
import shutil
import subprocess
import sys

SIGMA = "0.3"  # px


def write_pfm(path, width, height, values):
    """values: rows from the top."""
    rows = [values[y * width : (y + 1) * width] for y in range(height)]
    turned = array.array("f", [value for row in reversed(rows) for value in row])
    if sys.byteorder == "big":
        turned.byteswap()
    path.write_bytes(b"Pf\n%d %d\n-1.0\n" % (width, height) + turned.tobytes())


def read_pgm(path):
    """What stereo_only writes, in px; inf where there is none, as networks' files have it."""
    header = re.match(rb"P5\n(\d+) (\d+)\n65535\n", data := path.read_bytes())
    values = array.array("H", data[header.end() :])
    if sys.byteorder == "little":
        values.byteswap()
    return int(header[1]), int(header[2]), [v / 16 if v > 0 else math.inf for v in values]


def write_maps(sequence, work, stereo_only):
    """Disparity of each frame, and as its error SIGMA at each pixel."""
    for name in ("disparity", "sigma"):
        (work / name).mkdir()
    for left in sorted((sequence / "left").glob("*.png")):
        right, made = sequence / "right" / left.name, work / "disparity.pgm"
        subprocess.run([stereo_only, left, right, made, "cpu"], check=True)
        width, height, values = read_pgm(made)
        write_pfm(work / "disparity" / f"{left.stem}.pfm", width, height, values)
        write_pfm(
            work / "sigma" / f"{left.stem}.pfm", width, height, [float(SIGMA)] * (width * height)
        )


def main():
    sequence, camera, work, defrec, stereo_only, *program = sys.argv[1:]
    sequence, work = pathlib.Path(sequence), pathlib.Path(work)
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    write_maps(sequence, work, stereo_only)
    images = [sequence / "left", sequence / "right"]

    def sample(disparity, sigma, out):
        command = [*program, *images, camera, disparity, sigma, sequence / "points.csv"]
        return subprocess.run([*command, work / out, "cpu"], capture_output=True, text=True)

    def fails(pattern, disparity, sigma):
        ended = sample(disparity, sigma, "none.csv")
        if ended.returncode != 1 or not re.search(pattern, ended.stderr):
            sys.exit(
                f"exit code {ended.returncode}, 1 expected and {pattern!r}; it said:\n"
                f"{ended.stderr}"
            )

    track = [defrec, "track", "--left", images[0], "--right", images[1]]
    track += ["--calibration", sequence / "calibration.yaml", "--points", sequence / "points.csv"]
    track += ["--disparity", work / "disparity", "--disparity-sigma", SIGMA]
    track += ["--backend", "cpu", "--no-overlay", "--quiet", "--out", work / "tracked"]
    subprocess.run(track, check=True)
    for sigma, out in ((SIGMA, "points.csv"), (work / "sigma", "mapped.csv")):
        ended = sample(work / "disparity", sigma, out)
        if ended.returncode != 0 or not re.fullmatch(
            r"(\d+) frames, in 0 of them the images contradict the disparity\n", ended.stdout
        ):
            sys.exit(f"exit code {ended.returncode}:\n{ended.stdout}{ended.stderr}")
        compare = pathlib.Path(__file__).with_name("compare_points.py")
        subprocess.run(
            [sys.executable, "-B", compare, work / "tracked/points.csv", work / out], check=True
        )

    fails("DEFREC_ERROR_ARGUMENT|sigma", work / "disparity", "0")
    fails("soon", work / "disparity", "soon")
    fails("absent", work / "absent", SIGMA)
    shutil.copytree(work / "disparity", work / "changed")
    first = sorted((work / "changed").iterdir())[0]
    whole = first.read_bytes()
    first.write_bytes(whole[:-1])
    fails(f"{first.name}: is cut off", work / "changed", SIGMA)
    write_pfm(first, 2, 1, [1, 2])
    fails(f"{first.name}: is 2x1, the rectified image is 320x240", work / "changed", SIGMA)
    first.write_bytes(whole.replace(b"Pf", b"PF"))
    fails(f"{first.name}: a PFM of one channel expected", work / "changed", SIGMA)
    first.unlink()
    fails("changed has 11 PFM files, but there are 12 frames", work / "changed", SIGMA)


if __name__ == "__main__":
    main()

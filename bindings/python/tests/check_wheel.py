"""Installs the wheel of a folder into a fresh environment, and tracks with it from a folder
elsewhere: check_wheel.py WHEELS FOLDER"""
import os
import pathlib
import shutil
import subprocess
import sys

wheels, folder = (pathlib.Path(argument).resolve() for argument in sys.argv[1:])
(wheel,) = wheels.glob("*.whl")
shutil.rmtree(folder, ignore_errors=True)
environment = {
    name: value
    for name, value in os.environ.items()
    if not name.startswith(("PYTHON", "LD_", "PIP_"))
}


def run(*command):
    subprocess.run(command, check=True, env=environment, cwd="/")


run(sys.executable, "-m", "venv", folder)
python = folder / "bin" / "python3"
run(
    python,
    "-m",
    "pip",
    "--disable-pip-version-check",
    "install",
    "--quiet",
    "--no-index",
    "--no-cache-dir",
    wheel,
)
(notices,) = folder.glob("lib/python3*/site-packages/defrec-*.dist-info/notices.txt")
assert "\neigen " in notices.read_text(), "the wheel contains Eigen, whose licence goes with it"
assert '"CycloneDX"' in notices.with_name("bom.json").read_text()
assert '"SPDX-2.3"' in notices.with_name("bom.spdx.json").read_text()
shutil.copy(pathlib.Path(__file__).parent / "plane.py", folder)
run(
    python,
    "-I",
    "-c",
    f"""
import importlib.util, sys
sys.path.insert(1, {str(folder)!r})
import defrec, plane
assert importlib.util.find_spec("numpy") is None, "the environment is not fresh"
assert defrec._library.path.startswith({str(folder)!r}), defrec._library.path
with defrec.Context() as context:
    for plugin in context.plugins:
        assert plugin.verdict == defrec.Status.OK, plugin
        assert plugin.path.startswith({str(folder)!r}), plugin
    rig = defrec.Rig.rectified(context, plane.WIDTH, plane.HEIGHT, plane.CAMERA)
    tracker = defrec.Tracker(context, rig, "cpu", format=defrec.Format.GRAY8)
    for frame in range(3):
        result = tracker.track(*plane.pair(frame), frame)
        assert result.state == defrec.State.TRACKING, result.state
    x, y, z = tracker.template().lift([(plane.CAMERA.cx, plane.CAMERA.cy)]).xyz.tolist()[0]
    assert abs(z - plane.DEPTH_MM) < 0.5, z
    print("tracked with", [plugin.name for plugin in context.plugins])
""",
)

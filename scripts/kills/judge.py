"""Judges what a killed `defrec track` left: nothing finished is lost, nothing half looks whole.

A run's own results are known, since a run that is repeated writes the same bytes, but for the times
in frames.csv, report.html and summary.json.
"""
import hashlib
import json
import pathlib

SUMMARY = "summary.json"
MESHES = "deformed"
TIMED = ("frames.csv", "report.html")  # they hold times, so their bytes differ from run to run


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def is_partial(name):
    return ".defrec-" in name and ".partial" in name


def files_of(folder):
    """SHA-256 of each file in the folder and of its meshes by name, without what is partial."""
    return {
        str(path.relative_to(folder)): digest(path)
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not is_partial(path.name)
    }


def partial_files(folder):
    return sorted(
        path.name for path in folder.rglob("*") if path.is_file() and is_partial(path.name)
    )


class Run:
    """A run that ended by itself: its files, and how many frames it has."""

    def __init__(self, folder, template):
        self.files = files_of(folder)
        self.summary = json.loads((folder / SUMMARY).read_text())
        self.rows = rows_of(folder / "frames.csv")
        self.template = digest(template)


def rows_of(path):
    text = path.read_text()
    return text.count("\n") - 1 if text.endswith("\n") else None


def is_whole_timed(path, rows):
    if path.name == "frames.csv":
        return rows_of(path) == rows
    return path.read_text().rstrip().endswith("</html>")


def summary_faults(folder, earlier, new):
    """Faults of a folder that says it holds a finished run."""
    try:
        summary = json.loads((folder / SUMMARY).read_text())
    except ValueError:
        return ["summary.json is torn"]
    is_earlier = earlier is not None and summary == earlier.summary
    expected = earlier if is_earlier else new
    names = set(expected.files)
    found = files_of(folder)
    faults = [f"{name} is missing beside a summary" for name in sorted(names - set(found))]
    faults += [f"{name} is of another run" for name in sorted(set(found) - names)]
    for entry in summary["files"]:
        path = folder / entry["name"]
        if path.is_file() and (
            path.stat().st_size != entry["bytes"] or digest(path) != entry["sha256"]
        ):
            faults.append(f"{entry['name']} is not as summary.json says")
    for name in sorted(names & set(found)):
        known_by_bytes = is_earlier or (name not in TIMED and name != SUMMARY)
        if known_by_bytes and found[name] != expected.files[name]:
            faults.append(f"{name} is not the finished run's")
    return faults


def file_faults(folder, earlier, new):
    """Faults of a folder without a summary: a file that has its name must be whole."""
    faults = []
    for name, found in files_of(folder).items():
        runs = [run for run in (earlier, new) if run is not None]
        if any(run.files.get(name) == found for run in runs):
            continue
        if name not in TIMED or not is_whole_timed(folder / name, new.rows):
            faults.append(f"{name} is torn")
    return faults


def judge(folder, template, earlier, new):
    """Faults of what a killed run left.

    folder: its --out; may be absent. template: its --save-template. earlier: the finished run that
    was in the folder before, or None. new: the killed run as it would have ended.
    """
    if template.exists():
        known = {run.template for run in (earlier, new) if run is not None}
        faults = [] if digest(template) in known else ["the saved template is torn"]
    else:
        faults = ["the earlier saved template is lost"] if earlier is not None else []
    if not folder.exists():
        return faults + (["the folder is lost"] if earlier is not None else [])
    judged = summary_faults if (folder / SUMMARY).exists() else file_faults
    return faults + judged(folder, earlier, new)

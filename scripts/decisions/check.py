#!/usr/bin/env python3
"""Finds numbers that decide something, in the rooms that header.py lists, and stand in no
header.

usage: check.py [FOLDER]

FOLDER holds the tree, by default this repository. What is found:

- a number in an operand of a comparison (<, >, <=, >=), but for 0, 1, 2, for those in subscripts,
  and for the count of a loop (`i < 3` in the head of a `for`);
- a constexpr with a number of its own, but for 0, 1, 2, that is of floating point or stands in an
  operand of a comparison;
- any other number with a fraction, but for one half;
- a number of a header that nothing uses.

ALLOWED lists what decides nothing, with the reason. An entry that allows nothing is an error.
"""
import pathlib
import re
import sys

import header

# (file below sdk, a part of the statement as it stands there, in one line): the reason.
ALLOWED = {
    ("api/fixed_frame.cpp", "kTolerance = 1e-6"): "range of a parameter of the C API",
    ("api/handles.cpp", "kSerialMask = "): "bits of a handle",
    ("api/read.hpp", "max() / 64"): "range of a parameter of the C API",
    ("api/tracking.cpp", "kTolerance = 1e-3, kMaxMm = 1e6"): "range of a parameter of the C API",
    ("body/body_description.cpp", "kLeast = 0.01f"): "range of a parameter of the C API",
    ("body/body_description.hpp", "poisson_ratio = 0.43"): "default of a parameter of the C API",
    ("body/body_motion.cpp", "kLeastWeight = 1e-3f"): "no division by rounding",
    ("body/body_motion.cpp", "std::max(handles.evidence.sum(), 1e-3)"): "no division by 0",
    ("body/deep_motion.cpp", "kSums = 4"): "how sums are shared between registers",
    ("body/body_piece.cpp", "std::max(kept, 1e-12f)"): "no division by 0",
    ("body/body_shape.cpp", "kSamples = 3"): "points that measure a share of a cell",
    ("body/body_shape.cpp", "< 0.5 * cut.width * edge"): "half a width",
    ("body/closed_mesh.cpp", "kMaxCellsPerTriangle = 10"): "buckets of an index",
    ("body/closed_mesh.cpp", "kShareLines = 4"): "lines that measure a share of a cell",
    ("body/closed_mesh.cpp", "margin = 1e-6 * height"): "rounding",
    ("body/closed_mesh.cpp", "kLeafTriangles = 4"): "leaves of an index",
    ("body/closed_mesh.cpp", "mesh.triangle_count < 4"): "no closed mesh has fewer",
    ("body/closed_mesh.cpp", "at.size() > 100"): "length of a message",
    ("body/closed_mesh.cpp", "i < vertices_.size() / 3"): "coordinates of a place",
    ("body/closed_mesh.cpp", "kShift = 0.4637"): "between the coordinates that meshes have",
    ("body/closed_mesh.cpp", "kCentimetre = 10"): "a unit",
    ("body/deep_motion.cpp", "kRounds = 16"): "rounds until nothing changes",
    ("body/deep_motion.cpp", "kLeastSpread = 2e-3"): "a row of points has no turn",
    ("body/deep_motion.cpp", "kStillMm = 1e-4"): "rounds until nothing changes",
    ("body/deep_motion.cpp", "kHalvings = 14"): "rounds until nothing changes",
    ("body/deep_motion.cpp", "std::max(weight.sum(), 1e-12)"): "no division by 0",
    ("body/deep_motion.cpp", "kLeastShare = 1e-3"): "a share that changes nothing is not computed",
    ("body/deep_motion.cpp", "angle > 1e-12"): "no division by 0",
    ("body/lattice.cpp", "BodyCells::kCoarseDistance + 0.5"): "from the middle of a cell",
    ("calibration/board.cpp", "board.across < 4"): "no board has fewer",
    ("calibration/board.cpp", "window.width < 3"): "no step in less",
    ("calibration/board.cpp", "50, 1e-3"): "rounds until nothing changes",
    ("calibration/board_frames.cpp", "cv::norm(shift), 1e-9"): "no logarithm of 0",
    ("calibration/stereo_solution.cpp", "100, 1e-9"): "rounds until nothing changes",
    ("doctor/exposure.cpp", "kLevels = 256"): "range of a gray value",
    ("doctor/rig_trial.cpp", "kTolerance = 1e-2"): "rounding of a calibration in a file",
    ("doctor/rig_trial.cpp", "focal_length = 0.25"): "a mean of four",
    ("doctor/row_fit.cpp", "normal = 1e-9"): "keeps a matrix invertible",
    ("doctor/rows.cpp", "kDegrees = "): "a unit",
    ("hand_eye/hand_eye.cpp", "kDegree = "): "a unit",
    ("hand_eye/program/hand_eye_json.cpp", "kDegree = "): "a unit",
    ("hand_eye/program/pose_file.cpp", "kColumns = 8"): "columns of a file",
    ("hand_eye/program/run_hand_eye.cpp", "kDegree = "): "a unit",
    ("hand_eye/rotation_spread.cpp", "kRounds = 5"): "rounds until nothing changes",
    ("hand_eye/uncertainty.cpp", "kHundred = 100"): "what is printed",
    ("session/display_prediction.cpp", "kNanosecondsPerMs = "): "a unit",
    ("predictor/frame_interval.cpp", "kLatest = "): "a unit",
    ("predictor/predictor.cpp", "kNanosecond = "): "a unit",
    ("predictor/predictor.cpp", "kNanosecondsPerMs = "): "a unit",
    ("io/calibration_check.cpp", "kMillimetresPerMetre = 1000"): "a unit",
    ("io/csv.cpp", "kLongestHeader = 65536"): "range of a file",
    ("io/image_header.cpp", "at + 4 <= bytes.size()"): "bytes of a marker",
    ("io/image_header.cpp", "marker >= 0xC0"): "markers of JPEG",
    ("io/obj_file.cpp", "count < 3"): "a face has three corners",
    ("io/statistics.hpp", "kParts = 8"): "parts of a run whose medians are compared",
    ("io/stl_file.cpp", "kHeader = 84"): "range of a file",
    ("io/text.cpp", "text.size() <= 5"): "length of a word",
    ("io/text.cpp", "kLongestCompared = 64"): "length of a word",
    ("io/text.cpp", "byte < 0x20"): "control characters",
    ("io/text.cpp", "< 0xA0"): "control characters",
    ("io/text.cpp", "byte >= 0x20"): "control characters",
    ("io/yaml_document.cpp", "kDeepestNesting = 16"): "range of a file",
    ("plan/plan.cpp", "kFewest = 1024"): "how threads share work",
    ("api/tracking.cpp", "kMaxStride = 1 << 20"): "range of a parameter of the C API",
    ("tracking/monitors/disparity_check.cpp", "kOne = 256"): "a unit",
    ("registration/program/inputs.cpp", "at->size() >= 3"): "rows of a matrix",
    ("registration/program/doubtful_targets.cpp", "kMostNamed = 5"): "what is printed",
    ("registration/program/likely_causes.cpp", "kLeastPairs = 3"): "fix a rigid motion",
    ("registration/program/register_json.cpp", "kMostShown = 10"): "what is printed",
    ("registration/program/register_picture.cpp", "0.92 * kPanel"): "a margin of a picture",
    ("registration/program/register_picture.cpp", "kBar = 300"): "a size in a picture",
    ("registration/program/register_calls.cpp", "kDegree = "): "a unit",
    ("registration/triangle_tree.cpp", "kLeafTriangles = 4"): "leaves of an index",
    ("registration/uncertainty.cpp", "kDegree = "): "a unit",
    ("session/camera_trajectory.cpp", "kMillisecondsInSecond = 1000"): "a unit",
    ("session/points.cpp", "point.u < -0.5"): "half a pixel",
    ("session/track_summary.cpp", '"p99_ms"'): "the percentile that its name says",
    ("rig/lens.cpp", "kDifference = 1e-6"): "step of a numeric derivative",
    ("rig/lens.cpp", "kDirections = 64"): "directions in which a fold is looked for",
    ("rig/lens.cpp", "kSteps = 4096"): "steps in which a fold is looked for",
    ("rig/lens.cpp", "kLargeSteps = 256"): "steps in which a fold is looked for",
    ("rig/lens.cpp", "kAccuracy = 1e-12"): "rounds until nothing changes",
    ("rig/lens.cpp", "share > 1e-4"): "rounds until nothing changes",
    ("rig/rig.cpp", "< 1e-9"): "rounding of a calibration",
    ("rig/rig.cpp", "desc_.right.fy, 0.25"): "a mean of four",
    ("rig/rig.cpp", "kMapUnit = 128"): "a unit",
    ("rig/rig_check.cpp", "kDegree = "): "a unit",
    ("rig/rig_check.hpp", "kSteps = 16"): "pixels that stand for all",
    ("template/file.cpp", "kMaxParts = "): "range of a file",
    ("template/file.cpp", "kMaxCuts = "): "range of a file",
    ("template/file.cpp", "poisson_ratio, 0.0099, 0.4951"): "range of a parameter of the C API",
    ("template/file.cpp", "cut_depth_mm, 0.09, 1000"): "range of a parameter of the C API",
    ("template/file.cpp", "stiffness, 0.009, 1000"): "range of a parameter of the C API",
    ("template/grid_distance.cpp", "kCorner = 1.41421356f"): "a diagonal",
    ("template/grid_distance.cpp", "kBlock = 8"): "columns of a vector loop",
    ("template/new_tissue.cpp", "std::abs(area) < 1e-9"): "no division by 0",
    ("template/new_tissue.cpp", "< -1e-6"): "rounding",
    ("template/scattered_blend_weights.cpp", "< -1e-9"): "rounding",
    ("template/surface.cpp", "Identity() * 1e-6"): "keeps a matrix invertible",
    ("template/surface.cpp", "kNoPull = 1e-9"): "keeps a matrix invertible",
    ("template/surface_index.cpp", "determinant > 1e-12"): "no division by 0",
    ("template/template.cpp", "std::abs(u) < 1e6"): "range of a pixel that an index can hold",
    ("template/template.cpp", "i < data_.nodes.size() / 3"): "coordinates of a place",
    ("template/template.cpp", "nearest[k].first + 1e-3"): "no division by 0",
    ("template/template.cpp", "u >= -0.5 && v >= -0.5"): "border of an image of pixels",
    ("template/template.cpp", "sum > 1e-6"): "no division by rounding",
    ("tracking/evidence/photometric_evidence.cpp", "> 1e-3f"): "no division by rounding",
    ("tracking/evidence/vertex_confidence.cpp", "kFew = 64"): "vertices of a vector loop",
    ("tracking/evidence/vertex_confidence.cpp", "kFew = 32"): "vertices of a vector loop",
    ("tracking/frame/frame_input.cpp", "kBand = "): "how threads share a copy",
    ("tracking/frame/frame_input.cpp", "kShare = "): "how threads share a copy",
    ("tracking/frame/gray_copy.cpp", "kGroup = 4"): "layout of a vector's bytes",
    ("tracking/frame/gray_copy.cpp", "kGreenWithRed = 51"): "split of a weight",
    ("tracking/frame/gray_copy.cpp", "static_assert(255 * "): "range of the sum",
    ("tracking/frame_queue.cpp", "kMaxGap = "): "range of time stamps that the C API takes",
    ("tracking/job.cpp", "kFew = 32"): "how threads share points",
    ("tracking/map/piece_search.cpp", "agree.size() >= 3"): "three points fix a rigid motion",
    ("tracking/monitors/frame_state.cpp", "16 * sums.two_apart"): "a unit",
    ("tracking/monitors/lifted_region.cpp", "std::max(1e-6, "): "no division by 0",
    ("tracking/monitors/lifted_tissue.cpp", "weight > 0.5f"): "more than half",
    ("tracking/monitors/row_monitor.cpp", "kLag = 4"): "place of a value",
    ("tracking/monitors/row_monitor.cpp", "kValues = 5"): "number of values",
    ("tracking/monitors/row_monitor.cpp", "kOne = 256"): "a unit",
    ("tracking/monitors/side_levels.cpp", "kSlopeDamping = 1e-3"): "keeps a matrix invertible",
    ("tracking/points/lift_pixels.cpp", "kBucketPx = 16"): "buckets of an index",
    ("tracking/points/lift_pixels.cpp", "/ 2 + 1e-3"): "rounding",
    ("tracking/points/lift_pixels.cpp", "share < -1e-9"): "rounding",
    ("tracking/points/lift_pixels.cpp", "position >= -0.5"): "border of an image of pixels",
    ("tracking/points/lift_pixels.cpp", "kRounds = 6"): "rounds until nothing changes",
    ("tracking/points/unseen_cells.cpp", "std::max(1e-3, "): "no division by 0",
    ("tracking/points/unseen_kriging.cpp", "kLeaf = 16"): "how a matrix is parted",
    ("tracking/points/unseen_modes.cpp", "kJitter = 1e-6"): "keeps a matrix invertible",
    ("tracking/points/point_carrier.cpp", "kNothing = 1e-6"): "no division by 0",
    ("tracking/points/point_carrier.cpp", "std::max(trace, 1e-9)"): "no division by 0",
    ("tracking/points/prepared_set.cpp", "kRun = 16'384"): "how threads share work",
    ("tracking/stages/check_output.cpp", "kMaxScore = 4096"): "ranges of a plugin's records",
    ("tracking/stages/check_output.cpp", "kFar = "): "range of a plugin's records",
    ("tracking/stages/check_output.cpp", "kMaxLevels = 8"): "range of a plugin's records",
    ("tracking/tracker.cpp", "> 1e-6 * camera."): "rounding of a calibration in a file",
}

NUMBER = re.compile(
    r"(?<![\w.])(?:0x[0-9a-f]+|(?:\d[\d']*\.?\d*|\.\d+)(?:e[-+]?\d+)?)[ful]*(?![\w.])",
    re.IGNORECASE,
)
COMPARISON = re.compile(r"(?<=\s)(?:<=|>=|<|>)(?=\s)")
CONSTEXPR = re.compile(r"\bconstexpr\s(?P<type>[^;(){}=]*?)(?P<rest>\w+(?:\[\])? =[^;]*);")
INITIALISER = re.compile(r"(\w+)(?:\[\])? =((?:[^,{(]|\{[^{}]*\}|\([^()]*\))*)")
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
COMMENT_OR_STRING = re.compile(
    r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|(?<![\w])\'(?:\\.|[^\'\\])\'', re.DOTALL
)
HARMLESS = (0, 1, 2)
REACH = 400  # characters to either side of a comparison: an operand is shorter
LEFT_ENDS = re.compile(r"[;{}?,=]|&&|\|\||(?<!:):(?!:)|\breturn\b")
RIGHT_ENDS = re.compile(r"[;{}?,]|&&|\|\||(?<!:):(?!:)")


def blank(match):
    return re.sub(r"[^\n]", " ", match[0])


def code_of(text):
    """The text, as long as it was, without comments, strings, includes and template arguments."""
    code = COMMENT_OR_STRING.sub(blank, text)
    code = re.sub(r"^[ \t]*#[^\n]*", blank, code, flags=re.MULTILINE)
    return re.sub(r"(?<=\w)<[\w:]*(?:, *[\w:]+)*>", blank, code)


def value_of(number):
    text = number.replace("'", "").lower()
    return int(text.rstrip("ul"), 16) if text.startswith("0x") else float(text.rstrip("ful"))


def numbers_in(text, harmless):
    """Numbers of an expression, but for harmless ones and those in subscripts."""
    while "[" in text:
        without = re.sub(r"\[[^\[\]]*\]", "", text)
        if without == text:
            break
        text = without
    return [found[0] for found in NUMBER.finditer(text) if value_of(found[0]) not in harmless]


def operand(text, ends, step):
    """As far as an operand reaches from the end of a text (step -1) or from its begin (1)."""
    depth, opens, closes = 0, ("([", ")]")[step < 0], (")]", "([")[step < 0]
    places = {match.start() if step > 0 else match.end() - 1 for match in ends.finditer(text)}
    at = 0 if step > 0 else len(text) - 1
    while 0 <= at < len(text):
        if text[at] in opens:
            depth += 1
        elif text[at] in closes:
            depth -= 1
        if depth < 0 or (depth == 0 and at in places):
            break
        at += step
    return text[:at] if step > 0 else text[at + 1 :]


def is_loop_count(before, right):
    """Whether a comparison stands in the second part of the head of a for, with a whole number."""
    head = re.search(r"\bfor \([^;{}]*;[^;{}]*$", before)
    return head is not None and re.fullmatch(r"\s*\d+\s*", right) is not None


def compared(code):
    """(place, operands) of each comparison that is not the end of a loop over a count."""
    for match in COMPARISON.finditer(code):
        before, after = code[: match.start()][-REACH:], code[match.end() :][:REACH]
        right = operand(after, RIGHT_ENDS, 1)
        if not is_loop_count(before, right):
            yield match.start(), (operand(before, LEFT_ENDS, -1), right)


def comparisons(code):
    for at, operands in compared(code):
        yield at, [number for text in operands for number in numbers_in(text, HARMLESS)]


def constants(code):
    """Those of floating point, and those that something is compared with."""
    operands = " ".join(text for _, both in compared(code) for text in both)
    for match in CONSTEXPR.finditer(code):
        is_float = re.search(r"\b(?:float|double)\b", match["type"]) is not None
        for name, value in INITIALISER.findall(match["rest"]):
            if is_float or re.search(rf"\b{name}\b", operands):
                yield match.start("rest"), numbers_in(value, HARMLESS)


def fractions(code):
    for match in NUMBER.finditer(code):
        if value_of(match[0]) not in (0.5, int(value_of(match[0]))):
            yield match.start(), [match[0]]


def statement_at(text, at):
    """The lines of a statement, in one."""
    text = COMMENT.sub(blank, text)
    begin = max(text.rfind(end, 0, at) for end in ";{}") + 1
    ends = [place for place in (text.find(end, at) for end in ";{") if place >= 0]
    return " ".join(text[begin : min(ends, default=len(text))].split())


def bare_numbers(text):
    """line -> (statement, numbers) of a source."""
    code, found = code_of(text), {}
    for search in (comparisons, constants, fractions):
        for at, numbers in search(code):
            if numbers:
                line = code.count("\n", 0, at) + 1
                found.setdefault(line, (statement_at(text, at), []))[1].extend(numbers)
    return {
        line: (statement, list(dict.fromkeys(numbers)))
        for line, (statement, numbers) in sorted(found.items())
    }


def check_sources(tree, allowed):
    used = set()
    for path in header.sources(tree):
        for line, (statement, numbers) in bare_numbers((tree / path).read_text()).items():
            entries = [
                entry for entry in allowed if f"sdk/{entry[0]}" == path and entry[1] in statement
            ]
            used.update(entries)
            if not entries:
                yield f"{path}:{line}: {', '.join(numbers)} in: {statement}"
    for entry in allowed:
        if entry not in used:
            yield f"check.py allows what is not there: sdk/{entry[0]}: {entry[1]}"


def check_use(tree):
    for path in header.headers(tree):
        for decision in header.read((tree / path).read_text(), path):
            code = "".join(
                code_of((tree / user).read_text()) for user in header.users(tree, decision)
            )
            for number in decision.numbers:
                if re.search(rf"\b{number.symbol}\b", code) is None:
                    yield f"{path}: {decision.name}::{number.symbol} is used nowhere"


def check(tree, allowed):
    return [*check_sources(tree, allowed), *check_use(tree)]


def main():
    tree = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else header.ROOT
    errors = check(tree, ALLOWED)
    print(*errors, sep="\n", end="\n" if errors else "")
    sys.exit(1 if errors else 0)


if __name__ == "__main__":
    main()

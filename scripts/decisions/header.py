"""Reads headers of decision numbers, such as sdk/tracking/decisions/rig.hpp.

A struct is a decision, each `static constexpr` member of it a number. So is a member with a value
of a struct that is a base of TrackerSettings. The comment before a number is

    unit | what it decides | source

with `1` for no unit. The source is a formula, a measurement or the reasoning that fixed the number;
[name] is a page of docs/experiments; "set by hand" says that none is recorded. Lines of the
struct's comment may begin with "Source:", the source of the numbers that name none, and "Judged
again by:", a command. Lines that go on are indented.
"""
import dataclasses
import pathlib
import re
import textwrap

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = (
    "sdk/tracking",
    "sdk/template",
    "sdk/body",
    "sdk/rig",
    "sdk/api",
    "sdk/io",
    "sdk/input/compression",
    "sdk/calibration",
    "sdk/doctor",
    "sdk/registration",
    "sdk/hand_eye",
    "sdk/plan",
    "sdk/predictor",
    "sdk/session",
)
HEADERS = (  # a folder stands for those in it
    "sdk/tracking/decisions",
    "sdk/template/decisions.hpp",
    "sdk/body/decisions.hpp",
    "sdk/rig/decisions.hpp",
    "sdk/io/decisions.hpp",
    "sdk/input/compression/decisions.hpp",
    "sdk/calibration/decisions.hpp",
    "sdk/doctor/decisions.hpp",
    "sdk/registration/decisions.hpp",
    "sdk/registration/program/decisions.hpp",
    "sdk/hand_eye/decisions.hpp",
    "sdk/hand_eye/program/decisions.hpp",
    "sdk/predictor/decisions.hpp",
    "sdk/session/decisions.hpp",
)
TAGS = {"Source:": "source", "Judged again by:": "command"}
STRUCT = re.compile(r"^struct (\w+) \{$")
NUMBER = re.compile(
    r"(?:static constexpr (?P<type>[^=;]+?) (?P<name>k[A-Z]\w*)"
    r"|(?P<own_type>double|float) (?P<own_name>[a-z_0-9]+)) = (?P<value>.*);$"
)


class HeaderError(Exception):
    pass


@dataclasses.dataclass
class Number:
    symbol: str  # as in C++, kMinPatches; of a member of TrackerSettings, occluded_share
    value: str  # as in a table
    unit: str
    decides: str
    source: str

    @property
    def name(self):
        return re.sub(r"(?<!^)(?=[A-Z])", "_", self.symbol.removeprefix("k")).lower()


@dataclasses.dataclass
class Decision:
    name: str
    numbers: list
    source: str = ""
    command: str = ""


def comment_lines(lines):
    """The lines of a comment, each joined with those that go on."""
    made = []
    for line in lines:
        text = line.strip().removeprefix("//")
        if made and text.startswith("   "):
            made[-1] += " " + text.strip()
        else:
            made.append(text.strip())
    return made


def item_text(text):
    """One C++ number as a table has it: 0.46f is 0.46, 1.0 / 8 is 1/8."""
    text = re.sub(r"(?<=[\d.])f\b", "", text.strip())
    return re.sub(r"(\d+)(?:\.0)? / (\d+)(?:\.0)?", r"\1/\2", text)


def value_text(kind, text):
    items = [
        item_text(item) for item in text.strip().removeprefix("{").removesuffix("}").split(",")
    ]
    if kind == "Ratio":
        return "/".join(items)
    return ("; " if kind.startswith("ByState") else ", ").join(items)


def make_number(where, statement, comment, decision):
    match = NUMBER.match(statement)
    if match is None:
        raise HeaderError(
            f"{where}: no number of the form static constexpr TYPE kName = VALUE, or double name ="
            f" VALUE: {statement}"
        )
    symbol = match["name"] or match["own_name"]
    parts = [part.strip() for part in " ".join(comment_lines(comment)).split(" | ")]
    if len(parts) == 2 and decision.source:
        parts.append("")
    if len(parts) != 3 or not parts[0] or not parts[1] or not (parts[2] or decision.source):
        raise HeaderError(
            f"{where}: the comment of {symbol} is not: unit | what it decides | source"
        )
    unit, decides, source = parts
    value = value_text((match["type"] or match["own_type"]).strip(), match["value"])
    return Number(symbol, value, "" if unit == "1" else unit, decides, source)


def is_member(line, decision):
    return decision is not None and re.match(r"(?:double|float) \w+ =", line) is not None


def read(text, path="header"):
    """The decisions of a header, in its order."""
    decisions, comment, statement, decision = [], [], "", None
    for number, line in enumerate(text.splitlines(), 1):
        where, line = f"{path}:{number}", line.strip()
        if line.startswith("//"):
            comment.append(line)
            continue
        if match := STRUCT.match(line):
            tags = {}
            for each in comment_lines(comment):
                for tag, field in TAGS.items():
                    if each.startswith(tag):
                        tags[field] = each.removeprefix(tag).strip()
            if tags.get("source", "").endswith("."):
                raise HeaderError(f"{where}: the page ends the source of {match[1]} with a '.'")
            decision = Decision(match[1], [], **tags)
        elif line == "};":
            if decision is not None and decision.numbers:
                decisions.append(decision)
            decision = None
        elif statement or line.startswith("static constexpr") or is_member(line, decision):
            statement = f"{statement} {line}".strip()
            if not statement.endswith(";"):
                continue
            if decision is None:
                raise HeaderError(f"{where}: a number outside of a decision: {statement}")
            decision.numbers.append(make_number(where, statement, comment, decision))
            statement = ""
        comment = []
    return decisions


def headers(tree):
    """Paths of the headers, those of a folder by name."""
    for place in HEADERS:
        path = tree / place
        found = sorted(path.glob("*.hpp")) if path.is_dir() else [path]
        yield from (each.relative_to(tree).as_posix() for each in found if each.exists())


def read_all(tree=ROOT):
    return [each for path in headers(tree) for each in read((tree / path).read_text(), path)]


def sources(tree):
    """Paths of the sources whose numbers stand in a header; tests are none."""
    excluded = set(headers(tree))
    for path in (path for folder in FOLDERS for path in sorted((tree / folder).rglob("*"))):
        is_test = path.stem.startswith("test_") or path.stem.endswith("_test")
        name = path.relative_to(tree).as_posix()
        if path.suffix in (".cpp", ".hpp") and not is_test and name not in excluded:
            yield name


def users(tree, decision):
    """The sources that take a decision: those that name its struct, or a member of TrackerSettings
    that is one of its numbers."""
    members = [each.symbol for each in decision.numbers if not each.symbol.startswith("k")]
    used = re.compile(
        rf"\bsettings_?\.({'|'.join(members)})\b" if members else rf"\bdecisions::{decision.name}\b"
    )
    return [path for path in sources(tree) if used.search((tree / path).read_text())]


def wrap(text):
    return textwrap.fill(text, 100, break_long_words=False, break_on_hyphens=False)

"""Tables in the guides, of parameters and of reasons, wherever a guide has their marks."""
import re

from header import HeaderError
from writers.cpp import options

START = "<!-- {}, by scripts/contract/generate.py -->"
END = "<!-- end of table -->"


def cell(text):
    return text.replace("|", r"\|")


def value(text, field):
    """A default or an end of a range, with names as code."""
    return (
        text if re.fullmatch(r"[\d.e-]+", text) or field.computed_default == text else f"`{text}`"
    )


def range_words(field):
    if field.range is None:
        return ""
    if field.range.enumerators:
        return f"`{field.range.enumerators}`"
    low, high = field.range.low, field.range.high
    low_word, high_word = (end and value(end, field) for end in (low, high))
    if low is None or high is None:
        return (
            f"at most {high_word}"
            if low is None
            else f"{'above' if field.range.is_open else 'at least'} {low_word}"
        )
    return f"{low_word} to {high_word}"


def default_words(field):
    if field.default is None:
        return ""
    return value(field.computed_default or field.default, field) + (
        f" ({field.remark})" if field.remark else ""
    )


def choices(contract, field):
    """Default and range of an option that `--config` takes as a word."""
    prefix = field.range.enumerators[:-1]
    words = [
        value["name"].removeprefix(prefix).lower()
        for value in contract.enumerators(field.range.enumerators)
    ]
    return f"`{field.default.removeprefix(prefix).lower()}`", ", ".join(
        f"`{word}`" for word in words
    )


def table(fields, contract=None):
    """contract: of options, whose enumerators are words of `--config`."""
    lines = ["| field | default | range | unit | |", "|---|---|---|---|---|"]
    rows, names = [], []
    for field in fields:
        summary = re.sub(r"^DEFREC_\w+_\*:? ?", "", field.summary)
        is_word = contract and field.range and field.range.enumerators
        default, values = (
            choices(contract, field) if is_word else (default_words(field), range_words(field))
        )
        row = f"{default} | {values} | {field.unit or ''} | {cell(summary)}"
        if rows and rows[-1] == row:
            names[-1].append(f"`{field.name}`")
        else:
            rows.append(row)
            names.append([f"`{field.name}`"])
    lines += [f"| {', '.join(each)} | {row} |" for each, row in zip(names, rows)]
    return "\n".join(re.sub(r"\|(  +)(?=\|)", "| ", line) for line in lines)


def as_code(text):
    """Words with the API's names as code."""
    return re.sub(
        r"\bDEFREC_[A-Z0-9_]+|\b[a-z]+(?:_[a-z0-9]+)+(?:\(\))?", lambda name: f"`{name[0]}`", text
    )


def reasons(contract):
    lines = ["| reason | meaning | effect | what to do |", "|---|---|---|---|"]
    for value in contract.values("DEFREC_REASON_"):
        told = (as_code(cell(value.get(tag, ""))) for tag in ("summary", "effect", "remedy"))
        lines.append(f"| `{value['name']}` | " + " | ".join(told) + " |")
    return "\n".join(re.sub(r"\|(  +)(?=\|)", "| ", line) for line in lines)


def parts(contract, root):
    tables = {
        struct.name: table([field for field in struct.fields if not field.is_hidden])
        for struct in contract.params
    }
    tables["defrec_tracker_desc"] = table(options(contract), contract)
    tables["DEFREC_REASON_*"] = reasons(contract)
    guides = {path: path.read_text().splitlines() for path in sorted((root / "docs").rglob("*.md"))}
    made = {}
    for name, text in tables.items():
        mark = START.format(name)
        places = [path for path, lines in guides.items() if mark in lines]
        if len(places) != 1:
            raise HeaderError(
                f"docs: one guide with the line {mark} expected, there are {len(places)}"
            )
        made.setdefault(str(places[0].relative_to(root)), []).append((mark, END, text))
    return made


def files(contract, root):
    return {}

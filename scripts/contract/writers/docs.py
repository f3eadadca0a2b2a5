"""Tables of parameters in the guides, between marks."""
import re

from writers.cpp import options

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


def parts(contract, root):
    made = {}
    for struct in contract.params:
        stage = struct.name.removeprefix("defrec_").removesuffix("_params")
        fields = [field for field in struct.fields if not field.is_hidden]
        made[f"docs/stages/{stage}.md"] = [
            (f"<!-- {struct.name}, by scripts/contract/generate.py -->", END, table(fields))
        ]
    made["docs/track.md"] = [
        (
            "<!-- defrec_tracker_desc, by scripts/contract/generate.py -->",
            END,
            table(options(contract), contract),
        )
    ]
    return made


def files(contract, root):
    return {}

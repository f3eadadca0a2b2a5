#!/usr/bin/env python3
"""Doxygen's input filter: prints a header or a guide as Doxygen understands it. The files
themselves stay plain C and plain Markdown.

usage: filter.py FILE
"""
import html
import json
import pathlib
import re
import sys

DOCS = pathlib.Path(__file__).resolve().parent.parent
INCLUDE = DOCS.parent / "include"
SAMPLES = DOCS.parent / "samples"
SAMPLES_GUIDE = DOCS / "api" / "samples.md"
CONTRACT = json.loads((DOCS.parent / "sdk" / "contract" / "contract.json").read_text())
PARENTS = {
    "start.md": "",
    "stages.md": "stages/",
    "numbers.md": "numbers_",
}  # pages whose links make the navigation tree, and where their children lie

# What begins like this and is not in the headers is a mistake, which Doxygen reports.
LOOKS_LIKE_API = re.compile(
    r"defrec_(context|rig|tracker|job|template|memory)_"
    r"|DEFREC_(OK|TIMEOUT|ERROR|REASON|POINT|STAGE|FORMAT|FEATURE)"
)


def page_id(path):
    """Also the name of the page's HTML file."""
    return "_".join(path.resolve().relative_to(DOCS).with_suffix("").parts)


def heading_id(page, heading):
    """As code hosts make anchors of headings, within the page."""
    slug = re.sub(r"[^\w\- ]", "", heading.replace("`", "").strip().lower()).replace(" ", "-")
    return f"{page}-{slug}"


def api_constants():
    enumerators = [value["name"] for enum in CONTRACT["enums"] for value in enum["values"]]
    return {*enumerators, *CONTRACT["macros"], *CONTRACT["versions"]}


def api_names():
    kinds = ("handles", "callbacks", "structs", "functions")
    named = [each["name"] for kind in kinds for each in CONTRACT[kind]]
    return {*named, *CONTRACT["opaque"], "defrec_status"} | api_constants()


def filter_header(text):
    # Doxygen attaches a comment behind a declaration to the last of several declarators only.
    def split(match):
        indent, kind, declarators, comment = match.groups()
        one_line = re.sub(r"\s*\n\s*", " ", comment)
        lines = comment.count("\n")
        return (
            indent
            + " ".join(f"{kind} {d.strip()}; {one_line}" for d in declarators.split(","))
            + "\n" * lines
        )

    text = re.sub(
        r"^( +)((?:const )?\w+) +([*\w, ]+,[*\w, ]+); *(/\*\*<.*?\*/)",
        split,
        text,
        flags=re.M | re.S,
    )
    # Constants, macros and guides that comments name become links.
    constants = api_constants()

    def link(match):
        comment = re.sub(
            r"(?<![`\"])(?<!@def )\bDEFREC_[A-Z_0-9]+\b(?!\*)",
            lambda m: ("#" if m[0] in constants else "") + m[0],
            match[0],
        )
        return re.sub(r"\bdocs/([\w/]+)\.md\b", lambda m: "@ref " + m[1].replace("/", "_"), comment)

    text = re.sub(r"/\*\*.*?\*/", link, text, flags=re.S)
    # The tags that only this header has read as words.
    text = re.sub(r"(\s)@(default|range|unit|count|components|effect) ", r"\1| \2: ", text)
    text = re.sub(r"(\s)@remedy ", r"\1| what to do: ", text)
    text = re.sub(r"\| range: (.*?)\.\.(.*?)(?= \||\s*\*/|\n)", range_words, text)
    return text.replace(
        "/**< ", "/**< @brief "
    )  # so that a struct is one table, without a section for each field


def range_words(match):
    low, high = match.groups()
    if low and high:
        return f"| range: {low} to {high}"
    if high:
        return f"| range: at most {high}"
    return f"| range: above {low[1:]}" if low[0] == ">" else f"| range: at least {low}"


def shown_samples():
    """The files that samples.md links to; the site shows them on that page. Notebooks have pages of
    their own."""
    links = re.findall(r"\]\(\.\./\.\./samples/([^)]+)\)", SAMPLES_GUIDE.read_text())
    files = [pathlib.PurePath(link) for link in dict.fromkeys(links)]
    return [file for file in files if file.suffix != ".ipynb"]


def sample_id(sample):
    return "sample_" + re.sub(r"\W", "_", str(sample))


def inline_code(match):
    if "'" in match[1]:
        return f"`{match[0]}`"  # Doxygen takes `...' for quotation marks
    if r"\|" in match[1]:  # in a table
        return f"<code>{html.escape(match[1])}</code>"
    return match[0]


class Guide:
    def __init__(self, path):
        self.path, self.page, self.names, self.samples = (
            path,
            page_id(path),
            api_names(),
            shown_samples(),
        )
        self.children, self.headings = set(), []

    def filter(self, text):
        lines, in_code = [], False
        whole_labels = re.sub(r"\[([^\]\[\n]+)\n([^\]\[\n]+)\]\(", r"[\1 \2](", text)
        for line in whole_labels.splitlines():
            in_code ^= line.lstrip().startswith("```")
            line = re.sub(
                "^```(csharp|python)$",
                lambda fence: {"csharp": "```cs", "python": "```py"}[fence[1]],
                line,
            )
            lines.append(line if in_code or line.startswith("    ") else self.filter_line(line))
        if self.path == SAMPLES_GUIDE:
            for sample in self.samples:
                lines += ["", f"## {sample} {{#{sample_id(sample)}}}", f"@include {sample}"]
        return "\n".join(lines) + "\n"

    def filter_line(self, line):
        heading = re.match(r"(#+) (.*)", line)
        if heading:
            identity = self.page if heading[1] == "#" else self.heading(heading[2])
            title = re.sub(r"#$", "#&zwj;", heading[2])  # Doxygen takes a # at the end away
            return f"{heading[1]} {title} {{#{identity}}}"
        line = re.sub(r"!\[([^\]\[]+)\]\(([^)\s]+)\)", self.picture, line)
        line = re.sub(r"(?<!!)\[([^\]\[]+)\]\(([^)\s]+)\)", self.link, line)
        line = re.sub(r"\*\*(`[^`]+`)\*\*", r"<b>\1</b>", line)  # else ** is shown
        line = re.sub(r"`((?:defrec|DEFREC)_[\w.]+)`", self.name, line)
        return re.sub(r"`([^`]+)`", inline_code, line)

    def heading(self, text):
        identity = heading_id(self.page, text)
        count = self.headings.count(identity)
        self.headings.append(identity)
        return (
            identity if count == 0 else f"{identity}-{count}"
        )  # as code hosts number headings of the same name

    def name(self, match):
        word, _, member = match[1].partition(".")
        if word not in self.names and not LOOKS_LIKE_API.match(word):
            return match[0]
        target = f"{word}::{member}" if member not in ("", "h") else match[1]
        return f'<code>@ref {target} "{match[1]}"</code>'

    def picture(self, match):
        return f"![{match[1]}]({pathlib.PurePath(match[2]).name})"  # Doxygen has its IMAGE_PATH

    def link(self, match):
        label, target = match[1].replace("`", ""), match[2]
        if re.match(r"[a-z]+:", target):
            return match[0]
        file, _, anchor = target.partition("#")
        linked = (self.path.parent / file).resolve() if file else self.path
        if linked.parent == INCLUDE:
            return f'@ref {linked.name} "{label}"'
        if SAMPLES in linked.parents and linked.relative_to(SAMPLES) in self.samples:
            return f'@ref {sample_id(linked.relative_to(SAMPLES))} "{label}"'
        if linked.suffix == ".ipynb":
            return f'<a href="notebook_{linked.stem}.html">{label}</a>'
        if linked.suffix != ".md" or DOCS not in linked.parents:
            return match[1]  # a file of the source tree, which the site has not
        identity = page_id(linked)
        if anchor:
            return f'@ref {heading_id(identity, anchor)} "{label}"'
        is_child = (
            file.startswith(PARENTS.get(self.path.name, "//"))
            and identity not in self.children
            and linked != self.path
        )
        self.children.add(identity)
        return f'@{"subpage" if is_child else "ref"} {identity} "{label}"'


def main():
    path = pathlib.Path(sys.argv[1]).resolve()
    text = path.read_text()
    sys.stdout.write(Guide(path).filter(text) if path.suffix == ".md" else filter_header(text))


main()

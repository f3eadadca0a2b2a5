#!/usr/bin/env python3
"""Checks that no sentence of a comment or docstring begins with the word "Of": a comment names what
it speaks of first ("Width of the image", not the rest of it).

usage: check_comments.py [FOLDER]

FOLDER holds the tree, by default this repository.
"""
import ast
import io
import pathlib
import re
import sys
import tokenize

from check_markdown import NO_SOURCES

ROOT = pathlib.Path(__file__).resolve().parents[1]
SLASHES = {
    ".c",
    ".comp",
    ".cpp",
    ".cs",
    ".css",
    ".cu",
    ".cuh",
    ".glsl",
    ".h",
    ".hpp",
    ".js",
    ".mjs",
}
HASHES = {".cmake", ".sh", ".toml", ".txt", ".yaml", ".yml"}

# A string or a character, so that marks within are none; a comment.
SLASH_TOKEN = re.compile(
    r"""(?:"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])')|(?P<comment>//[^\n]*|/\*.*?\*/)""", re.DOTALL
)
HASH_COMMENT = re.compile(r"(?:^|(?<=\s))#[^\n]*", re.MULTILINE)
MARKS = re.compile(r"^[ \t]*(?:/[/*]+[!<]*|\*+(?!/)|#+!?)", re.MULTILINE)
SENTENCE = re.compile(r"(?:^|[.!?:]\s)\s*(?:<\w+>)?(?P<word>Of)\s", re.MULTILINE)


def slash_comments(text):
    """(line, comment) of each // and /* */ comment."""
    for match in SLASH_TOKEN.finditer(text):
        if match["comment"]:
            yield text.count("\n", 0, match.start()) + 1, match["comment"]


def hash_comments(text):
    for match in HASH_COMMENT.finditer(text):
        yield text.count("\n", 0, match.start()) + 1, match[0]


def python_comments(text):
    """Comments, strings that stand alone, as docstrings do, and those that are given to __doc__."""
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string
    for node in ast.walk(ast.parse(text)):
        is_text = (
            isinstance(node, ast.Expr)
            or isinstance(node, ast.Assign)
            and any(
                isinstance(target, ast.Name) and target.id == "__doc__" for target in node.targets
            )
        )
        if is_text and isinstance(node.value, (ast.Constant, ast.JoinedStr)):
            for part in getattr(node.value, "values", [node.value]):
                if isinstance(part, ast.Constant) and isinstance(part.value, str):
                    yield part.lineno, part.value


def comments_of(path):
    text = path.read_text()
    if path.suffix == ".py":
        return python_comments(text)
    return slash_comments(text) if path.suffix in SLASHES else hash_comments(text)


def source_files(folder):
    for path in sorted(folder.rglob("*")):
        folders = path.relative_to(folder).parts[:-1]
        if path.suffix in SLASHES | HASHES | {".py"} and path.is_file():
            if not any(NO_SOURCES.match(part) for part in folders):
                yield path


def check(folder):
    """(number of files, faults)"""
    faults, files = [], 0
    for path in source_files(folder):
        files += 1
        lines = set()
        for line, comment in comments_of(path):
            words = MARKS.sub("", comment)
            for match in SENTENCE.finditer(words):
                lines.add(line + words.count("\n", 0, match.start("word")))
        name = path.relative_to(folder).as_posix()
        faults += [
            f"{name}:{line}: a sentence begins with Of; name what it speaks of first"
            for line in sorted(lines)
        ]
    return files, faults


def main():
    if len(sys.argv) > 2:
        sys.exit("usage: check_comments.py [FOLDER]")
    files, faults = check(pathlib.Path(sys.argv[1]) if len(sys.argv) == 2 else ROOT)
    print(f"{files} files")
    sys.exit("\n".join(faults) or not files)


if __name__ == "__main__":
    main()

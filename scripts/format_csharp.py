#!/usr/bin/env python3
"""Formats C# with clang-format 14, and what that does not know of C#: using and fixed statements,
the braces of accessors, and XML comments, whose elements stand in one line or in lines of their
own.

usage: format_csharp.py [--check] CLANG_FORMAT FILE...
       writes the files that differ; --check names them, and its exit status is 1 if there are any
"""
import argparse
import pathlib
import re
import subprocess
import sys
import textwrap

MAX_LINE = 100
OPAQUE = r'//[^\n]*|/\*.*?\*/|@"(?:[^"]|"")*"|"(?:\\.|[^"\\\n])*"|' + r"'(?:\\.|[^'\\])+'"
TOKEN = re.compile(rf"(?P<opaque>{OPAQUE})|\b(?P<word>using_?|fixed_?|while)\s*\(|[()]", re.DOTALL)
STATEMENT = re.compile(r"\s*(?:using|fixed)\s*\(")


def end_of_parenthesis(text, start):
    """The offset behind the parenthesis that is open at start."""
    depth = 1
    for token in TOKEN.finditer(text, start):
        if not token["opaque"]:
            depth += -1 if token[0] == ")" else 1
        if not depth:
            return token.end()
    raise ValueError("a parenthesis is not closed")


def disguised(text):
    """text with its using and fixed statements as others of the same width: a statement that
    stands before another one of them as a call, using_(...);, the others as while loops. Also what
    each while loop was."""
    pieces, loops, semicolons, done = [], [], set(), 0
    for token in TOKEN.finditer(text):
        pieces.append(text[done : token.start()])
        done = token.end()
        word = token["word"]
        if not word:
            pieces.append(token[0] + ";" * (done in semicolons))
            continue
        end = end_of_parenthesis(text, done)
        if word != "while" and STATEMENT.match(text, end):
            semicolons.add(end)
            pieces.append(f"{word}_(")
        else:
            loops.append(word)
            pieces.append("while (")
    return "".join(pieces) + text[done:], loops


def undisguised(text, loops):
    pieces, semicolons, done = [], set(), 0
    rest = iter(loops)
    for token in TOKEN.finditer(text):
        pieces.append(text[done : token.start()])
        done = token.end()
        word = token["word"]
        if not word:
            pieces.append(token[0])
            done += done in semicolons
        elif word == "while":
            pieces.append(f"{next(rest)} (")
        else:
            pieces.append(f"{word.rstrip('_')} (")
            semicolons.add(end_of_parenthesis(text, done))
    return "".join(pieces) + text[done:]


def element_lines(element, margin):
    content = element["content"].strip()
    whole = margin + element["open"] + content + element["close"]
    if len(whole) <= MAX_LINE:
        return [whole]
    # The blanks inside of tags break no line.
    content = re.sub(r"<[^>]*>", lambda tag: tag[0].replace(" ", "\0"), content)
    wrapped = textwrap.wrap(
        content, MAX_LINE - len(margin), break_long_words=False, break_on_hyphens=False
    )
    lines = [element["open"], *(line.replace("\0", " ") for line in wrapped), element["close"]]
    return [margin + line for line in lines]


def xml_comment(lines):
    """The lines of a comment with its elements wrapped; as they are where it has other text."""
    margin = re.match(r" */// ", lines[0] + " ")[0]
    text = " ".join(line.strip()[3:].strip() for line in lines)
    element = re.compile(r"\s*(?P<open><(\w+)[^>]*>)(?P<content>.*?)(?P<close></\2>)")
    made, at = [], 0
    while found := element.match(text, at):
        made += element_lines(found, margin)
        at = found.end()
    return lines if text[at:].strip() else made


def with_xml_comments(text):
    lines, comment = [], []
    for line in [*text.splitlines(), ""]:
        if line.lstrip().startswith("///"):
            comment.append(line)
            continue
        if comment:
            lines += xml_comment(comment)
            comment = []
        lines.append(line)
    return "\n".join(lines)


def formatted(text, clang_format, path):
    text, loops = disguised(text)
    command = [clang_format, f"--assume-filename={path}"]
    text = subprocess.run(command, input=text, stdout=subprocess.PIPE, text=True, check=True).stdout
    text = undisguised(text, loops)
    text = re.sub(r"^( *)((?:\w+ )?(?:get|set)) \{$", r"\1\2\n\1{", text, flags=re.MULTILINE)
    text = re.sub(r"^(\[\w+):(?=\w)", r"\1: ", text, flags=re.MULTILINE)
    return with_xml_comments(text)


def main():
    parser = argparse.ArgumentParser(usage=__doc__.partition("usage: ")[2])
    parser.add_argument("--check", action="store_true")
    parser.add_argument("clang_format")
    parser.add_argument("files", nargs="*", type=pathlib.Path)
    arguments = parser.parse_args()
    status = 0
    for path in arguments.files:
        text = path.read_text()
        wanted = formatted(text, arguments.clang_format, path)
        if wanted != text and arguments.check:
            print(f"{path}: differs from its format")
            status = 1
        elif wanted != text:
            path.write_text(wanted)
    sys.exit(status)


if __name__ == "__main__":
    main()

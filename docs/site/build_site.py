#!/usr/bin/env python3
"""Builds the site with Doxygen, warnings being errors, and checks it: every link leads somewhere,
no unresolved Markdown is left, every guide can be reached and shows its pictures, every sample
is named, and that what the search is told exists. Notebooks are shown as the test
samples/notebook has run them.

usage: build_site.py DOXYGEN DOXYFILE GUIDES SITE NOTEBOOKS
"""
import html.parser
import pathlib
import re
import shutil
import subprocess
import sys
import urllib.parse

import full_text

PICTURE = re.compile(r"!\[[^\]]*\]\(([^)\s]+)\)")


class Page(html.parser.HTMLParser):
    """Links, anchors, and the text that is not code."""

    def __init__(self, path):
        super().__init__()
        self.links, self.anchors, self.text = [], set(), []
        self.open = []  # of the elements that may be code: tag, whether they are
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        if tag in ("script", "style", "pre", "code", "div"):
            self.open.append((tag, tag != "div" or attributes.get("class") == "fragment"))
        self.anchors.update(
            value for value in (attributes.get("id"), attributes.get("name")) if value
        )
        # Doxygen shows an SVG as an object.
        links = (attributes.get(name) for name in ("href", "src", "data"))
        self.links += [value for value in links if value]

    def handle_endtag(self, tag):
        if self.open and self.open[-1][0] == tag:
            self.open.pop()

    def handle_data(self, data):
        if not any(is_code for _, is_code in self.open):
            self.text.append(data)


def targets(name, page):
    """(file, anchor) of each link that stays within the site."""
    for link in page.links:
        parts = urllib.parse.urlsplit(link)
        if not parts.scheme and not parts.netloc:
            yield urllib.parse.unquote(parts.path) or name, urllib.parse.unquote(parts.fragment)


def faults(site, guides):
    pages = {path.name: Page(path) for path in sorted(site.glob("*.html"))}
    for name, page in pages.items():
        for file, anchor in sorted(set(targets(name, page))):
            if not (site / file).is_file():
                yield f"{name}: {file} is not there"
            elif anchor and file in pages and anchor not in pages[file].anchors:
                yield f"{name}: {file} has no anchor {anchor}"
        for left_over in re.findall(
            r"\S*(?:\]\(|[@\\](?:ref|subpage)\b|\{#|`)\S*", "".join(page.text)
        ):
            yield f"{name}: unresolved: {left_over}"
    reached, waiting = set(), [
        "index.html",
        "pages.html",
    ]  # the start page, and what it does not name
    while waiting:
        name = waiting.pop()
        if name in pages and name not in reached:
            reached.add(name)
            waiting += [file for file, _ in targets(name, pages[name])]
    for guide in sorted(guides.rglob("*.md")):
        parts = guide.relative_to(guides).with_suffix("").parts
        name = "index.html" if parts == ("start",) else "_".join(parts) + ".html"
        if name not in reached:
            yield f"{guide.name}: no way leads to it"
        shown = {file for file, _ in targets(name, pages[name])} if name in pages else set()
        for picture in PICTURE.findall(guide.read_text()):
            if pathlib.PurePath(picture).name not in shown:
                yield f"{guide.name}: {name} does not show {picture}"


def faults_of_samples(root):
    guide = (root / "docs" / "api" / "samples.md").read_text()
    for sample in sorted((root / "samples").glob("*/*")):
        if (
            sample.suffix in (".c", ".h", ".cs", ".py")
            and f"](../../{sample.relative_to(root)})" not in guide
        ):
            yield f"samples.md: {sample.name} is not named"


def add_notebooks(samples, run, site):
    """A page of each; where it was not run, as without Jupyter, a page that says so."""
    for notebook in sorted(samples.glob("*.ipynb")):
        page, shown = site / f"notebook_{notebook.stem}.html", run / f"{notebook.stem}.html"
        if shown.is_file():
            shutil.copy(shown, page)
        else:
            print(f"{notebook.name} was not run: the site has it without its results")
            page.write_text(
                '<!DOCTYPE html><html lang="en"><meta charset="utf-8"><title>Notebook</title>'
                "<p>This site was built where the notebook had not been run. It is in the sources:"
                f" samples/notebook/{notebook.name}.</p></html>"
            )


def show_code_in_headings(site):
    """Doxygen writes code in a heading as text, with its tags."""
    for path in sorted(site.glob("*.html")):
        page = path.read_text()
        shown = re.sub(r"&lt;(/?)tt&gt;", r"<\1tt>", page)
        shown = re.sub(r"(<title>.*?</title>)", lambda m: re.sub("</?tt>", "", m[1]), shown)
        if shown != page:
            path.write_text(shown)


def main():
    doxygen, doxyfile = sys.argv[1:3]
    guides, site, notebooks = map(pathlib.Path, sys.argv[3:6])
    shutil.rmtree(site, ignore_errors=True)
    site.mkdir(parents=True)
    subprocess.run([doxygen, doxyfile], check=True)
    add_notebooks(guides.parent / "samples" / "notebook", notebooks, site)
    show_code_in_headings(site)
    found = full_text.add(site, pathlib.Path(__file__).parent)
    found += [*faults(site, guides), *faults_of_samples(guides.parent)]
    sys.exit("\n".join(found) if found else 0)


main()

"""Full-text search of the site: a page that finds words in all guides and in the reference, without
a server, and a field on every page that leads there.

Doxygen's own search knows names of pages and of the API, not the text. search_words.toml has the
words that people type for what pages call otherwise. What the rows of a guide's tables begin with,
as the name of a reason or of an option, is found as headings are.
"""
import html
import html.parser
import json
import re
import tomllib

PAGE = "full_text.html"
INDEX = "full_text_index.js"

SCRIPTS = ("full_text_words.js", "full_text_rank.js", "full_text.js")
FIELD = (
    '<form id="site-search" action="full_text.html" role="search"><input type="search" name="q" '
    'aria-label="Search" placeholder="Search"/></form>'
)


# A program prints a part of it: few-matches of DEFREC_REASON_FEW_MATCHES.
SPOKEN = re.compile(r"DEFREC_(?:REASON_)?(?=[A-Z])")


def spoken(name):
    """A name in code, and its words where they are others."""
    words = re.sub(r"[-_]+", " ", SPOKEN.sub("", name)).strip().lower()
    return [name] if words == name or not words else [name, words]


class Sections(html.parser.HTMLParser):
    """[anchor, heading, text, names] of a page, a section for each heading with an anchor. names:
    those in code with which the rows of its tables begin."""

    SKIPPED = ("script", "style", "head", "nav")

    def __init__(self, text):
        super().__init__()
        self.title, self.sections = "", [["", "", "", []]]
        self.skipped, self.heading, self.anchor = [], None, ""
        self.in_contents, self.in_title = False, False
        self.cell, self.name = None, None  # the cell of its row, counted from 0; text in code
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        if tag in self.SKIPPED:
            self.skipped.append(tag)
        if "contents" in (attributes.get("class") or "").split():
            self.in_contents = True
        self.in_title = self.in_title or tag == "title"
        if attributes.get("id") and tag in ("a", "h1", "h2", "h3"):
            self.anchor = attributes["id"]
        if tag in ("h1", "h2", "h3") and self.in_contents:
            self.heading = ""
        if tag == "tr":
            self.cell = -1
        elif tag == "td" and "markdownTableBody" in (attributes.get("class") or ""):
            self.cell += 1
        elif tag == "code" and self.cell == 0:
            self.name = ""

    def handle_endtag(self, tag):
        if self.skipped and self.skipped[-1] == tag:
            self.skipped.pop()
        if tag == "title":
            self.in_title = False
        if tag in ("h1", "h2", "h3") and self.heading is not None:
            self.sections.append([self.anchor, " ".join(self.heading.split()), "", []])
            self.heading = None
        if tag == "tr":
            self.cell = None
        elif tag == "code" and self.name is not None:
            self.sections[-1][3] += spoken(self.name)
            self.name = None

    def handle_data(self, data):
        if self.in_title:
            self.title += data
        elif self.skipped or not self.in_contents:
            return
        elif self.heading is not None:
            self.heading += data.replace("\u25c6", "")
        else:
            self.sections[-1][2] += data + " "
            if self.name is not None:
                self.name += data


def entries(site, keywords):
    """[file, anchor, title, heading, text, keywords, names] of all sections that hold text. Takes
    what it uses out of keywords."""
    found = []
    for path in sorted(site.glob("*.html")):
        page = Sections(path.read_text())
        title = page.title.split(": ", 1)[-1]
        is_first = True
        for anchor, heading, text, names in page.sections:
            text = " ".join(text.split())
            if not text:
                continue
            place = f"{path.name}#{anchor}" if anchor else path.name
            words = keywords.pop(place, "")
            if is_first and anchor:  # a page that begins with a heading
                words = ", ".join(filter(None, (words, keywords.pop(path.name, ""))))
            is_first = False
            found.append([path.name, anchor, title, heading, text, words, ", ".join(names)])
    return found


def add_field(site):
    """The field on every page but that of the search, in place of Doxygen's."""
    for path in sorted(set(site.glob("*.html")) - {site / PAGE}):
        page = path.read_text()
        path.write_text(page.replace('<div id="projectbrief">', f'{FIELD}<div id="projectbrief">'))


def add(site, folder):
    """Writes the page and its index into the site. folder: of the scripts and search_words.toml."""
    keywords = {
        place: ", ".join(words)
        for place, words in tomllib.loads((folder / "search_words.toml").read_text()).items()
    }
    index = entries(site, keywords)
    (site / INDEX).write_text("const fullText = " + json.dumps(index, ensure_ascii=False) + ";\n")
    for name in SCRIPTS:
        (site / name).write_text((folder / name).read_text())
    page = (site / "pages.html").read_text()
    body = (
        '<div class="contents"><p><input id="full-text-query" type="search" autofocus '
        'aria-label="Words to search for" '
        'placeholder="A question, words, or &quot;words in a row&quot;"/></p>'
        '<div id="full-text-found"></div></div><!-- contents -->'
        + "".join(f'<script src="{name}"></script>' for name in (INDEX, *SCRIPTS))
    )
    page, count = re.subn(
        r'<div class="contents">.*</div><!-- contents -->', lambda _: body, page, flags=re.DOTALL
    )
    if count != 1:
        raise ValueError("pages.html of Doxygen has no contents")
    page = re.sub(
        r'<div class="title">[^<]*</div>', '<div class="title">Search in all text</div>', page
    )
    (site / PAGE).write_text(page)
    add_field(site)
    return [f"search_words.toml: {place} is not there" for place in keywords]

"""Full-text search of the site: a page that finds words in all guides and in the reference, without
a server.

Doxygen's own search knows names of pages and of the API, not the text.
"""
import html
import html.parser
import json
import re

PAGE = "full_text.html"
INDEX = "full_text_index.js"

# Words that people type who have not read the guides; each must find something.
WORDS = """registration Slicer microscope calibration checkerboard OpenIGTLink CUDA Vulkan python
wheel latency deadline GPU threads lost occlusion smoke covariance "expected error" template
interlaced RTSP camera distortion baseline disparity ROS navigation mesh tumour endoscope
"operating room" install"""


class Sections(html.parser.HTMLParser):
    """[anchor, heading, text] of a page, a section for each heading with an anchor."""

    SKIPPED = ("script", "style", "head", "nav")

    def __init__(self, text):
        super().__init__()
        self.title, self.sections = "", [["", "", ""]]
        self.skipped, self.heading, self.anchor = [], None, ""
        self.in_contents, self.in_title = False, False
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

    def handle_endtag(self, tag):
        if self.skipped and self.skipped[-1] == tag:
            self.skipped.pop()
        if tag == "title":
            self.in_title = False
        if tag in ("h1", "h2", "h3") and self.heading is not None:
            self.sections.append([self.anchor, " ".join(self.heading.split()), ""])
            self.heading = None

    def handle_data(self, data):
        if self.in_title:
            self.title += data
        elif self.skipped or not self.in_contents:
            return
        elif self.heading is not None:
            self.heading += data.replace("\u25c6", "")
        else:
            self.sections[-1][2] += data + " "


def entries(site):
    """[file, anchor, title, heading, text] of all sections that hold text."""
    found = []
    for path in sorted(site.glob("*.html")):
        page = Sections(path.read_text())
        title = page.title.split(": ", 1)[-1]
        for anchor, heading, text in page.sections:
            text = " ".join(text.split())
            if text:
                found.append([path.name, anchor, title, heading, text])
    return found


def words(text):
    """Words of a query; those in quotation marks belong together."""
    return [phrase or word for phrase, word in re.findall(r'"([^"]+)"|(\S+)', text)]


def finds(index, word):
    """Whether any section holds a word that begins so."""
    pattern = re.compile(r"(?<!\w)" + re.escape(word), re.IGNORECASE)
    return any(pattern.search(f"{title} {heading} {text}") for _, _, title, heading, text in index)


def add(site, folder):
    """Writes the page and its index into the site. folder: of full_text.js."""
    index = entries(site)
    (site / INDEX).write_text("const fullText = " + json.dumps(index, ensure_ascii=False) + ";\n")
    (site / "full_text.js").write_text((folder / "full_text.js").read_text())
    page = (site / "pages.html").read_text()
    body = (
        '<div class="contents"><p><input id="full-text-query" type="search" autofocus '
        'aria-label="Words to search for" placeholder="Words, or &quot;words in a row&quot;"/></p>'
        '<div id="full-text-found"></div></div><!-- contents -->'
        f'<script src="{INDEX}"></script><script src="full_text.js"></script>'
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
    return [f"search finds nothing for '{word}'" for word in words(WORDS) if not finds(index, word)]

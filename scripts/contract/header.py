"""Reads the two public headers into one description: every handle, enumeration, struct, callback
and function, with comments.

The headers are the source of everything that generate.py writes. What this parser does not
understand is an error with its line, so that nothing is passed over. The comment of a field or an
enumerator may end in tags. A field has:

    @default 128          of a parameter or option that is 0. A number, an enumerator, or an
                          expression of other fields (width, source_width *
                          bytes_per_pixel(format)); a remark may follow in brackets: 1600 (0.39). In
                          quotes: words for a default that the code computes, "found from the first
                              frame".
    @range 1..510         of a parameter or option, its default filled in. Either end may be left
                          out; ">0.." leaves the end itself out; ends are expressions as above.
                          DEFREC_FORMAT_*: one of these enumerators. Floating point without @range
                          is finite.
    @unit px              of the number
    @count vertex_count   of an array in a result: the field with its number of elements; `pixels`:
                          one per pixel of the rectified image, and NULL where there is no such
                          image
    @components 3         of an element of such an array, 1 if left out; 3x4: of a matrix, row-major
    @since 1.1            of the API

A reason for a frame's state has:

    @effect degraded      on the frame, if it has one; what begins so degrades a frame that is found
    @remedy clean the lens
    @since 1.1            of the API
"""
import re

# Sizes on every platform that defrec runs on (LP64); sdk/abi/layout compares them with a
# compiler's.
SCALARS = {
    "int8_t": 1,
    "uint8_t": 1,
    "int16_t": 2,
    "uint16_t": 2,
    "int32_t": 4,
    "uint32_t": 4,
    "int64_t": 8,
    "uint64_t": 8,
    "size_t": 8,
    "float": 4,
    "double": 8,
    "defrec_status": 4,
}
POINTER = 8

TOKEN = re.compile(
    r"""(?P<doc>/\*\*.*?\*/) | (?P<comment>/\*.*?\*/)
      | (?P<cplusplus>^\#ifdef\ __cplusplus$.*?^\#endif$)
      | (?P<define>^\#define\ (?P<macro>DEFREC_\w+_M(?:AJOR|INOR))\ (?P<number>\d+))
      | (?P<directive>^\#(?:[^\n\\]|\\.)*)
      | (?P<space>\s+) | (?P<word>\w+) | (?P<mark><<|.)""",
    re.M | re.S | re.X,
)
TAG = re.compile(r"@(\w+)\s+(.*?)(?=\s+@\w+\s|\s*$)", re.S)
FIELD_TAGS = {"default", "default_remark", "range", "unit", "count", "components", "since"}
VALUE_TAGS = {"effect", "remedy", "since"}


class HeaderError(Exception):
    """What a header has that cannot be read, and where."""


def comment_text(comment):
    """The words of a doc comment, on one line."""
    text = re.sub(r"^/\*\*<?|\*/$", "", comment)
    return " ".join(
        re.sub(r"^\s*\*(?: |$)", "", line).strip() for line in text.splitlines()
    ).strip()


class Token:
    def __init__(self, kind, text, line):
        self.kind, self.text, self.line = kind, text, line


def tokens_of(text):
    found, line = [], 1
    for match in TOKEN.finditer(text):
        if match["directive"] and (macro := re.match(r"# *define (DEFREC_\w+)", match[0])):
            found.append(Token("macro", macro[1], line))
        elif match["define"]:
            found.append(Token("define", (match["macro"], int(match["number"])), line))
        elif match["doc"]:
            found.append(
                Token("behind" if match["doc"].startswith("/**<") else "doc", match["doc"], line)
            )
        elif match["word"] or match["mark"]:
            found.append(Token("code", match[0], line))
        line += match[0].count("\n")
    return found


class Parser:
    """One header. Adds what it finds to a description."""

    def __init__(self, name, text, description):
        self.name, self.tokens, self.at, self.description = name, tokens_of(text), 0, description
        self.doc = ""  # the comment before the declaration that is being read

    def fail(self, what):
        line = self.tokens[min(self.at, len(self.tokens) - 1)].line
        raise HeaderError(f"{self.name}:{line}: {what}")

    def next_is(self, text):
        return (
            self.at < len(self.tokens)
            and self.tokens[self.at].kind == "code"
            and self.tokens[self.at].text == text
        )

    def take(self, text=None):
        """The next piece of code, which is text where that is given."""
        if (
            self.at == len(self.tokens)
            or self.tokens[self.at].kind != "code"
            or text not in (None, self.tokens[self.at].text)
        ):
            self.fail(f"{text or 'code'} expected")
        self.at += 1
        return self.tokens[self.at - 1].text

    def take_until(self, end):
        """Code up to and without end, which is taken too; comments inside are kept by kind."""
        pieces = []
        while not self.next_is(end):
            if self.at == len(self.tokens):
                self.fail(f"{end} expected")
            pieces.append(self.tokens[self.at])
            self.at += 1
        self.at += 1
        return pieces

    def behind(self):
        """The comment behind what was just read."""
        if self.at < len(self.tokens) and self.tokens[self.at].kind == "behind":
            self.at += 1
            return comment_text(self.tokens[self.at - 1].text)
        return ""

    def parse(self):
        while self.at < len(self.tokens):
            token = self.tokens[self.at]
            if token.kind == "doc":
                text = comment_text(token.text)
                self.doc = (
                    text if not text.startswith(("@file", "@defgroup", "@}", "@def ")) else ""
                )
                self.at += 1
            elif token.kind == "define":
                self.description["versions"][token.text[0]] = token.text[1]
                self.at += 1
                self.behind()
            elif token.kind == "macro":
                if token.text not in (
                    macros := self.description["macros"]
                ) and not token.text.endswith("_H"):
                    macros.append(token.text)
                self.at += 1
            elif token.kind == "behind":
                self.fail("a comment behind nothing")
            else:
                self.declaration()
                self.doc = ""

    def declaration(self):
        if self.next_is("DEFREC_API"):
            return self.function()
        if self.next_is("enum"):
            return self.enumeration()
        self.take("typedef")
        if self.next_is("struct"):
            return self.structure()
        pieces = self.take_until(";")
        code = join(pieces)
        if callback := re.fullmatch(r"(.+?)\(DEFREC_CALL \*(\w+)\)\((.*)\)", code):
            self.description["callbacks"].append(
                {
                    "name": callback[2],
                    "summary": self.doc,
                    "signature": f"{callback[1]}({callback[3]})",
                }
            )
        elif code == "int32_t defrec_status":
            self.behind()
        else:
            self.fail(f"a typedef of an unknown kind: {code}")

    def enumeration(self):
        self.take("enum")
        self.take("{")
        summary, tags = split_tags(self.doc)
        values = []
        while not self.next_is("}"):
            name = self.take()
            self.take("=")
            pieces = []
            while (
                not self.next_is(",")
                and not self.next_is("}")
                and self.tokens[self.at].kind == "code"
            ):
                pieces.append(self.tokens[self.at])
                self.at += 1
            if self.next_is(","):
                self.take()
            text, value_tags = split_tags(self.behind())
            if not text:
                self.fail(f"{name} has no comment")
            if unknown := set(value_tags) - VALUE_TAGS:
                self.fail(f"{name}: @{unknown.pop()} of an enumerator is unknown")
            values.append(
                {"name": name, "value": self.number(join(pieces)), "summary": text, **value_tags}
            )
        self.take("}")
        self.take(";")
        self.description["enums"].append({"summary": summary, **tags, "values": values})

    def number(self, code):
        plain = re.sub(r"(?<=\d)u\b", "", code)
        if match := re.fullmatch(r"(\d+) << (\d+)", plain):
            return int(match[1]) << int(match[2])
        if not re.fullmatch(r"- ?\d+|\d+", plain):
            self.fail(f"{code} is no number")
        return int(plain.replace(" ", ""))

    def structure(self):
        self.take("struct")
        tag = self.take()
        if self.next_is("*"):
            self.take()
            name = self.take()
            self.take(";")
            text, tags = split_tags(self.behind())
            self.description["handles"].append({"name": name, "summary": text, **tags})
            return
        if not self.next_is("{"):  # of the plugin ABI: opaque types
            name = self.take()
            self.take(";")
            self.behind()
            self.description["opaque"].append(name)
            return
        self.take("{")
        summary, tags = split_tags(self.doc)
        fields, before = [], ""
        while not self.next_is("}"):
            if self.tokens[self.at].kind == "doc":
                before = comment_text(self.tokens[self.at].text)
                self.at += 1
                continue
            line = self.tokens[self.at].line
            declared = join(self.take_until(";"))
            comment = self.behind() or before
            text, field_tags = split_tags(comment)
            if unknown := set(field_tags) - FIELD_TAGS - {"threads"}:
                self.fail(f"{tag}: @{unknown.pop()} of a field is unknown")
            if "count" in field_tags:  # an array's own count is that of its declaration
                field_tags["counted_by"] = field_tags.pop("count")
            for field in declarators(declared):
                if not text:
                    raise HeaderError(f"{self.name}:{line}: {tag}.{field['name']} has no comment")
                fields.append({**field, "summary": text, **field_tags})
            before = ""
        self.take("}")
        if self.take() != tag:
            self.fail(f"typedef struct {tag} has another name behind it")
        self.take(";")
        self.description["structs"].append(
            {"name": tag, "header": self.name, "summary": summary, **tags, "fields": fields}
        )

    def function(self):
        self.take("DEFREC_API")
        code = join(self.take_until(";"))
        match = re.fullmatch(r"(.+?) ?DEFREC_CALL (\w+)\((.*)\)", code)
        if match is None:
            self.fail(f"a function of an unknown kind: {code}")
        parameters = []
        for parameter in [] if match[3] == "void" else match[3].split(", "):
            parameters += declarators(parameter)
        summary, tags = split_tags(self.doc)
        self.description["functions"].append(
            {
                "name": match[2],
                "returns": match[1],
                "parameters": parameters,
                "summary": summary,
                **tags,
            }
        )


def join(tokens):
    """Code in one spelling: one space between words, none before a name that a * points to."""
    code = " ".join(token.text for token in tokens if token.kind == "code")
    code = re.sub(r"\* (?=[\w*)])", "*", code)
    code = re.sub(r" (?=[,;)\]\[])|(?<=[(\[]) ", "", code)
    return re.sub(r" ?\( ?", "(", code)


def declarators(code):
    """Name, type and count of each variable that a declaration makes."""
    if pointer := re.fullmatch(r"(.+?)\(DEFREC_CALL \*(\w+)\)\((.*)\)", code):
        return [{"name": pointer[2], "type": f"{pointer[1]}(*)({pointer[3]})"}]
    first, *others = code.split(", ")
    match = re.fullmatch(r"((?:const )?\w+(?: \*(?:const \*)?)?) ?(\w+(?:\[\w+\])?)", first)
    if match is None:
        raise HeaderError(f"not understood: {code}")
    base = match[1].removesuffix(" *")
    made = []
    for declarator in [first.removeprefix(base).strip(), *others]:
        stars, name, count = re.fullmatch(
            r"(\*?(?:const \*)?)(\w+)(?:\[(\w+)\])?", declarator
        ).groups()
        made.append(
            {"name": name, "type": f"{base} {stars}".strip(), **({"count": count} if count else {})}
        )
    return made


def split_tags(text):
    """The words before the first tag; the tags. default: its remark apart."""
    words = re.split(r"\s*@\w+\s", text, 1)[0].strip()
    tags = {name: value.strip() for name, value in TAG.findall(text)}
    if remark := re.fullmatch(r"([\d.e+-]+) \((.*)\)", tags.get("default", "")):
        tags["default"], tags["default_remark"] = remark.groups()
    return words, tags


def lay_out(description):
    """Sizes and offsets of every field and struct."""
    constants = {
        value["name"]: value["value"] for each in description["enums"] for value in each["values"]
    }
    alignments, sizes = {**SCALARS}, {**SCALARS}
    callbacks = {each["name"] for each in description["callbacks"]} | {
        each["name"] for each in description["handles"]
    }
    for struct in description["structs"]:
        offset, widest = 0, 1
        for field in struct["fields"]:
            kind = field["type"].removeprefix("const ")
            is_address = "*" in kind or kind in callbacks
            if not is_address and kind not in sizes:
                raise HeaderError(f"{struct['name']}.{field['name']}: the type {kind} is unknown")
            alignment = POINTER if is_address else alignments[kind]
            if "count" in field:
                field["count"] = constants.get(field["count"]) or int(field["count"])
            field["size"] = (POINTER if is_address else sizes[kind]) * field.get("count", 1)
            field["offset"] = offset = -(-offset // alignment) * alignment
            offset += field["size"]
            widest = max(widest, alignment)
        struct["size"] = sizes[struct["name"]] = -(-offset // widest) * widest
        alignments[struct["name"]] = widest


def read(headers):
    """The description of headers, (name, text) in the order in which they include each other."""
    description = {
        "versions": {},
        "macros": [],
        "handles": [],
        "opaque": [],
        "callbacks": [],
        "enums": [],
        "structs": [],
        "functions": [],
    }
    for name, text in headers:
        Parser(name, text, description).parse()
    lay_out(description)
    return description

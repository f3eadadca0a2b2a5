"""The description as the writers read it: what a default, a range and a comment of defrec_c.h
mean."""
import math
import re

import header

NUMBER = re.compile(r"-?\d+(\.\d+)?(e-?\d+)?")
# An enumerator that says how many the others are. It grows with them.
COUNT = re.compile(r"DEFREC_\w+_COUNT(_V\d+)?")
RESULT = "defrec_result"
PIXELS = "pixels"  # what @count says of an array as large as the rectified image


class Range:
    """A range as `1..510`, `>0..`, `width..1048576` or `DEFREC_FORMAT_*`: low and high as
    expressions or None."""

    def __init__(self, text, where):
        self.enumerators = text if text.endswith("_*") else None
        self.low = self.high = None
        self.is_open = False  # the low end itself is outside
        if self.enumerators:
            return
        match = re.fullmatch(r"(>?)(.*?)\.\.(.*)", text)
        if match is None:
            raise header.HeaderError(f"{where}: @range {text} is not understood")
        self.is_open, self.low, self.high = bool(match[1]), match[2] or None, match[3] or None

    def words(self):
        if self.enumerators:
            return self.enumerators
        low, high = self.low, self.high
        if low is None or high is None:
            return (
                f"at most {high}"
                if low is None
                else f"{'above' if self.is_open else 'at least'} {low}"
            )
        return f"{'above ' if self.is_open else ''}{low} to {high}"


class Field:
    """One field of a struct, or one parameter of a function."""

    def __init__(self, owner, described):
        self.owner = owner
        self.name, self.type, self.count = (
            described["name"],
            described["type"],
            described.get("count"),
        )
        self.size, self.offset = described.get("size"), described.get("offset")
        self.summary, self.unit, self.since = (
            described.get("summary", ""),
            described.get("unit"),
            described.get("since"),
        )
        self.default, self.remark = described.get("default"), described.get("default_remark")
        self.counted_by = described.get("counted_by")
        where = f"{owner}.{self.name}"
        self.range = Range(described["range"], where) if "range" in described else None
        # The shape of an element of an array in a result: () for a number or a record, (3,), (3,
        # 4).
        components = described.get("components", "")
        if components and not re.fullmatch(r"\d+(x\d+)?", components):
            raise header.HeaderError(f"{where}: @components {components} is not understood")
        self.shape = tuple(map(int, components.split("x"))) if components else ()

    @property
    def is_address(self):
        return "*" in self.type or self.type.endswith("_fn")

    @property
    def is_text(self):
        return self.type == "const char *"

    @property
    def leads_to_array(self):
        return self.is_address and not self.is_text

    @property
    def element(self):
        """The type in an array, or that a pointer leads to."""
        return re.sub(r"^const | \*$", "", self.type)

    @property
    def is_float(self):
        return self.type in ("float", "double")

    @property
    def is_yes_or_no(self):
        """A number that is 1 for yes."""
        return self.summary.startswith("1: ")

    @property
    def is_hidden(self):
        """Nothing that a caller sets or reads."""
        return self.name == "struct_size" or self.name.startswith("reserved")

    @property
    def computed_default(self):
        """The words of a default that code computes."""
        return self.default.strip('"') if self.default and self.default.startswith('"') else None

    def default_words(self):
        if self.default is None:
            return None
        return (self.computed_default or self.default) + (
            f" ({self.remark})" if self.remark else ""
        )

    def words(self):
        """The whole comment as sentences: summary, unit, range, default."""
        parts = [self.summary.rstrip(".;")]
        if self.unit and self.unit not in self.summary:
            parts[0] = f"{parts[0]}, {self.unit}" if parts[0] else self.unit
        if self.range and not self.range.enumerators:
            parts.append(self.range.words())
        if self.default:
            parts.append(f"default {self.default_words()}")
        return "; ".join(part for part in parts if part)


class Struct:
    def __init__(self, described):
        self.name, self.header, self.size = (
            described["name"],
            described["header"],
            described["size"],
        )
        self.summary, self.since = described["summary"], described.get("since")
        self.fields = [Field(self.name, field) for field in described["fields"]]

    @property
    def has_struct_size(self):
        return self.fields[0].name == "struct_size"

    @property
    def is_params(self):
        return self.name.endswith("_params")

    @property
    def counts(self):
        """Names of the fields that count what pointers lead to."""
        return {field.counted_by for field in self.fields if field.is_address} - {None, PIXELS}

    @property
    def own_counts(self):
        """Names of the fields that count what lies in an array of the struct itself."""
        return {field.counted_by for field in self.fields if not field.is_address} - {None}

    @property
    def is_checked(self):
        """What a caller fills in and fill_defaults and range_error read."""
        return any(field.default or field.range for field in self.fields) and self.has_struct_size


class Function:
    def __init__(self, described):
        self.name, self.returns, self.summary = (
            described["name"],
            described["returns"],
            described["summary"],
        )
        self.parameters = [Field(self.name, parameter) for parameter in described["parameters"]]


class Contract:
    def __init__(self, description):
        self.description = description
        self.versions = description["versions"]
        self.handles = [handle["name"] for handle in description["handles"]]
        self.callbacks = description["callbacks"]
        self.enums = description["enums"]
        self.structs = [Struct(struct) for struct in description["structs"]]
        self.functions = [Function(function) for function in description["functions"]]
        self.struct_of = {struct.name: struct for struct in self.structs}
        self.constants = {
            value["name"]: value["value"] for enum in self.enums for value in enum["values"]
        }
        for struct in self.structs:
            for field in struct.fields:
                self.check(struct, field)
                self.check_array(struct, field)
        self.check_reasons()
        self.check_counts()

    def check(self, struct, field):
        """That expressions name what there is."""
        known = {other.name for other in struct.fields} | set(self.constants) | {"bytes_per_pixel"}
        default = None if field.computed_default else field.default
        ends = [field.range.low, field.range.high] if field.range else []
        for expression in filter(None, [default, *ends]):
            for word in re.findall(
                r"[A-Za-z_]\w*", "" if NUMBER.fullmatch(expression) else expression
            ):
                if word not in known:
                    raise header.HeaderError(
                        f"{struct.name}.{field.name}: {expression}: there is no {word}"
                    )
        if field.range and field.range.enumerators:
            self.enumerators(field.range.enumerators)

    def check_array(self, struct, field):
        """That an array of a result says how long it is, and of which numbers its elements
        consist."""
        where = f"{struct.name}.{field.name}"
        known = {other.name for other in struct.fields} | {PIXELS}
        if field.counted_by and field.counted_by not in known:
            raise header.HeaderError(
                f"{where}: @count {field.counted_by}: there is no {field.counted_by}"
            )
        if struct.name == RESULT and field.is_address and not (field.is_text or field.counted_by):
            raise header.HeaderError(f"{where}: @count is missing")
        if (
            struct.name == RESULT
            and field.count
            and not (field.counted_by or math.prod(field.shape) == field.count)
        ):
            raise header.HeaderError(
                f"{where}: @components that are {field.count}, or @count expected"
            )

    def check_reasons(self):
        for value in self.values("DEFREC_REASON_"):
            if "remedy" not in value:
                raise header.HeaderError(f"{value['name']}: @remedy is missing")

    def check_counts(self):
        """That what is said to be the number of enumerators is."""
        for enum in self.enums:
            for value in enum["values"]:
                if COUNT.fullmatch(value["name"]) and value["value"] != len(enum["values"]) - 1:
                    raise header.HeaderError(
                        f"{value['name']} is {value['value']}: there are {len(enum['values']) - 1}"
                    )

    def values(self, prefix):
        """The enumerators whose names begin with it."""
        return [
            value
            for enum in self.enums
            for value in enum["values"]
            if value["name"].startswith(prefix)
        ]

    def holds_texts(self, field):
        """Whether an array is one of records with texts."""
        struct = self.struct_of.get(field.element)
        return struct is not None and any(each.is_text for each in struct.fields)

    @property
    def result(self):
        return self.struct_of[RESULT]

    def enumeration(self, name):
        """The enumerators of the enumeration that has this one."""
        return next(
            enum["values"]
            for enum in self.enums
            if any(value["name"] == name for value in enum["values"])
        )

    def enumerators(self, pattern):
        """The enumeration whose names all begin as DEFREC_FORMAT_* says."""
        for enum in self.enums:
            if all(value["name"].startswith(pattern[:-1]) for value in enum["values"]):
                return enum["values"]
        raise header.HeaderError(f"there is no enumeration {pattern}")

    @property
    def stages(self):
        """Names of the stages, in their order."""
        prefix = "DEFREC_STAGE_"
        return [
            value["name"].removeprefix(prefix).lower()
            for value in self.values(prefix)
            if not COUNT.fullmatch(value["name"])
        ]

    @property
    def params(self):
        return [struct for struct in self.structs if struct.is_params]

    @property
    def application_structs(self):
        return [struct for struct in self.structs if struct.header == "defrec_c.h"]

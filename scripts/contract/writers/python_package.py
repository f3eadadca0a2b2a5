"""The names of the Python package: what it takes from modules that are generated, the classes of
the stages, and __all__."""
import ast

from names import CONSTANTS, enumeration_of, pascal
from writers.csharp import is_public
from writers.python_binding import class_name

PACKAGE = "bindings/python/defrec/__init__.py"
# Type checkers do not compute what __all__ is.
START = "# By scripts/contract/generate.py: the names of the C API, and everything public."
END = "# End of what is generated."


def generated_names(contract):
    """Names by the module that has them."""
    enums = []
    for enum in contract.enums:
        kind = enumeration_of(enum["values"])
        enums += [kind.python] if kind else []
        enums += [
            value["name"].removeprefix("DEFREC_")
            for value in enum["values"]
            if kind is None or value["name"] in CONSTANTS
        ]
    structs = [
        class_name(struct.name)
        for struct in contract.application_structs
        if is_public(contract, struct)
    ]
    stages = [f"{pascal(stage)}Stage" for stage in contract.stages]
    return {"enums": enums, "stages": stages, "structs": structs}


def imported_names(source):
    """What a module takes from modules of its package."""
    froms = [
        node
        for node in ast.parse(source).body
        if isinstance(node, ast.ImportFrom) and node.level == 1
    ]
    names = [alias.asname or alias.name for node in froms for alias in node.names]
    return [name for name in names if not name.startswith("_")]


def in_order(names):
    """Constants, classes, functions."""
    return sorted(
        names, key=lambda name: (0 if name.isupper() else 1 if name[0].isupper() else 2, name)
    )


def parts(contract, root):
    by_hand, _, rest = (root / PACKAGE).read_text().partition(START)
    by_hand += rest.partition(END)[2]
    made = generated_names(contract)
    lines = []
    for module, names in made.items():
        lines += [f"from .{module} import (", *(f"    {name}," for name in in_order(names)), ")"]
    public = in_order(
        [*imported_names(by_hand), *(name for names in made.values() for name in names)]
    )
    lines += ["", "__all__ = [", *(f'    "{name}",' for name in public), "]"]
    return {PACKAGE: [(START, END, "\n".join(lines))]}


def files(contract, root):
    return {}

"""What scripts/contract/generate.py read in the headers."""
import ctypes
import json
import pathlib

from defrec import OrbParams, structs
from defrec._struct import C_STRUCTS

CONTRACT = json.loads(
    (pathlib.Path(__file__).resolve().parents[3] / "sdk" / "contract" / "contract.json").read_text()
)
STRUCTS = {
    struct["name"]: struct for struct in CONTRACT["structs"] if struct["header"] == "defrec_c.h"
}
HANDLES = {handle["name"] for handle in CONTRACT["handles"]}
KEPT = []  # until the end of the tests


def argument(index, parameter):
    """What a function is given for a parameter, and what the stub writes down."""
    name, c_type = parameter["name"], parameter["type"]
    struct = C_STRUCTS.get(c_type.removeprefix("const ").removesuffix(" *"))
    if c_type in HANDLES:
        return 0x1000 + index, hex(0x1000 + index)
    if c_type.removesuffix(" *") in HANDLES:
        return ctypes.byref(ctypes.c_void_p()), "^0x"
    if c_type == "const char *":
        return f"text {index}".encode(), f'^"text {index}"$'
    if name in ("in", "out") and struct in (structs.ConstBuffer, structs.Buffer):
        return ctypes.byref(struct(size=index)), rf"^\[{index}\]$"
    if struct or c_type == "const void *":
        made = (struct or OrbParams)()
        KEPT.append(made)
        given = bytes(made).hex() if c_type.startswith("const") else rf"\{{{ctypes.sizeof(made)}\}}"
        return (ctypes.byref(made) if struct else ctypes.addressof(made)), f"^{given}$"
    if "*" in c_type:
        array = (ctypes.c_double * 36)()  # the longest element is the covariance of a pose
        KEPT.append(array)
        return ctypes.addressof(array), (
            r"^\[0(, 0)+\]$" if c_type.startswith("const") else "^written$"
        )
    return (1, "^1$") if name.endswith("count") else (index + 1, f"^{index + 1}$")

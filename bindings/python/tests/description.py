"""What scripts/contract/generate.py read in the headers."""
import json
import pathlib

CONTRACT = json.loads((pathlib.Path(__file__).resolve().parents[3] / "sdk" / "contract" / "contract.json").read_text())
STRUCTS = {struct["name"]: struct for struct in CONTRACT["structs"] if struct["header"] == "defrec_c.h"}

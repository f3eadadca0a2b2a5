"""The names of reasons in the sample that shows them."""
from writers.cpp import reason_names

SAMPLE = "samples/c/live_loop.c"


def parts(contract, root):
    rows = [f'    {{{name}, "{word}"}},' for name, word in reason_names(contract, " ")]
    return {
        SAMPLE: [
            ("    /* By scripts/contract/generate.py: every reason. */", "};", "\n".join(rows))
        ]
    }


def files(contract, root):
    return {}

#!/usr/bin/env python3
"""Verifies a release's folder, offline: its signature, and that it holds the files that were
signed, all of them and nothing else; then the envelope of each statement of provenance by itself.

verify.py FOLDER [--signers FILE] [--revoked FILE] [--at YYYYMMDD]
signers: keys that may sign (default: allowed_signers beside this program); revoked: keys that no
longer may (revoked_keys). Both must have come another way than FOLDER. --at: the day on which a key
has to be valid, for a release that is older than its key's end (default: now). Exit status: 0, or 1
where it is refused. Needs OpenSSH 8.9.
"""
import argparse
import json
import sys

import envelope
import sums


def main():
    parser = argparse.ArgumentParser(description=" ".join(__doc__.split("\n\n")[0].split()))
    parser.add_argument("folder")
    parser.add_argument("--signers", default=sums.SIGNERS)
    parser.add_argument("--revoked", default=sums.REVOKED)
    parser.add_argument("--at")
    given = parser.parse_args()
    try:
        names, signer = sums.check_folder(given.folder, given.signers, given.revoked, given.at)
        envelope.check_folder(given.folder, given.signers, given.revoked, given.at)
    except (sums.Refused, OSError, json.JSONDecodeError) as error:
        sys.exit(f"REFUSED: {error}")
    print("\n".join(names))
    print(f"verified: {len(names)} files. {signer}")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Puts each statement of provenance into a signed envelope, and writes SHA256SUMS of a release's
folder and SHA256SUMS.sig, an OpenSSH signature of it.

sign.py KEY FOLDER [--without KIND]... [--signers FILE] [--revoked FILE]
KEY is a private key, or the public key of one that ssh-agent or a token holds. Refused are a folder
with something that is no artefact of a release, or without one of the kinds of artefacts that is
not named by --without; binaries without provenance, or other than it says; and a key whose
signature a verifier would refuse today. Needs OpenSSH 8.9.
"""
import argparse
import json
import pathlib
import re
import sys

import envelope
import provenance
import sums

KINDS = {
    "deb": r"(lib)?defrec[a-z0-9-]*_[^_]+_[a-z0-9]+\.deb",
    "wheel": r"defrec-[^-]+-.+\.whl",
    "nupkg": r"Defrec\.[0-9.]+\.nupkg",
    "zip": r"defrec-[0-9.]+-windows-x86_64\.zip",
    "source": r"defrec-[0-9.]+\.tar\.xz",
    "cyclonedx": r"bom\.json",
    "spdx": r"bom\.spdx\.json",
    "vex": r"vex\.openvex\.json",
    "provenance": envelope.NAME.pattern,
    "site": r"defrec-[0-9.]+-site\.tar\.xz",
}


def check_kinds(names, without):
    kinds = {
        name: {kind for kind, pattern in KINDS.items() if re.fullmatch(pattern, name)}
        for name in names
    }
    if strangers := [name for name, found in kinds.items() if not found]:
        raise sums.Refused(f"no artefact of a release: {', '.join(strangers)}")
    there = set().union(*kinds.values())
    if missing := sorted(set(KINDS) - there - set(without)):
        raise sums.Refused(f"there is no {', '.join(missing)}")
    if wrong := sorted(there & set(without)):
        raise sums.Refused(f"--without {', '.join(wrong)}, and there is one")


def check_provenance(folder, names):
    """Every statement holds for the artefacts that it names, and each binary has one."""
    told = set()
    for name in names:
        if re.fullmatch(KINDS["provenance"], name):
            statement = provenance.read(folder / name)
            provenance.check_folder(statement, folder)
            told |= set(provenance.digests_of(statement))
    binaries = [
        name
        for name in names
        if any(re.fullmatch(KINDS[kind], name) for kind in ("deb", "wheel", "nupkg", "zip"))
    ]
    if without := sorted(set(binaries) - told):
        raise sums.Refused(f"no provenance of {', '.join(without)}")


def sign(key, folder, without, signers, revoked):
    folder = pathlib.Path(folder)
    names = sums.files_of(folder)
    check_kinds(names, without)
    if "provenance" not in without:
        check_provenance(folder, names)
    envelopes = {
        name: envelope.sign(name, provenance.bytes_of(folder / name), key, signers, revoked)
        for name in names
        if envelope.NAME.fullmatch(name)
    }
    for name, text in envelopes.items():
        (folder / name).write_text(text)
    target, signature = folder / sums.SUMS, folder / sums.SIGNATURE
    signature.unlink(missing_ok=True)  # of other sums
    target.write_text(sums.sums_of(folder, names))
    signature.write_bytes(sums.signature_of(key, target.read_bytes()))
    try:
        return sums.check_folder(folder, signers, revoked)
    except sums.Refused:
        signature.unlink()
        raise


def main():
    parser = argparse.ArgumentParser(description=" ".join(__doc__.split("\n\n")[0].split()))
    parser.add_argument("key")
    parser.add_argument("folder")
    parser.add_argument("--without", action="append", default=[], choices=sorted(KINDS))
    parser.add_argument("--signers", default=sums.SIGNERS)
    parser.add_argument("--revoked", default=sums.REVOKED)
    given = parser.parse_args()
    try:
        names, signer = sign(given.key, given.folder, given.without, given.signers, given.revoked)
    except (sums.Refused, OSError, KeyError, json.JSONDecodeError) as error:
        sys.exit(f"not signed: {error}")
    print(f"{len(names)} files signed. {signer}")


if __name__ == "__main__":
    main()

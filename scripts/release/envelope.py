"""A statement in an envelope as DSSE v1 has it (Dead Simple Signing Envelope,
https://github.com/secure-systems-lab/dsse), signed by OpenSSH as SHA256SUMS is."""
import base64
import binascii
import json
import pathlib
import re
import tempfile

import sums

# Files of a release that are in an envelope.
NAME = re.compile(r"provenance(-[a-z0-9]+)?\.intoto\.json")
PAYLOAD_TYPE = "application/vnd.in-toto+json"
FIELDS = {"payload", "payloadType", "signatures"}
ARMOUR = "-----{} SSH SIGNATURE-----\n"


def encoded(payload):
    """DSSE's pre-authentication encoding: the bytes that are signed."""
    kind = PAYLOAD_TYPE.encode()
    return b"DSSEv1 %d %b %d %b" % (len(kind), kind, len(payload), payload)


def is_envelope(content):
    return isinstance(content, dict) and "payload" in content


def payload_of(content):
    """Bytes of the statement in the envelope, whose signature is not looked at."""
    if set(content) != FIELDS or content["payloadType"] != PAYLOAD_TYPE:
        raise sums.Refused(f"no envelope of {PAYLOAD_TYPE}")
    return decoded(content["payload"])


def decoded(text):
    try:
        return base64.b64decode(text, validate=True)
    except (TypeError, ValueError, binascii.Error) as error:
        raise sums.Refused(f"no base64: {error}") from error


def check(name, content, signers, revoked, at=None):
    """Raises Refused unless the envelope has one signature and it is by a key that sums.py's
    check_signature takes. Returns the bytes of the statement, and what ssh-keygen says of the
    key."""
    if not is_envelope(content):
        raise sums.Refused(f"{name} is in no envelope")
    payload, signatures = payload_of(content), content["signatures"]
    if not isinstance(signatures, list) or len(signatures) != 1:
        raise sums.Refused(f"{name} has not one signature")
    body = base64.b64encode(decoded(signatures[0].get("sig"))).decode()
    lines = [body[i : i + 70] + "\n" for i in range(0, len(body), 70)]
    with tempfile.NamedTemporaryFile("w", suffix=".sig") as signature:
        signature.write("".join([ARMOUR.format("BEGIN"), *lines, ARMOUR.format("END")]))
        signature.flush()
        said = sums.check_signature(name, encoded(payload), signature.name, signers, revoked, at)
    return payload, said


def sign(name, payload, key, signers, revoked):
    """The envelope's text, once its signature is found to hold."""
    signature = sums.signature_of(key, encoded(payload)).decode()
    content = {
        "payload": base64.b64encode(payload).decode(),
        "payloadType": PAYLOAD_TYPE,
        "signatures": [{"sig": "".join(signature.strip().splitlines()[1:-1])}],
    }
    _, said = check(name, content, signers, revoked)
    content["signatures"][0]["keyid"] = re.search(r"SHA256:\S+", said)[0]
    return json.dumps(content, indent=1, sort_keys=True) + "\n"


def check_folder(folder, signers, revoked, at=None):
    """Each statement of a release's folder is in an envelope whose signature holds. Returns how
    many there are."""
    names = [name for name in sums.files_of(folder) if NAME.fullmatch(name)]
    for name in names:
        content = json.loads((pathlib.Path(folder) / name).read_text())
        check(name, content, signers, revoked, at)
    return len(names)

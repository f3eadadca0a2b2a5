"""SHA256SUMS of a release's folder and its OpenSSH signature, for sign.py and verify.py; and
signatures by the same keys, for envelope.py."""
import hashlib
import pathlib
import re
import stat
import subprocess

SUMS, SIGNATURE = "SHA256SUMS", "SHA256SUMS.sig"
# A signature of another namespace (git's, a mail's) by the same key is none of a release.
NAMESPACE = "defrec-release"
SIGNER = "defrec-release"
SIGNERS = pathlib.Path(__file__).parent / "allowed_signers"
REVOKED = pathlib.Path(__file__).parent / "revoked_keys"
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+~-]*")


class Refused(Exception):
    """The folder is not what was signed, or cannot be signed."""


def sha256(path):
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def files_of(folder):
    """Names of what lies in the folder, without sums and signature."""
    names = []
    for path in sorted(pathlib.Path(folder).iterdir()):
        if not stat.S_ISREG(path.lstat().st_mode):
            raise Refused(f"{path.name} is no regular file")
        if not NAME.fullmatch(path.name):
            raise Refused(f"{path.name!r} is no name of an artefact")
        if path.name not in (SUMS, SIGNATURE):
            names.append(path.name)
    return names


def sums_of(folder, names):
    """As sha256sum writes and reads them."""
    return "".join(f"{sha256(pathlib.Path(folder) / name)}  {name}\n" for name in names)


def parsed(sums):
    """{name: SHA-256}; nothing but what sums_of writes."""
    found = {}
    for line in sums.decode("ascii", "replace").split("\n")[:-1]:
        match = re.fullmatch(rf"([0-9a-f]{{64}})  ({NAME.pattern})", line)
        if match is None or match[2] in found or match[2] in (SUMS, SIGNATURE):
            raise Refused(f"{SUMS} has the line {line!r}")
        found[match[2]] = match[1]
    if not found or not sums.endswith(b"\n"):
        raise Refused(f"{SUMS} is empty or cut off")
    return found


def signature_of(key, content):
    """OpenSSH's signature of the bytes, with its armour."""
    command = ["ssh-keygen", "-Y", "sign", "-n", NAMESPACE, "-f", str(key)]
    run = subprocess.run(command, input=content, capture_output=True, check=False)
    if run.returncode != 0:
        raise Refused(f"{key} signs nothing: {run.stderr.decode(errors='replace').strip()}")
    return run.stdout


def check_signature(name, content, signature, signers, revoked, at=None):
    """Raises Refused unless `signature`, a file, is one of the bytes `content` of what is called
    `name`, by a key that `signers` allows now, or at the time `at` (YYYYMMDD or YYYYMMDDHHMMSSZ),
    and `revoked` does not name. Returns what ssh-keygen says of the key."""
    for path in (signature, signers, revoked):
        if not pathlib.Path(path).is_file():
            raise Refused(f"there is no {path}")
    command = ["ssh-keygen", "-Y", "verify", "-n", NAMESPACE, "-I", SIGNER]
    command += ["-f", str(signers), "-r", str(revoked), "-s", str(signature)]
    if at is not None:
        command += ["-O", f"verify-time={at}"]
    run = subprocess.run(command, input=content, capture_output=True, check=False)
    said = (run.stdout + run.stderr).decode(errors="replace").strip()
    if run.returncode != 0:
        raise Refused(f"the signature of {name} does not hold: {said}")
    return said


def check_folder(folder, signers, revoked, at=None):
    """Raises Refused unless the folder holds what was signed, all of it and nothing else. Returns
    the files' names, and what ssh-keygen says of the key."""
    folder = pathlib.Path(folder)
    names = files_of(folder)
    if not (folder / SUMS).is_file():
        raise Refused(f"there is no {SUMS}")
    sums = (folder / SUMS).read_bytes()  # once: what is checked is what is used
    signer = check_signature(SUMS, sums, folder / SIGNATURE, signers, revoked, at)
    listed = parsed(sums)
    if missing := sorted(set(listed) - set(names)):
        raise Refused(f"missing: {', '.join(missing)}")
    if unlisted := sorted(set(names) - set(listed)):
        raise Refused(f"not listed in {SUMS}: {', '.join(unlisted)}")
    if changed := [name for name in names if sha256(folder / name) != listed[name]]:
        raise Refused(f"changed: {', '.join(changed)}")
    return names, signer

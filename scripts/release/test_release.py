#!/usr/bin/env python3
"""A release's folder is signed with throw-away keys and verified; each way to spoil it is refused.

Exit status 77 where there is no ssh-keygen. What runs is what users call: sign.py and verify.py.
"""
import base64
import contextlib
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import provenance
import sums

HERE = pathlib.Path(__file__).parent
# The contents do not matter, but one is longer than a block of sha256().
FILES = {
    "libdefrec1_0.1.0-1_amd64.deb": b"library",
    "defrec-0.1.0-py3-none-manylinux_2_35_x86_64.whl": b"wheel",
    "Defrec.0.1.0.nupkg": b"package",
    "defrec-0.1.0-windows-x86_64.zip": bytes(1 << 21),
    "defrec-0.1.0.tar.xz": b"sources",
    "defrec-0.1.0-site.tar.xz": b"site",
    "bom.json": b"{}",
    "bom.spdx.json": b"{}",
    "vex.openvex.json": b"{}",
}
PROVENANCE = "provenance.intoto.json"
ONE = "bom.json"


def run(program, *arguments):
    return subprocess.run(
        [sys.executable, "-B", HERE / program, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
    )


class Release(unittest.TestCase):
    def setUp(self):
        stack = contextlib.ExitStack()
        self.addCleanup(stack.close)
        self.work = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory()))
        self.key = self.new_key("key")
        self.signers, self.revoked = self.work / "signers", self.work / "revoked"
        self.allow(self.key)
        self.revoked.write_text("# none\n")
        self.folder = self.work / "release"
        self.folder.mkdir()
        for name, content in FILES.items():
            (self.folder / name).write_bytes(content)
        self.files = [*FILES, PROVENANCE]
        (self.folder / PROVENANCE).write_text(provenance.text_of(self.statement()))

    def statement(self):
        artefacts = [self.folder / name for name in FILES if not name.endswith(".json")]
        definition = {"buildType": provenance.BUILD_TYPE}
        return {
            "_type": provenance.STATEMENT_TYPE,
            "subject": provenance.subjects_of([], artefacts),
            "predicateType": provenance.PREDICATE_TYPE,
            "predicate": {"buildDefinition": definition},
        }

    def new_key(self, name):
        key = self.work / name
        command = ["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-C", name, "-f", str(key)]
        subprocess.run(command, check=True)
        return key

    def public(self, key):
        return pathlib.Path(f"{key}.pub").read_text()

    def allow(self, *keys, options=f'namespaces="{sums.NAMESPACE}"'):
        lines = [f"{sums.SIGNER} {options} {self.public(key)}" for key in keys]
        self.signers.write_text("".join(lines))

    def trust(self):
        return "--signers", self.signers, "--revoked", self.revoked

    def sign(self, *options, key=None):
        return run("sign.py", key or self.key, self.folder, *self.trust(), *options)

    def signed(self):
        result = self.sign()
        self.assertEqual(result.returncode, 0, result.stderr)

    def verify(self, *options):
        return run("verify.py", self.folder, *self.trust(), *options)

    def expect_refused(self, why, *options):
        result = self.verify(*options)
        self.assertEqual(result.returncode, 1, result.stdout)
        self.assertRegex(result.stderr, f"^REFUSED: .*{why}")

    def test_good(self):
        self.signed()
        result = self.verify()
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn(f"verified: {len(self.files)} files.", result.stdout)
        # sha256sum and ssh-keygen alone, as the guide has it.
        command = ["sha256sum", "--check", "--strict", "--quiet", sums.SUMS]
        subprocess.run(command, cwd=self.folder, check=True)

    def test_the_same_files_give_the_same_sums(self):
        self.signed()
        first = [(self.folder / name).read_bytes() for name in (sums.SUMS, sums.SIGNATURE)]
        self.signed()
        again = [(self.folder / name).read_bytes() for name in (sums.SUMS, sums.SIGNATURE)]
        self.assertEqual(first, again)

    def test_changed_byte_of_each_file(self):
        self.signed()
        for name in self.files:
            path = self.folder / name
            good = path.read_bytes()
            path.write_bytes(good[:-1] + bytes([good[-1] ^ 1]))
            self.expect_refused(f"changed: {name}")
            path.write_bytes(good)
        self.assertEqual(self.verify().returncode, 0)

    def test_changed_sums(self):
        self.signed()
        path = self.folder / ONE
        path.write_bytes(b"another")
        (self.folder / sums.SUMS).write_text(sums.sums_of(self.folder, sorted(self.files)))
        self.expect_refused("signature of SHA256SUMS does not hold")

    def test_changed_signature(self):
        self.signed()
        path = self.folder / sums.SIGNATURE
        lines = path.read_text().splitlines(keepends=True)
        lines[3] = lines[3][::-1].lstrip("\n") + "\n"
        path.write_text("".join(lines))
        self.expect_refused("does not hold")
        path.unlink()
        self.expect_refused("there is no .*SHA256SUMS.sig")

    def test_missing_file(self):
        self.signed()
        (self.folder / ONE).unlink()
        self.expect_refused(f"missing: {ONE}")

    def test_unlisted_file(self):
        self.signed()
        (self.folder / "libdefrec1-extra_0.1.0-1_amd64.deb").write_bytes(b"extra")
        self.expect_refused("not listed in SHA256SUMS: libdefrec1-extra")

    def test_what_is_no_file(self):
        self.signed()
        (self.folder / "more").mkdir()
        self.expect_refused("more is no regular file")
        (self.folder / "more").rmdir()
        moved = self.work / ONE
        (self.folder / ONE).rename(moved)
        (self.folder / ONE).symlink_to(moved)
        self.expect_refused(f"{ONE} is no regular file")

    def test_no_sums(self):
        self.signed()
        (self.folder / sums.SUMS).unlink()
        self.expect_refused("there is no SHA256SUMS")

    def test_another_key(self):
        self.signed()
        self.allow(self.new_key("another"))
        self.expect_refused("does not hold")

    def test_nobody_is_allowed(self):
        self.signed()
        shutil.copy(HERE / "allowed_signers", self.signers)
        if not [line for line in self.signers.read_text().splitlines() if line[:1] != "#"]:
            self.expect_refused("does not hold")
        self.signers.unlink()
        self.expect_refused("there is no .*signers")

    def test_another_signer(self):
        self.signed()
        self.signers.write_text(f"somebody {self.public(self.key)}")
        self.expect_refused("does not hold")

    def test_another_namespace(self):
        self.signed()
        (self.folder / sums.SIGNATURE).unlink()
        command = ["ssh-keygen", "-q", "-Y", "sign", "-n", "git", "-f", str(self.key)]
        subprocess.run([*command, str(self.folder / sums.SUMS)], check=True, capture_output=True)
        self.allow(self.key, options="")
        self.expect_refused("does not hold")

    def test_revoked_key(self):
        self.signed()
        self.revoked.write_text(f"# lost\n{self.public(self.key)}")
        self.expect_refused("does not hold")
        self.expect_refused("does not hold", "--at", "20260101")
        self.revoked.write_text("# found again\n")
        self.assertEqual(self.verify().returncode, 0)
        self.revoked.unlink()
        self.expect_refused("there is no .*revoked")

    def test_expired_key(self):
        self.signed()
        self.allow(self.key, options='valid-after="20200101",valid-before="20210101"')
        self.expect_refused("does not hold")
        self.expect_refused("does not hold", "--at", "20191231")
        self.expect_refused("does not hold", "--at", "20210102")
        self.assertEqual(self.verify("--at", "20200601").returncode, 0)

    def test_key_of_a_later_day(self):
        self.signed()
        self.allow(self.key, options='valid-after="29990101"')
        self.expect_refused("does not hold")

    def test_old_and_new_key(self):
        self.signed()
        new = self.new_key("new")
        self.allow(self.key, new)
        self.assertEqual(self.verify().returncode, 0)
        self.assertEqual(self.sign(key=new).returncode, 0)
        self.assertEqual(self.verify().returncode, 0)

    def test_signs_only_what_verifies(self):
        result = self.sign(key=self.new_key("another"))
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, f"^not signed: the signature of {PROVENANCE} does not hold")
        self.assertNotIn("payload", json.loads((self.folder / PROVENANCE).read_text()))
        (self.folder / PROVENANCE).unlink()
        result = self.sign("--without", "provenance", key=self.work / "another")
        self.assertRegex(result.stderr, "^not signed: the signature of SHA256SUMS does not hold")
        self.assertFalse((self.folder / sums.SIGNATURE).exists())

    def envelope(self):
        return json.loads((self.folder / PROVENANCE).read_text())

    def test_envelope(self):
        statement = (self.folder / PROVENANCE).read_bytes()
        self.signed()
        envelope = self.envelope()
        self.assertEqual(envelope["payloadType"], "application/vnd.in-toto+json")
        self.assertEqual(base64.b64decode(envelope["payload"]), statement)
        (signature,) = envelope["signatures"]
        fingerprint = subprocess.run(
            ["ssh-keygen", "-lf", f"{self.key}.pub"], capture_output=True, text=True, check=True
        ).stdout.split()[1]
        self.assertEqual(signature["keyid"], fingerprint)
        # By ssh-keygen alone, as the guide has it.
        armoured = self.work / "statement.sig"
        armoured.write_text(
            f"-----BEGIN SSH SIGNATURE-----\n{signature['sig']}\n-----END SSH SIGNATURE-----\n"
        )
        command = ["ssh-keygen", "-Y", "verify", "-n", sums.NAMESPACE, "-I", sums.SIGNER]
        command += ["-f", str(self.signers), "-s", str(armoured)]
        signed = b"DSSEv1 28 application/vnd.in-toto+json %d %b" % (len(statement), statement)
        subprocess.run(command, input=signed, check=True, capture_output=True)
        result = run(
            "provenance.py",
            "check",
            self.folder / PROVENANCE,
            "--folder",
            self.folder,
            *self.trust(),
        )
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn(fingerprint, result.stdout)

    def test_spoiled_envelopes(self):
        """In a release whose sums are signed, so that the envelopes alone are wrong."""
        self.signed()
        good = self.envelope()
        payload = base64.b64decode(good["payload"])
        other = base64.b64encode(payload.replace(b'"subject"', b'"Subject"')).decode()
        sig = good["signatures"][0]["sig"]
        changed = sig[:-8] + ("A" if sig[-8] != "A" else "B") + sig[-7:]
        for spoiled, why in (
            ({**good, "payload": other}, "signature of .* does not hold"),
            ({**good, "payload": good["payload"] + "\n"}, "no base64"),
            ({**good, "signatures": [{"sig": changed}]}, "does not hold"),
            ({**good, "signatures": [{}]}, "no base64"),
            ({**good, "signatures": []}, "has not one signature"),
            ({**good, "payloadType": "text/plain"}, "no envelope of"),
            (json.loads(payload), "is in no envelope"),
        ):
            (self.folder / PROVENANCE).write_text(json.dumps(spoiled))
            self.sign_sums()
            self.expect_refused(why)
        (self.folder / PROVENANCE).write_text(json.dumps(good))
        self.sign_sums()
        self.assertEqual(self.verify().returncode, 0)

    def sign_sums(self):
        text = sums.sums_of(self.folder, sorted(self.files))
        (self.folder / sums.SUMS).write_text(text)
        signature = sums.signature_of(self.key, text.encode())
        (self.folder / sums.SIGNATURE).write_bytes(signature)

    def test_envelope_of_a_revoked_key(self):
        self.signed()
        old = self.envelope()
        new = self.new_key("new")
        self.allow(self.key, new)
        self.assertEqual(self.sign(key=new).returncode, 0)
        self.assertNotEqual(self.envelope(), old)  # signed anew, not twice
        self.assertEqual(self.envelope()["payload"], old["payload"])
        (self.folder / PROVENANCE).write_text(json.dumps(old))
        self.key = new
        self.sign_sums()
        self.assertEqual(self.verify().returncode, 0)
        self.revoked.write_text(self.public(self.work / "key"))
        self.expect_refused(f"signature of {PROVENANCE} does not hold")

    def test_signs_only_artefacts(self):
        shutil.copy(self.key, self.folder)
        result = self.sign()
        self.assertEqual(result.returncode, 1)
        self.assertIn("not signed: no artefact of a release: key", result.stderr)

    def test_signs_only_whole_releases(self):
        (self.folder / "vex.openvex.json").unlink()
        result = self.sign()
        self.assertEqual(result.returncode, 1)
        self.assertIn("not signed: there is no vex", result.stderr)
        self.assertEqual(self.sign("--without", "vex").returncode, 0)
        self.assertEqual(self.sign("--without", "vex", "--without", "deb").returncode, 1)

    def test_signs_only_what_was_built(self):
        (self.folder / "Defrec.0.1.0.nupkg").write_bytes(b"another")
        result = self.sign()
        self.assertEqual(result.returncode, 1)
        self.assertIn("not signed: other bytes: Defrec.0.1.0.nupkg", result.stderr)

    def test_lines_that_are_no_sums(self):
        line = f"{'0' * 64}  a\n".encode()
        self.assertEqual(sums.parsed(line), {"a": "0" * 64})
        for bad in (
            b"",
            line[:-1],
            line + line,
            line.replace(b"  ", b" *"),
            line.replace(b"a\n", b"../a\n"),
            line.replace(b"a\n", b"/a\n"),
            line.replace(b"a\n", b"SHA256SUMS\n"),
            line.replace(b"0000", b"000g"),
            line.replace(b"0000", b"000A"),
            line + b"\n",
        ):
            with self.assertRaises(sums.Refused, msg=bad):
                sums.parsed(bad)


if __name__ == "__main__":
    if shutil.which("ssh-keygen") is None:
        print("skipped: there is no ssh-keygen")
        sys.exit(77)
    unittest.main()

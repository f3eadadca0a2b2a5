#!/usr/bin/env python3
"""The sample live_view: what its page is given is what was tracked, and nobody without the token is
given anything.

test_live_view.py PROGRAM SEQUENCE CAMERA
"""
import http.client
import json
import pathlib
import os
import re
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import time

# What the page says, in turn, of answers that have no frame yet, one of now and one that is old.
PAGE = """
const facts = (age) => JSON.stringify({
  age_ms: age, frame: 7, state: 'tracking', latency_ms: 5, width: 1, height: 1, vertices: 0});
const bytes = (age) => Uint8Array.from([...Buffer.from(facts(age) + '\\n'), 1, 2, 3]).buffer;
const answers = [[503], [503], [200, 20], [200, 2500]];
const context = {createImageData: () => ({data: []}), putImageData() {}};
const view = {style: {}, getContext: () => context};
const text = {set textContent(said) { console.log(said + '|' + (view.style.filter ?? '')); }};
globalThis.document = {getElementById: (id) => ({view, text})[id]};
globalThis.requestAnimationFrame = setImmediate;
globalThis.fetch = async () => {
  const [status, age] = answers.shift() ?? process.exit(0);
  return {status, arrayBuffer: async () => (status === 200 ? bytes(age) : new ArrayBuffer(13))};
};
"""


def get(port, path, host=None):
    """Status and content."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    connection.request("GET", path, headers={"Host": host or f"127.0.0.1:{port}"})
    response = connection.getresponse()
    return response.status, response.read()


def first_frame(port, token):
    while True:
        status, content = get(port, f"/{token}/frame")
        if status == 200:
            return content
        assert status == 503, status
        time.sleep(0.01)


def facts_of(content):
    return json.loads(content.split(b"\n", 1)[0])


def check_page(page):
    node = shutil.which("node")
    if node is None:
        return
    script = f"{{{PAGE}}}" + re.search(r"<script>(.*)</script>", page.decode(), re.S)[1]
    said = subprocess.run([node, "-e", script], stdout=subprocess.PIPE, text=True, check=True)
    assert said.stdout.splitlines() == [
        "frame 7: tracking, 5.0 ms|",
        "no new picture for 2.5 s|grayscale(1)",
    ], said


def check_standstill(program, sequence, camera):
    """An image that does not come holds up the tracker's thread: frames say how old they are."""
    with tempfile.TemporaryDirectory() as folder:
        views = [pathlib.Path(folder) / view for view in ("left", "right")]
        for view in views:
            view.mkdir()
            for image in sorted((sequence / view.name).iterdir()):
                (view / image.name).symlink_to(image.resolve())
        os.mkfifo(views[0] / "last.png")
        (views[1] / "last.png").symlink_to(image.resolve())
        command = [program, *map(str, views), camera, "1", "cpu"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
            try:
                port, token = address_of(running)
                while facts_of(first_frame(port, token))["age_ms"] <= 1000:
                    time.sleep(0.01)
            finally:
                running.kill()


def address_of(running):
    port, token = re.fullmatch(
        r"open http://127\.0\.0\.1:(\d+)/([0-9a-f]{32})/\n", running.stdout.readline()
    ).groups()
    return int(port), token


def main():
    program, sequence, camera = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3]
    command = [program, str(sequence / "left"), str(sequence / "right"), camera]
    usage = subprocess.run([*command, "0"], stderr=subprocess.PIPE, text=True)
    assert usage.returncode == 2 and usage.stderr.startswith("usage: live_view"), usage

    # More rounds than the test needs; it ends the program.
    with subprocess.Popen([*command, "1000", "cpu"], stdout=subprocess.PIPE, text=True) as running:
        try:
            port, token = address_of(running)
            # A browser that asks and goes, and one that says nothing.
            with socket.create_connection(("127.0.0.1", port)) as gone:
                gone.sendall(
                    f"GET /{token}/frame HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode()
                )
            silent = socket.create_connection(("127.0.0.1", port))

            content = first_frame(port, token)
            facts, rest = facts_of(content), content.split(b"\n", 1)[1]
            pixels = 3 * facts["width"] * facts["height"]
            assert (facts["width"], facts["height"]) == (320, 240) and facts[
                "state"
            ] == "tracking", facts
            assert (
                facts["latency_ms"] > 0 and facts["age_ms"] >= 0 and facts["vertices"] > 100
            ), facts
            assert len(rest) == pixels + 12 * facts["vertices"], len(rest)
            vertices = list(struct.iter_unpack("<fff", rest[pixels:]))
            # A template that grew reaches beyond the image, but nothing is observed there.
            observed = [(u, v) for u, v, status in vertices if status == 0]
            assert len(observed) > len(vertices) / 2, (len(observed), len(vertices))
            assert all(0 <= u < 320 and 0 <= v < 240 for u, v in observed)
            while facts_of(first_frame(port, token))["frame"] == facts["frame"]:
                time.sleep(0.01)

            status, page = get(port, f"/{token}/")
            assert status == 200 and page.startswith(b"<!doctype html>")
            assert (
                re.search(rb"(src|href|url)\s*[=(]|https?:", page) is None
            ), "the page loads from elsewhere"
            check_page(page)
            assert get(port, "/") == (403, b"open the address as the program printed it\n")
            assert get(port, f"/{'0' * 32}/frame")[0] == 403
            assert get(port, f"/{token}/frame", host=f"elsewhere.example:{port}")[0] == 403
            silent.close()
            assert running.poll() is None
        finally:
            running.kill()

    check_standstill(program, sequence, camera)
    ended = subprocess.run([*command, "1", "cpu"], stdout=subprocess.DEVNULL)
    assert ended.returncode == 0, ended


if __name__ == "__main__":
    main()

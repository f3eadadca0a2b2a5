#!/usr/bin/env python3
"""The sample live_view: what its page is given is what was tracked, and nobody without the token is
given anything.

test_live_view.py PROGRAM SEQUENCE CAMERA
"""
import http.client
import json
import pathlib
import re
import socket
import struct
import subprocess
import sys
import time


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


def main():
    program, sequence, camera = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3]
    command = [program, str(sequence / "left"), str(sequence / "right"), camera]
    usage = subprocess.run([*command, "0"], stderr=subprocess.PIPE, text=True)
    assert usage.returncode == 2 and usage.stderr.startswith("usage: live_view"), usage

    # More rounds than the test needs; it ends the program.
    with subprocess.Popen([*command, "1000", "cpu"], stdout=subprocess.PIPE, text=True) as running:
        try:
            port, token = re.fullmatch(
                r"open http://127\.0\.0\.1:(\d+)/([0-9a-f]{32})/\n", running.stdout.readline()
            ).groups()
            port = int(port)
            # A browser that asks and goes, and one that says nothing.
            with socket.create_connection(("127.0.0.1", port)) as gone:
                gone.sendall(
                    f"GET /{token}/frame HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode()
                )
            silent = socket.create_connection(("127.0.0.1", port))

            content = first_frame(port, token)
            line, rest = content.split(b"\n", 1)
            facts = json.loads(line)
            pixels = 3 * facts["width"] * facts["height"]
            assert (facts["width"], facts["height"]) == (320, 240) and facts[
                "state"
            ] == "tracking", facts
            assert facts["latency_ms"] > 0 and facts["vertices"] > 100, facts
            assert len(rest) == pixels + 12 * facts["vertices"], len(rest)
            vertices = list(struct.iter_unpack("<fff", rest[pixels:]))
            # A template that grew reaches beyond the image, but nothing is observed there.
            observed = [(u, v) for u, v, status in vertices if status == 0]
            assert len(observed) > len(vertices) / 2, (len(observed), len(vertices))
            assert all(0 <= u < 320 and 0 <= v < 240 for u, v in observed)
            while (
                json.loads(first_frame(port, token).split(b"\n", 1)[0])["frame"] == facts["frame"]
            ):
                time.sleep(0.01)

            status, page = get(port, f"/{token}/")
            assert status == 200 and page.startswith(b"<!doctype html>")
            assert (
                re.search(rb"(src|href|url)\s*[=(]|https?:", page) is None
            ), "the page loads from elsewhere"
            assert get(port, "/") == (403, b"open the address as the program printed it\n")
            assert get(port, f"/{'0' * 32}/frame")[0] == 403
            assert get(port, f"/{token}/frame", host=f"elsewhere.example:{port}")[0] == 403
            silent.close()
            assert running.poll() is None
        finally:
            running.kill()

    ended = subprocess.run([*command, "1", "cpu"], stdout=subprocess.DEVNULL)
    assert ended.returncode == 0, ended


if __name__ == "__main__":
    main()

"""`defrec track --view` behind nginx, with the configuration of the guide: who has password and
token sees the view, and nobody else sees anything.

usage: proxy_test.py DEFREC FOLDER GUIDE
"""
import base64
import http.client
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import time

from load_test import render, track

NAME, PORT, VIEW_PORT = "theatre-pc.example", "8443", "8090"
PASSWORD = "a password of the test"
# Debian's lies there, which is not in every user's path.
PATH = os.environ.get("PATH", "") + ":/usr/sbin"


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


class Proxy:
    """nginx with the block `nginx` of the guide, and paths and ports of this test."""

    def __init__(self, nginx, folder, guide, view_port):
        self.folder, self.port = folder, free_port()
        block = re.search(r"^```nginx\n(.*?)^```$", guide.read_text(), re.M | re.S)[1]
        self.make_certificate()
        self.make_password()
        for old, new in (
            ("/etc/ssl/certs/theatre-pc.pem", folder / "certificate.pem"),
            ("/etc/ssl/private/theatre-pc.key", folder / "key.pem"),
            ("/etc/nginx/defrec.htpasswd", folder / "htpasswd"),
            (PORT, self.port),
            (VIEW_PORT, view_port),
        ):
            assert old in block, f"the guide's configuration lacks {old}"
            block = block.replace(old, str(new))
        kinds = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
        temporary = "".join(f"{kind}_temp_path {folder}/{kind};\n" for kind in kinds)
        (folder / "nginx.conf").write_text(
            f"daemon off;\npid {folder}/pid;\nerror_log {folder}/error.log info;\n"
            f"events {{}}\nhttp {{\naccess_log {folder}/access.log;\n{temporary}{block}}}\n"
        )
        command = [nginx, "-p", folder, "-c", folder / "nginx.conf", "-e", folder / "error.log"]
        subprocess.run([*command, "-t", "-q"], check=True)
        self.process = subprocess.Popen(command)
        self.wait()

    def make_certificate(self):
        command = "openssl req -x509 -newkey rsa:2048 -nodes -days 1 -subj".split() + [
            f"/CN={NAME}"
        ]
        command += ["-addext", f"subjectAltName=DNS:{NAME}"]
        command += ["-keyout", self.folder / "key.pem", "-out", self.folder / "certificate.pem"]
        subprocess.run(command, check=True, stderr=subprocess.DEVNULL)

    def make_password(self):
        command = ["openssl", "passwd", "-6", "-stdin"]
        done = subprocess.run(
            command, input=PASSWORD, check=True, stdout=subprocess.PIPE, text=True
        )
        (self.folder / "htpasswd").write_text(f"viewer:{done.stdout.strip()}\n")
        (self.folder / "htpasswd").chmod(0o644)

    def wait(self):
        for _ in range(600):
            assert self.process.poll() is None, "nginx has ended"
            with socket.socket() as client:
                if client.connect_ex(("127.0.0.1", self.port)) == 0:
                    return
            time.sleep(0.1)
        raise AssertionError("nginx does not listen")

    def ask(self, method, path, body=None, *, host=None, password=PASSWORD, **headers):
        """Status and content. Headers: X_Token for X-Token."""
        context = ssl.create_default_context(cafile=self.folder / "certificate.pem")
        connection = http.client.HTTPSConnection(NAME, self.port, context=context, timeout=60)
        connection.sock = context.wrap_socket(
            socket.create_connection(("127.0.0.1", self.port)), server_hostname=NAME
        )
        sent = {name.replace("_", "-"): value for name, value in headers.items()}
        sent["Host"] = host or f"{NAME}:{self.port}"
        if password is not None:
            pair = base64.b64encode(f"viewer:{password}".encode()).decode()
            sent["Authorization"] = f"Basic {pair}"
        connection.request(method, path, body, sent)
        answer = connection.getresponse()
        return answer.status, answer.read()

    def end(self):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(timeout=60)


def check_view(proxy, token):
    """The page's requests, as a browser sends them."""
    status, page = proxy.ask("GET", f"/?token={token}")
    assert status == 200 and b"<title>" in page, status
    origin = f"https://{NAME}:{proxy.port}"
    status, packet = 0, b""
    while status in (0, 204):
        status, packet = proxy.ask("GET", "/frame?after=-1&overlay=1", X_Token=token, Origin=origin)
    assert status == 200, status
    head = json.loads(packet[4 : 4 + int.from_bytes(packet[:4], "little")])
    assert head["frame"] >= 0
    status, _ = proxy.ask("GET", "/surface", X_Token=token)
    assert status == 200, status
    status, _ = proxy.ask("POST", "/recording", '{"on":true}', X_Token=token, Origin=origin)
    assert status == 202, status


def check_strangers(proxy, token, view_port):
    page, frame = f"/?token={token}", "/frame?after=-1"

    def refused(expected, *request, **more):
        status, content = proxy.ask(*request, **more)
        assert status == expected, f"{request}, {more}: {status}, expected {expected}"
        assert b"<title>defrec" not in content and len(content) < 1000, f"{request}, {more}"

    refused(401, "GET", page, password=None)
    refused(401, "GET", page, password="")
    refused(401, "GET", frame, password="wrong", X_Token=token)
    refused(403, "GET", "/")
    refused(403, "GET", frame)
    refused(403, "GET", frame, X_Token="0" * len(token))
    for origin in (
        "https://evil.example",
        "null",
        f"https://{NAME}:{proxy.port}.evil.example",
        f"http://{NAME}:{proxy.port}",
        f"https://{NAME}",
        f"http://localhost:{view_port}",
        f"http://127.0.0.1:{view_port}",
    ):
        refused(403, "GET", frame, X_Token=token, Origin=origin)
        refused(403, "POST", "/points", '{"u":1,"v":1}', X_Token=token, Origin=origin)
    for host in ("evil.example", f"{NAME}.evil.example", "127.0.0.1", f"localhost:{view_port}"):
        refused(421, "GET", page, host=host)
        refused(421, "GET", page, host=host, password=None)

    plain = http.client.HTTPConnection("127.0.0.1", proxy.port, timeout=60)
    plain.request("GET", page, headers={"Host": f"{NAME}:{proxy.port}"})
    assert plain.getresponse().status == 400, "answered without TLS"
    # Not by the proxy's name without the proxy, either.
    direct = http.client.HTTPConnection("127.0.0.1", view_port, timeout=60)
    direct.request("GET", page, headers={"Host": f"{NAME}:{proxy.port}"})
    assert direct.getresponse().status == 403


def check_nothing_kept(folder, token):
    secrets = [token.encode(), PASSWORD.encode(), base64.b64encode(f"viewer:{PASSWORD}".encode())]
    for path in folder.rglob("*"):
        if path.is_file():
            content = path.read_bytes()
            assert not any(secret in content for secret in secrets), f"{path} has a secret"


def main():
    program, folder, guide = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    nginx, openssl = shutil.which("nginx", path=PATH), shutil.which("openssl")
    if not nginx or not openssl:
        print("skipped: nginx or openssl is not installed")
        sys.exit(77)
    subprocess.run(["rm", "-rf", folder], check=True)
    (folder / "nginx").mkdir(parents=True)
    render(program, folder)
    run = track(program, folder, "--view")
    proxy = None
    try:
        address = run.stderr.readline().split()[-1]
        view_port, token = int(address.split(":")[2].split("/")[0]), address.split("token=")[1]
        proxy = Proxy(nginx, folder / "nginx", guide, view_port)
        check_view(proxy, token)
        check_strangers(proxy, token, view_port)
        run.send_signal(signal.SIGINT)
        assert run.wait(timeout=60) == 130
        assert proxy.ask("GET", "/frame?after=-1", X_Token=token)[0] == 502
        check_nothing_kept(folder / "nginx", token)
    finally:
        run.kill()
        if proxy:
            proxy.end()
    print("behind the proxy: with password and token the view, else nothing")


if __name__ == "__main__":
    main()

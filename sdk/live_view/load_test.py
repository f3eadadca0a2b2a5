"""The server of `defrec track --view` under load: two browsers watch, while connections without the
token come by the hundreds, send slowly, send headers of every hostile kind, and ask for ranges.

usage: load_test.py DEFREC FOLDER [SECONDS]

Takes that time, and longer where a browser needs it for its frames. Prints what it measured. Fails
where the run ends by itself, since a browser is shut out, where more connections are open than may
be, memory or threads grow, or the run does not end with its outputs finished.
"""
import concurrent.futures
import json
import os
import pathlib
import random
import signal
import socket
import subprocess
import sys
import threading
import time

FRAMES = 20000
BROWSERS = 2
FRAMES_SEEN = 50
# And one that is being taken or closed.
MAX_CONNECTIONS = 32 + 1


def render(program, folder):
    """A sequence that lasts longer than the test."""
    subprocess.run(
        [program, "render", "heartbeat", "--quiet", "--out", folder / "sequence"]
        + ["--size", "320x240", "--frames", "10"],
        check=True,
    )
    for view in ("left", "right"):
        images = sorted((folder / "sequence" / view).iterdir())
        (folder / view).mkdir()
        for frame in range(FRAMES):
            os.link(images[frame % len(images)], folder / view / f"{frame:06}.png")


def track(program, folder, *more):
    command = [program, "track", "--backend", "cpu", "--no-overlay", "--realtime", "--quiet"]
    command += ["--left", folder / "left", "--right", folder / "right", "--out", folder / "out"]
    command += ["--calibration", folder / "sequence" / "calibration.yaml", *more]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True)


class Process:
    """What /proc says of it."""

    def __init__(self, number):
        self.folder = pathlib.Path(f"/proc/{number}")

    def memory_mb(self):
        return int((self.folder / "statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6

    def threads(self):
        return len(list((self.folder / "task").iterdir()))

    def sockets(self):
        """Inodes of the sockets that it holds."""
        held = set()
        for entry in (self.folder / "fd").iterdir():
            try:
                target = os.readlink(entry)
            except FileNotFoundError:
                continue
            if target.startswith("socket:["):
                held.add(target[len("socket:[") : -1])
        return held

    def connections(self, port):
        """Sockets of the server's side that are open at once: held before the kernel's table is
        read and after, since the folder of descriptors is no snapshot while sockets come and go."""
        before = self.sockets()
        table = [line.split() for line in (self.folder / "net/tcp").read_text().splitlines()[1:]]
        held = before & self.sockets()
        return sum(
            row[1].endswith(f":{port:04X}") and row[3] != "0A" and row[9] in held for row in table
        )


class Load:
    def __init__(self, port, token):
        self.port = port
        self.token = token
        self.ended = threading.Event()
        self.lock = threading.Lock()
        self.counts = {}
        self.frames = [0] * BROWSERS  # that each got
        self.longest_gap = 0.0

    def count(self, name, number=1):
        with self.lock:
            self.counts[name] = self.counts.get(name, 0) + number

    def connect(self):
        return socket.create_connection(("127.0.0.1", self.port), timeout=10)

    def connect_until_ended(self):
        """None: the test has ended."""
        while not self.ended.is_set():
            try:
                return self.connect()
            except OSError:
                self.ended.wait(0.05)
        return None

    def request(self, path, more=""):
        return (
            f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\n"
            f"X-Token: {self.token}\r\n{more}\r\n"
        ).encode()

    def ask(self, stream, path):
        """Status and body."""

        def next_line():
            line = stream.readline()
            if not line:
                raise ConnectionError("closed within a head")
            return line

        stream.write(self.request(path))
        stream.flush()
        status, length = int(next_line().split()[1]), 0
        while (line := next_line()) != b"\r\n":
            if line.lower().startswith(b"content-length:"):
                length = int(line.split(b":")[1])
        body = stream.read(length)
        if len(body) < length:
            raise ConnectionError("closed within a body")
        return status, body

    def browser(self, number):
        """Fetches frame after frame on one connection, as the page does, until the run ends."""
        after, last, stream = -1, time.monotonic(), None
        while not self.ended.is_set():
            try:
                stream = stream or self.connect().makefile("rwb")
                status, body = self.ask(stream, f"/frame?after={after}&overlay=1")
            except OSError:
                stream = status = None
                self.count("reconnections of browsers")
                self.ended.wait(0.05)
            with self.lock:
                self.longest_gap = max(self.longest_gap, time.monotonic() - last)
            if status == 410:
                return
            if status == 200:
                last = time.monotonic()
                after = json.loads(body[4 : 4 + int.from_bytes(body[:4], "little")])["frame"]
                self.frames[number] += 1

    def flood(self):
        """1,000 connections that say nothing, again and again."""
        while not self.ended.is_set():
            held = []
            for _ in range(250):
                try:
                    held.append(self.connect())
                except OSError:
                    break
            self.count("connections without a word", len(held))
            self.ended.wait(0.2)
            for connection in held:
                connection.close()

    def drip(self):
        """40 that send a header a second."""
        held = {}
        while not self.ended.is_set():
            while len(held) < 40 and (connection := self.connect_until_ended()) is not None:
                held[connection] = b"GET / HTTP/1.1\r\n"
                self.count("connections that drip")
            for connection, line in list(held.items()):
                try:
                    connection.sendall(line)
                    held[connection] = b"a: b\r\n"
                except OSError:
                    del held[connection]
                    connection.close()
            self.ended.wait(1)

    def hostile(self, seed):
        source = random.Random(seed)
        own = f"127.0.0.1:{self.port}"
        requests = [
            b"\x00" * 9000,
            b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 2000,
            f"GET / HTTP/1.1\r\nHost: {own}\r\nHost: evil.example\r\n\r\n".encode(),
            f"GET /?token={'0' * 32} HTTP/1.1\r\nHost: {own}\r\n\r\n".encode(),
            f"POST /points HTTP/1.1\r\nHost: {own}\r\nContent-Length: 999999\r\n\r\n".encode(),
            f"POST / HTTP/1.1\r\nHost: {own}\r\nTransfer-Encoding: chunked\r\n\r\n".encode(),
            self.request("/surface", "Range: bytes=" + ",".join(["0-"] * 1500) + "\r\n"),
        ]
        while (connection := self.connect_until_ended()) is not None:
            with connection:
                try:
                    if source.random() < 0.5:
                        connection.sendall(source.choice(requests))
                    else:
                        connection.sendall(source.randbytes(source.randrange(1, 4000)))
                    connection.settimeout(0.05)
                    connection.recv(65536)
                except OSError:
                    pass
            self.count("hostile requests")

    def start(self, pool):
        """Runs all until ended is set; a result raises what went wrong."""
        bodies = [(self.browser, number) for number in range(BROWSERS)]
        bodies += [(self.flood,)] * 4 + [(self.drip,)]
        bodies += [(self.hostile, seed) for seed in range(2)]
        return [pool.submit(*body) for body in bodies]


def measure(program, folder, seconds):
    with track(program, folder, "--view") as run:
        try:
            address = run.stderr.readline().split()[-1]
            port, token = int(address.split(":")[2].split("/")[0]), address.split("token=")[1]
            look(run, port, Load(port, token), folder, seconds)
        finally:
            run.kill()


def wait_for_frames(run, load):
    """Until each browser has got some more."""
    begin = list(load.frames)
    while any(now < then + FRAMES_SEEN for now, then in zip(load.frames, begin)):
        assert run.poll() is None, f"frames of browsers: {begin}, to the end {load.frames}"
        time.sleep(0.1)


def look(run, port, load, folder, seconds):
    process, most = Process(run.pid), 0
    with concurrent.futures.ThreadPoolExecutor(max_workers=16) as pool:
        try:
            results = load.start(pool)
            time.sleep(seconds / 4)
            wait_for_frames(run, load)
            begin = (process.memory_mb(), process.threads())
            end = time.monotonic() + 3 * seconds / 4
            while time.monotonic() < end:
                most = max(most, process.connections(port))
                time.sleep(0.1)
            wait_for_frames(run, load)
            finish = (process.memory_mb(), process.threads())
            # The outputs are finished while all of them are still connected.
            run.send_signal(signal.SIGINT)
            code = run.wait()
        finally:
            load.ended.set()
        for result in results:
            result.result()
    summary = json.loads((folder / "out" / "summary.json").read_text())
    for name, number in sorted(load.counts.items()):
        print(f"{name}: {number}")
    print(f"frames that browsers got: {load.frames}")
    print(f"longest time without a frame: {load.longest_gap:.2f} s")
    print(f"connections open at once: {most}")
    print(f"memory: {begin[0]:.1f} MB after a quarter of the time, {finish[0]:.1f} MB at the end")
    print(f"threads: {begin[1]} and {finish[1]}")
    stages = summary["stages"]["frame"]
    print(f"frames tracked: {summary['frames']}, median {stages['median_ms']:.2f} ms")
    assert code == 130, code
    assert most <= MAX_CONNECTIONS, most
    assert finish[0] - begin[0] < 32, (begin, finish)
    assert finish[1] <= begin[1], (begin, finish)
    assert not list((folder / "out").glob("*.partial*"))


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 20
    subprocess.run(["rm", "-rf", folder], check=True)
    folder.mkdir(parents=True)
    render(program, folder)
    measure(program, folder, seconds)


if __name__ == "__main__":
    main()

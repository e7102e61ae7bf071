#!/usr/bin/env python3
"""amhex over a network that breaks: uploads, watching and downloads go on where they were.

    tests/e2e/network_cuts.py AMHEX AMHEXD FOLDER

Between client and server stands a relay that counts the bytes and cuts all its connections when so many have passed, or when told to.
"""
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import threading
import time

DEADLINE = 600
CHUNK = 1 << 20  # what the server asks for per message (Limits.preferred_chunk_bytes)
failures = 0


def check(name, condition, detail=""):
    global failures
    print("passed:" if condition else "FAILED:", name, "" if condition else detail)
    failures += not condition


class Relay:
    """Passes bytes between a port of this machine and a unix socket."""

    def __init__(self, target):
        self.target, self.lock, self.links = target, threading.Lock(), []
        self.passed, self.cuts_at, self.cuts = {"up": 0, "down": 0}, {"up": [], "down": []}, 0
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self.listener.getsockname()[1]}"
        threading.Thread(target=self.accept, daemon=True).start()

    def plan(self, way, places):
        """From now on counts anew, and cuts when so many bytes have passed that way."""
        with self.lock:
            self.passed = {"up": 0, "down": 0}
            self.cuts_at = {"up": [], "down": [], way: list(places)}
            self.cuts = 0

    def accept(self):
        while True:
            try:
                near = self.listener.accept()[0]
            except OSError:
                return
            far = socket.socket(socket.AF_UNIX)
            try:
                far.connect(str(self.target))
            except OSError:
                near.close()
                continue
            with self.lock:
                self.links.append((near, far))
            for way, source, sink in (("up", near, far), ("down", far, near)):
                threading.Thread(target=self.pump, args=(way, source, sink), daemon=True).start()

    def pump(self, way, source, sink):
        try:
            while data := source.recv(65536):
                sink.sendall(data)
                with self.lock:
                    self.passed[way] += len(data)
                    places = self.cuts_at[way]
                    due = bool(places) and self.passed[way] >= places[0]
                    if due:
                        places.pop(0)
                if due:
                    self.cut()
        except OSError:
            pass
        for end in (source, sink):
            try:
                end.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass

    def cut(self):
        with self.lock:
            links, self.links, self.cuts = self.links, [], self.cuts + 1
        for link in links:
            for end in link:
                try:
                    end.shutdown(socket.SHUT_RDWR)
                except OSError:
                    pass


class Client:
    def __init__(self, amhex, folder, address):
        self.amhex, self.folder = amhex, folder
        self.environment = {**os.environ, "AMHEX_SERVER": address, "TMPDIR": "/tmp"}

    def start(self, *words):
        return subprocess.Popen([self.amhex, *map(str, words)], cwd=self.folder, env=self.environment, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True)

    def run(self, *words):
        """Exit status, stdout, stderr."""
        process = self.start(*words)
        out, err = process.communicate(timeout=DEADLINE)
        return process.returncode, out, err


def test_upload(relay, client):
    client.run("demo", "--points", 600000, "-o", "large.drc")
    size = (client.folder / "large.drc").stat().st_size
    assert size > 3 * CHUNK, "the scan must be larger than a few messages"
    relay.plan("up", [1.5 * CHUNK, 3.2 * CHUNK])
    status, out, err = client.run("submit", "large.drc", "--cells", 1000)
    check("a submission outlives two cuts of its upload", status == 0 and out.startswith("jobs/"), err)
    check("both cuts took place", relay.cuts == 2, relay.cuts)
    # Beside the input at most the message under way at each cut travels twice, and what protocols add.
    check("no more travels twice than the messages cut off", relay.passed["up"] < size + 2.5 * CHUNK, (relay.passed["up"], size))
    check("the job can be cancelled", client.run("cancel", out.strip())[0] == 0)


def test_watch(relay, client):
    client.run("demo", "--points", 20000, "-o", "scan.drc")
    relay.plan("up", [])
    # It would take minutes, so that it is still running when the connection is back, however busy this machine is.
    process = client.start("mesh", "scan.drc", "--cells", 300000, "-o", "scan.vtu")
    said, job, cuts = [], None, 0
    for line in process.stderr:
        said.append(line)
        job = job or (line.strip() if line.startswith("jobs/") else None)
        if "decode input" not in line and "connected again" not in line:
            continue
        if cuts == 2:
            client.run("cancel", job)
        else:
            relay.cut()
            cuts += 1
    process.communicate(timeout=DEADLINE)
    text = "".join(said)
    check("the client says that it lost the connection, and that it is back",
          text.count("trying again") == 2 and text.count("connected again") == 2, text)
    check("what it has seen is not told again", text.count("decode input") == 1, text)
    check("it sees the end of the job, which somebody else cancelled", process.returncode == 130, (process.returncode, text))


def test_download(relay, client):
    client.run("demo", "--shape", "cube", "--surface", "--resolution", 12, "-o", "cube.ply")
    relay.plan("up", [])
    # Cubes on a grid: many cells soon.
    status, job, err = client.run("submit", "cube.ply", "--cells", 70000, "--initialization", "grid", "--iterations", 0)
    check("a large job is submitted", status == 0, err)
    check("and ends", client.run("watch", job.strip())[0] == 0)
    relay.plan("down", [1.5 * CHUNK, 3.2 * CHUNK])
    status, out, err = client.run("fetch", job.strip(), "-o", "cube.vtu")
    check("a mesh arrives over a connection that breaks twice", status == 0, err)
    check("both cuts took place", relay.cuts == 2, relay.cuts)
    size = relay.passed["down"]
    relay.plan("down", [])
    status, out, err = client.run("fetch", job.strip(), "-o", "again.vtu")
    check("no more travels twice than the messages cut off", size < relay.passed["down"] + 2.5 * CHUNK, (size, relay.passed["down"]))
    check("it is the mesh that comes without cuts",
          (client.folder / "cube.vtu").read_bytes() == (client.folder / "again.vtu").read_bytes())


def main():
    amhex, amhexd, folder = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    path = pathlib.Path(f"/tmp/amhex-cuts-{os.getpid()}.socket")  # short, as sockets' paths are limited
    server = subprocess.Popen([amhexd, "--listen", f"unix:{path}", "--data-dir", folder / "data", "--metrics-listen", ""],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        while not path.exists() and server.poll() is None:
            time.sleep(0.05)
        relay = Relay(path)
        client = Client(amhex, folder, relay.address)
        for test in (test_upload, test_watch, test_download):
            test(relay, client)
        relay.listener.close()
    finally:
        server.terminate()
        server.wait()
        path.unlink(missing_ok=True)
        shutil.rmtree(folder / "data", ignore_errors=True)
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Posts inputs and damaged versions of them to a real server with the real client; each must end in a
mesh or in a clear error, and the server must be as good as new afterwards.

Of each input eight versions are posted: whole; its first third; its first two thirds; all but its last
byte; with 16 bytes changed; with bits turned in its first 64 bytes; with zeros in its middle third;
with its second half twice. Surfaces and clouds are meshed with 300 cells, volume meshes reassembled.

    tests/service/post_damaged.py AMHEX AMHEXD               the models in the folder $AMHEX_MODELS, else shapes made here
    tests/service/post_damaged.py AMHEX AMHEXD FOLDER...     the models in folders, or single models

Exit status: 0 all as it must be, 1 not, 77 skipped because a folder is not there.
"""
import concurrent.futures
import math
import os
import pathlib
import random
import re
import struct
import subprocess
import sys
import tempfile
import time

SUFFIXES = {".drc", ".ply", ".obj", ".off", ".stl", ".vtk", ".msh", ".vtu", ".mesh"}
VOLUME_SUFFIXES = {".vtk", ".msh", ".vtu", ".mesh"}
CELLS = "300"
# What `amhex` may end with: a mesh; bad input; no valid mesh; time, memory or disk exhausted.
GOOD, INPUT, NO_MESH, LIMIT = 0, 3, 5, 6
PERMITTED = {GOOD, INPUT, NO_MESH, LIMIT}
SECONDS_PER_RUN = 300


def torus(around=24, across=12):
    """Vertices and quads of a torus."""
    vertices, quads = [], []
    for i in range(around):
        for j in range(across):
            u, v = 2 * math.pi * i / around, 2 * math.pi * j / across
            r = 1 + 0.4 * math.cos(v)
            vertices.append((r * math.cos(u), r * math.sin(u), 0.4 * math.sin(v)))
            k, l = (i + 1) % around, (j + 1) % across
            quads.append((i * across + j, k * across + j, k * across + l, i * across + l))
    return vertices, quads


def shapes():
    vertices, quads = torus()
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    obj = "".join("v %.9g %.9g %.9g\n" % v for v in vertices)
    obj += "".join("f %d %d %d\n" % (a + 1, b + 1, c + 1) for a, b, c in triangles)
    off = "OFF\n%d %d 0\n" % (len(vertices), len(triangles))
    off += "".join("%.9g %.9g %.9g\n" % v for v in vertices)
    off += "".join("3 %d %d %d\n" % t for t in triangles)
    stl = b"\0" * 80 + struct.pack("<I", len(triangles))
    for triangle in triangles:
        stl += struct.pack("<3f", 0, 0, 0)
        stl += b"".join(struct.pack("<3f", *vertices[corner]) for corner in triangle) + b"\0\0"
    rng = random.Random(7)
    ball = []
    for _ in range(1500):
        v = [rng.gauss(0, 1) for _ in range(3)]
        n = math.sqrt(sum(c * c for c in v))
        ball.append(tuple(c / n for c in v))
    ply = ("ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(ball)
           + "".join("property float %s\n" % p for p in ("x", "y", "z", "nx", "ny", "nz"))
           + "end_header\n").encode()
    ply += b"".join(struct.pack("<6f", *v, *v) for v in ball)
    return {"torus.obj": obj.encode(), "torus.off": off.encode(), "torus.stl": stl, "ball.ply": ply}


def damaged(name, data):
    """The bytes themselves and damaged versions, the same in every run."""
    rng = random.Random(name)
    size = len(data)
    yield "whole", data
    yield "cut at a third", data[: size // 3]
    yield "cut at two thirds", data[: 2 * size // 3]
    yield "a byte short", data[:-1]
    noisy = bytearray(data)
    for _ in range(16):
        noisy[rng.randrange(size)] = rng.randrange(256)
    yield "16 other bytes", bytes(noisy)
    begin = bytearray(data)
    for i in range(min(64, size)):
        if rng.random() < 0.2:
            begin[i] ^= 1 << rng.randrange(8)
    yield "a damaged beginning", bytes(begin)
    yield "zeros in the middle", data[: size // 3] + bytes(size // 3) + data[2 * (size // 3):]
    yield "its end twice", data + data[size // 2:]


class Server:
    def __init__(self, program, folder):
        self.address = "unix:%s/amhex.sock" % folder
        self.ports = pathlib.Path(folder, "ports")
        self.process = subprocess.Popen([
            program, "--listen", self.address, "--metrics-listen", "127.0.0.1:0", "--ephemeral", "--workers", "2",
            "--port-file", str(self.ports), "--log-level", "error"])
        deadline = time.monotonic() + 60
        while not self.ports.exists():
            if self.process.poll() is not None or time.monotonic() > deadline:
                sys.exit("post_damaged.py: the server did not start")
            time.sleep(0.05)

    def end(self):
        self.process.terminate()
        return self.process.wait(60)


def post(amhex, server, folder, case):
    """One line about what is wrong, or None; and the exit status."""
    name, what, data = case
    work = pathlib.Path(tempfile.mkdtemp(dir=folder))
    source = work / name
    source.write_bytes(data)
    output = work / "out.vtu"
    try:
        size = [] if source.suffix in VOLUME_SUFFIXES else ["--cells", CELLS]
        run = subprocess.run([amhex, "mesh", str(source), "-o", str(output), "--server", server.address, *size,
                              "--progress", "none"], capture_output=True, text=True, errors="replace",
                             timeout=SECONDS_PER_RUN)
    except subprocess.TimeoutExpired:
        return "%s, %s: no end within %d s" % (name, what, SECONDS_PER_RUN), None
    status, message = run.returncode, run.stderr.strip()
    if status not in PERMITTED:
        return "%s, %s: exit status %d: %s" % (name, what, status, message), status
    if status == GOOD and not (output.exists() and output.stat().st_size > 0):
        return "%s, %s: exit status 0 and no mesh" % (name, what), status
    if status != GOOD and not re.search(r"error: .{10,}", message):
        return "%s, %s: exit status %d and no message: %s" % (name, what, status, message), status
    if status == GOOD or what != "whole":
        return None, status
    return "%s, %s: %s" % (name, what, message), status


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    amhex, amhexd = sys.argv[1:3]
    places = [pathlib.Path(place) for place in sys.argv[3:]]
    if not places and os.environ.get("AMHEX_MODELS"):
        places = [pathlib.Path(os.environ["AMHEX_MODELS"])]
    may_refuse_whole = bool(places)
    if may_refuse_whole:
        missing = [str(place) for place in places if not place.exists()]
        if missing:
            print("skipped: not there: " + ", ".join(missing))
            return 77
        paths = [p for place in places for p in (sorted(place.iterdir()) if place.is_dir() else [place])]
        inputs = {path.name: path.read_bytes() for path in paths if path.suffix in SUFFIXES}
    else:
        inputs = shapes()
    cases = [(name, what, data) for name, whole in inputs.items() for what, data in damaged(name, whole)]
    problems, counts = [], {}
    with tempfile.TemporaryDirectory() as folder:
        server = Server(amhexd, folder)
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            for case, (problem, status) in zip(cases, pool.map(lambda c: post(amhex, server, folder, c), cases)):
                counts[status] = counts.get(status, 0) + 1
                if may_refuse_whole and case[1] == "whole" and status != GOOD:
                    print("whole and refused: %s" % problem)
                # A folder may hold what is no solid; then the error must be clear, which was looked at.
                if problem and not (may_refuse_whole and case[1] == "whole" and status in PERMITTED):
                    problems.append(problem)
        info = subprocess.run([amhex, "info", "--server", server.address], capture_output=True, text=True)
        if info.returncode != 0:
            problems.append("the server does not answer any more: " + info.stderr)
        if server.end() != 0:
            problems.append("the server did not end with 0")
    print("%d inputs, %d versions; exit statuses: %s" % (
        len(inputs), len(cases), ", ".join("%s: %d" % (s, n) for s, n in sorted(counts.items(), key=str))))
    print("\n".join(problems))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())

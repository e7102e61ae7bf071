#!/usr/bin/env python3
"""What real meshing jobs gain from more workers: the same jobs, of one thread each, on servers with one worker, two, and so on.

    tests/benchmarks/worker_scaling.py AMHEX AMHEXD [WORKERS]...     by default 1 2

Prints for each number of workers the seconds by the clock, the processor seconds that the workers took, and how much of a core each of them
got: where the machine has other work, only rows with equal shares can be compared by the clock.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

JOBS = 8
DEADLINE = 300
# The curved demo scan, small enough for a minute in all; each job has another seed, so that none is answered from another's result.
SCAN = ["--shape", "sphere", "--surface", "--resolution", "48"]
PARAMETERS = ["--cells", "3000", "--trials", "1", "--threads", "1"]


def children_seconds(process):
    """User and system time of the children of a process."""
    seconds = 0.0
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue  # ended meanwhile
        if int(fields[1]) == process:
            seconds += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return seconds


def measure(amhex, amhexd, folder, workers):
    folder.mkdir()
    ports = folder / "ports"
    server = subprocess.Popen([amhexd, "--data-dir", folder / "data", "--listen", f"unix:{folder}/socket", "--metrics-listen", "",
                               "--port-file", ports, "--workers", str(workers)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        end = time.monotonic() + DEADLINE
        while not ports.exists() and server.poll() is None and time.monotonic() < end:
            time.sleep(0.05)
        before = children_seconds(server.pid)
        subprocess.run([amhex, "bench", folder.parent / "scan.ply", *PARAMETERS, "--jobs", str(JOBS), "--at-once", str(2 * workers),
                        "--json", folder / "bench.json", "--server", f"unix:{folder}/socket"],
                       check=True, stdout=subprocess.DEVNULL, timeout=DEADLINE)
        taken = children_seconds(server.pid) - before
    finally:
        server.terminate()
        server.wait()
    return json.loads((folder / "bench.json").read_text())["seconds"], taken


def main():
    amhex, amhexd = map(os.path.realpath, sys.argv[1:3])
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        subprocess.run([amhex, "demo", *SCAN, "-o", folder / "scan.ply"], check=True, stdout=subprocess.DEVNULL)
        for run, workers in enumerate(map(int, sys.argv[3:] or ("1", "2"))):
            seconds, taken = measure(amhex, amhexd, folder / str(run), workers)
            print(f"{workers} workers: {JOBS} jobs in {seconds:.2f} s, {taken:.2f} s of processor time, {taken / seconds / workers:.2f} of a core "
                  f"per worker; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores", flush=True)


if __name__ == "__main__":
    main()

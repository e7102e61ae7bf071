#!/usr/bin/env python3
"""Runs every command of the user guide, and every example of `amhex COMMAND --help`, as they stand.

    tests/docs/run_commands.py AMHEX AMHEXD FOLDER

In FOLDER, with a server where the text names one.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
# How the texts call a server; here it listens on a socket.
SERVER_NAMES = r"\b(localhost|mesher):50051\b"
failures = 0


def run(script, folder, environment, name):
    """As a shell would: stops at the first command that fails."""
    global failures
    answer = subprocess.run(["bash", "-euo", "pipefail", "-c", script], cwd=folder, env=environment,
                            capture_output=True, text=True, timeout=500)
    print("passed:" if answer.returncode == 0 else "FAILED:", name)
    if answer.returncode != 0:
        failures += 1
        print(script, answer.stdout[-1500:], answer.stderr[-1500:], sep="\n")


def help_examples(amhex):
    """(command, example) for every line below Examples: in every help text."""
    commands = re.findall(r"^  ([a-z]+)[ ,]", subprocess.run([amhex, "--help"], capture_output=True, text=True, check=True)
                          .stdout.partition("Subcommands:")[2], re.M)
    for command in commands:
        text = subprocess.run([amhex, command, "--help"], capture_output=True, text=True, check=True).stdout
        for example in re.findall(r"^ +(.*\bamhex .*)$", text.partition("Example")[2], re.M):
            yield command, example.strip()


def main():
    amhex, amhexd, folder = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "bin").mkdir(parents=True)
    (folder / "bin/amhex").symlink_to(amhex)
    # Short, as sockets' paths are limited.
    socket = pathlib.Path(f"/tmp/amhex-docs-{os.getpid()}.socket")
    environment = {**os.environ, "PATH": f"{folder}/bin:{os.environ['PATH']}", "AMHEXD": str(amhexd), "HOME": str(folder)}
    environment.pop("AMHEX_SERVER", None)
    server = subprocess.Popen([amhexd, "--listen", f"unix:{socket}", "--data-dir", folder / "data", "--metrics-listen", ""],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        while not socket.exists() and server.poll() is None:
            time.sleep(0.05)
        guide = (ROOT / "docs/guide.md").read_text()
        blocks = re.findall(r"```sh\n(.*?)```", guide, re.S)
        for block in blocks:
            script = re.sub(SERVER_NAMES, f"unix:{socket}", block)
            run(script, folder, environment, f"guide.md: {block.splitlines()[0]}")
        # The files that the examples name.
        subprocess.run(f"{amhex} demo --shape cube --surface --resolution 12 -o part.stl && {amhex} demo --shape cube --surface "
                       f"--resolution 12 -o part.obj && {amhex} mesh part.stl --cells 200 -q -o part.vtu && mkdir -p "
                       f".config/fish/completions && {amhex} convert part.vtu -o part.mesh",
                       shell=True, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)
        examples = list(help_examples(amhex))
        for command, example in examples:
            # As fine as the text says would take minutes.
            script = re.sub(r"--cells \d+", "--cells 500", re.sub(SERVER_NAMES, f"unix:{socket}", example))
            script = re.sub(r"--edge-length \S+", "--edge-length 0.3", re.sub(r"--jobs \d+", "--jobs 2", script))
            run(script, folder, environment, f"{command} --help: {example}")
        print(len(blocks), "blocks of the guide and", len(examples), "examples")
        if len(blocks) < 6 or len(examples) < 6:
            sys.exit("that is less than there are")
    finally:
        server.terminate()
        server.wait()
        socket.unlink(missing_ok=True)
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Runs every command that README.md, CONTRIBUTING.md and docs/ tell a reader to type, and every example of a help text.

    tests/docs/run_commands.py AMHEX AMHEXD FOLDER

In FOLDER, with a server where the text names one. What cannot run here is in NOT_RUN with the reason, and is checked as far as that
goes; a command that is neither run nor listed fails. Commands in the middle of a sentence must name subcommands, flags
and files that exist.
"""
import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
# How the texts call a server; here it listens on a socket.
SERVER_NAMES = r"\b(localhost|mesher|127\.0\.0\.1):50051\b"
# Its blocks are run whole, one after the other, as a reader would.
TUTORIAL = "docs/guide.md"
DEADLINE = 900
# (beginning of the command, why it is not run here). The scripts and presets that it names must exist, and scripts must parse.
NOT_RUN = [
    ("deploy/quickstart.sh", "installs packages and builds everything anew"),
    ("tests/run.sh", "runs this test among all others"),
    ("cmake --preset", "configures and builds everything anew"),
    ("git ls-files '*.h' '*.cpp' '*.cu' | xargs clang-format-14 -i", "changes the sources"),
    ("tests/gpu/pack.sh", "packs what another build has made, for a machine with a device"),
    ("tar xf amhex_gpu_check.tar.gz && amhex_gpu_check/run", "needs the machine with the device"),
]
failures = 0


def report(name, passed, *details):
    global failures
    print("passed:" if passed else "FAILED:", name)
    if not passed:
        failures += 1
        print(*details, sep="\n")


def documents():
    paths = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("**/*.md"))]
    return {str(path.relative_to(ROOT)): path.read_text() for path in paths}


def commands_of(block):
    """One per line of the block, comments and continued lines taken care of."""
    lines = re.sub(r"\\\n\s*", " ", block).splitlines()
    return [line for line in (re.sub(r"\s+#.*$", "", line).strip() for line in lines) if line]


class Reader:
    """Does what the texts say, in a folder of its own."""

    def __init__(self, amhex, amhexd, folder):
        self.amhex, self.amhexd, self.folder = amhex, amhexd, folder
        shutil.rmtree(folder, ignore_errors=True)
        (folder / "bin").mkdir(parents=True)
        for program in (amhex, amhexd):
            (folder / "bin" / program.name).symlink_to(program)
        self.environment = {**os.environ, "PATH": f"{folder}/bin:{os.environ['PATH']}", "AMHEXD": str(amhexd), "HOME": str(folder)}
        self.environment.pop("AMHEX_SERVER", None)
        self.job = "jobs/none"
        # Short, as sockets' paths are limited.
        self.socket = pathlib.Path(f"/tmp/amhex-docs-{os.getpid()}.socket")
        self.server = subprocess.Popen([amhexd, "--listen", f"unix:{self.socket}", "--data-dir", folder / "data", "--metrics-listen", ""],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while not self.socket.exists() and self.server.poll() is None:
            time.sleep(0.05)

    def close(self):
        self.server.terminate()
        self.server.wait()
        self.socket.unlink(missing_ok=True)

    def run(self, script, name):
        """As a shell would: stops at the first command that fails."""
        answer = subprocess.run(["bash", "-euo", "pipefail", "-c", script], cwd=self.folder, env=self.environment,
                                capture_output=True, text=True, timeout=DEADLINE)
        report(name, answer.returncode == 0, script, answer.stdout[-1500:], answer.stderr[-1500:])
        return answer

    def here(self, script):
        """With the server of this test, and no larger than it takes to see that it works."""
        script = script.replace("JOB", self.job)
        script = re.sub(r"--cells \d+", "--cells 500", re.sub(SERVER_NAMES, f"unix:{self.socket}", script))
        return re.sub(r"--edge-length \S+", "--edge-length 0.3", re.sub(r"--jobs \d+", "--jobs 2", script))

    def make_files(self):
        """The files that examples name."""
        demo = "amhex demo --shape cube --surface --resolution 12 -o"
        self.run(f"{demo} part.stl && {demo} part.obj && {demo} SCAN.drc && amhex mesh part.stl --cells 200 -q -o part.vtu && "
                 "mkdir -p .config/fish/completions && amhex convert part.vtu -o part.mesh && "
                 "openssl req -x509 -newkey rsa:2048 -nodes -subj /CN=localhost -days 1 -keyout server.key -out server.pem && "
                 "echo \"ada submit,read $(amhexd --new-token | sed -n 's/^SHA-256: *//p')\" >tokens", "the files of the examples")
        self.job = self.run(f"amhex submit part.stl --cells 200 --server unix:{self.socket}", "the job of the examples").stdout.strip()

    def start_server(self, command, name):
        """`amhexd` as the text has it, but for where it listens and keeps its data, up to the moment when it serves."""
        self.run(command + " --check-config", f"{name} --check-config")
        if "postgres://" in command:
            print("not started: the text's database is somewhere else; tests/service has servers that share one")
            return
        port_file = self.folder / "ports"
        port_file.unlink(missing_ok=True)
        command = re.sub(r"--data-dir \S+", f"--data-dir {self.folder}/documented_data", command)
        command = re.sub(r"--listen unix:\S+", f"--listen unix:{self.socket}.2", re.sub(r"--listen 0\.0\.0\.0:\d+", "--listen 127.0.0.1:0", command))
        if "--listen" not in command:
            command += " --listen 127.0.0.1:0"
        server = subprocess.Popen([*shlex.split(command), "--metrics-listen", "", "--port-file", port_file], cwd=self.folder,
                                  env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        end = time.monotonic() + DEADLINE
        while not port_file.exists() and server.poll() is None and time.monotonic() < end:
            time.sleep(0.05)
        serves = port_file.exists()
        if server.poll() is None:
            server.send_signal(signal.SIGTERM)
        log = server.communicate(timeout=DEADLINE)[0]
        report(f"{name}: serves and ends when told to", serves and server.returncode == 0, command, log[-2000:])

    def check_listed(self, command, reason, name):
        """What can be said of a command without running it."""
        wrong = []
        for part in re.split(r"\s*(?:&&|\|)\s*", command):
            words = shlex.split(part)
            script = ROOT / words[0]
            if "/" in words[0] and words[0].split("/")[0] in ("deploy", "tests"):
                if not os.access(script, os.X_OK) or subprocess.run(["bash", "-n", script]).returncode != 0:
                    wrong.append(f"{words[0]} is no script that parses")
            presets = re.findall(r"--preset (\S+)", part)
            known = (ROOT / "CMakePresets.json").read_text()
            wrong += [f"there is no preset {preset}" for preset in presets if f'"name": "{preset}"' not in known]
        report(f"{name} (not run: {reason})", not wrong, *wrong)

    def follow(self, command, name):
        """One command of a block."""
        listed = next((reason for beginning, reason in NOT_RUN if command.startswith(beginning)), None)
        if listed:
            self.check_listed(command, listed, name)
        elif command.startswith("amhexd "):
            self.start_server(command, name)
        elif re.match(r"(build/release/client/)?amhex ", command):
            self.run(self.here(command.removeprefix("build/release/client/")), name)
        elif command.startswith("kubectl "):
            if shutil.which("kubectl") is None:
                print("not run, as kubectl is not installed:", name)
            else:
                self.run(f"{command} --dry-run=client -o yaml", f"{name} --dry-run=client")
        elif command.startswith("tests/benchmarks/results_table.py"):
            words = re.sub(r":\d+\b", ":300", command).removeprefix("tests/")
            self.run(f"python3 {ROOT}/tests/{words} --amhex {self.amhex}", name)
        else:
            report(f"{name}: neither run nor listed", False)

    def help_of(self, *words):
        return subprocess.run([*words, "--help"], capture_output=True, text=True, check=True, env=self.environment).stdout

    def subcommands(self):
        return re.findall(r"^  ([a-z]+)[ ,]", self.help_of(self.amhex).partition("Subcommands:")[2].partition("\n\n")[0], re.M)

    def help_examples(self):
        """(command, example) for every line below Examples: in every help text."""
        for command in ([], *([name] for name in self.subcommands())):
            for example in re.findall(r"^ +(.*\bamhex .*)$", self.help_of(self.amhex, *command).partition("Example")[2], re.M):
                if not example.strip()[0].isdigit():  # an exit status
                    yield " ".join(command), example.strip()


def check_sentences(reader, texts):
    """Commands, flags and files in the middle of a text."""
    flags_of = {command: set(re.findall(r"--[a-z][a-z-]*", reader.help_of(reader.amhex, command))) for command in reader.subcommands()}
    flags_of["render"] = flags_of["picture"]
    server_flags = set(re.findall(r"--[a-z][a-z-]*", reader.help_of(reader.amhexd)))
    scripts = " ".join(path.read_text() for folder in ("deploy", "tests") for path in (ROOT / folder).glob("**/*.sh"))
    every_flag = set.union(server_flags, {"--version"}, set(re.findall(r"--[a-z][a-z-]*", scripts)), *flags_of.values())
    for document, text in texts.items():
        wrong, spans = [], re.findall(r"(?<!`)`([^`\n]+)`(?!`)", re.sub(r"```.*?```", "", text, flags=re.S))
        for span in spans:
            words = span.split()
            if words[0] == "amhex" and len(words) > 1 and not words[1].startswith("-") and words[1] != "COMMAND":
                missing = {word for word in words[2:] if word.startswith("--")} - flags_of.get(words[1], set())
                if words[1] not in flags_of or missing - {"--help"}:
                    wrong.append(f"`{span}`: no such command or flag")
            elif words[0] in ("amhexd", "amhex"):
                wrong += [f"`{span}`: {word} is no flag" for word in words[1:] if word.startswith("--") and word not in every_flag]
            elif re.match(r"(deploy|docs|tests|proto|engine|examples|client|server)/[\w/.-]+$", words[0]):
                place = words[0].rstrip("/")
                # Folders of the engine are named from their own root, files sometimes without their ending.
                if not list(ROOT.glob(place)) and not list(ROOT.glob(place + ".*")) and not list(ROOT.glob("engine/src/" + place)):
                    wrong.append(f"`{span}`: no such file")
            elif document in ("docs/client.md", "docs/guide.md", "docs/operations.md", "docs/cluster.md"):
                wrong += [f"`{span}`: no such flag" for word in words[:1] if re.fullmatch(r"--[a-z-]+", word) and word not in every_flag]
        report(f"{document}: what its sentences name is there ({len(spans)} names)", not wrong, *wrong)


def main():
    amhex, amhexd, folder = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
    reader = Reader(amhex, amhexd, folder)
    try:
        texts = documents()
        check_sentences(reader, texts)
        blocks = 0
        for block in re.findall(r"```sh\n(.*?)```", texts[TUTORIAL], re.S):
            blocks += 1
            reader.run(re.sub(SERVER_NAMES, f"unix:{reader.socket}", block), f"{TUTORIAL}: {block.splitlines()[0]}")
        reader.make_files()
        for document, text in texts.items():
            for block in re.findall(r"```sh\n(.*?)```", text, re.S) if document != TUTORIAL else []:
                blocks += 1
                for command in commands_of(block):
                    reader.follow(command, f"{document}: {command}")
        examples = list(reader.help_examples())
        for command, example in examples:
            reader.run(reader.here(example), f"{command} --help: {example}")
        print(blocks, "blocks of commands and", len(examples), "examples")
        if blocks < 12 or len(examples) < 25:
            sys.exit("that is less than there are")
    finally:
        reader.close()
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""amhex as somebody at a terminal has it: completion in real shells, the live line, Ctrl-C.

    tests/e2e/terminal.py AMHEX AMHEXD FOLDER [GROUP]...     groups: bash zsh fish progress interrupt; default all

Each program runs on a terminal of its own (a pseudo-terminal), keys are typed, and what comes to the screen is awaited, never a
time. Exit status 77 where the one group asked for needs a shell that is not installed.
"""
import fcntl
import os
import pathlib
import pty
import re
import select
import shutil
import signal
import struct
import subprocess
import sys
import termios
import time

SKIPPED = 77
# Nothing here takes seconds; a machine that is busy with other things may take minutes.
DEADLINE = 300
failures = 0


def check(name, condition, detail=""):
    global failures
    print("passed:" if condition else "FAILED:", name, "" if condition else detail)
    failures += not condition


class Terminal:
    """A program on a terminal of its own; all that it has written so far is in `text`."""

    def __init__(self, command, folder, environment, columns=100):
        self.text = ""
        self.process, self.screen = pty.fork()
        if self.process == 0:
            os.chdir(folder)
            os.execvpe(command[0], [str(word) for word in command], environment)
        fcntl.ioctl(self.screen, termios.TIOCSWINSZ, struct.pack("HHHH", 30, columns, 0, 0))

    def read(self, until):
        """Reads until the condition holds for `text`; whether it ever did."""
        end = time.monotonic() + DEADLINE
        while not until(self.text) and time.monotonic() < end:
            if not select.select([self.screen], [], [], 1)[0]:
                continue
            try:
                part = os.read(self.screen, 65536)
            except OSError:  # the other side is closed
                break
            if not part:
                break
            self.text += part.decode(errors="replace")
        return until(self.text)

    def find(self, pattern):
        return self.read(lambda text: re.search(pattern, text))

    def type(self, keys):
        os.write(self.screen, keys.encode())

    def end(self):
        """Reads to the end and gives the exit status."""
        self.read(lambda text: False)
        status = os.waitstatus_to_exitcode(os.waitpid(self.process, 0)[1])
        os.close(self.screen)
        return status

    def kill(self):
        os.kill(self.process, signal.SIGKILL)
        os.waitpid(self.process, 0)
        os.close(self.screen)


def lines_left(text):
    """What a terminal shows in the end: lines that were erased or written over are gone."""
    shown = []
    for line in text.split("\n"):
        for step in line.split("\r"):
            if step:
                shown_step = step.rpartition("\x1b[2K")[2]
        shown.append(shown_step if line.strip("\r") else "")
    return shown


class Try:
    def __init__(self, amhex, amhexd, folder):
        self.amhex, self.amhexd, self.folder = amhex, amhexd, folder
        shutil.rmtree(folder, ignore_errors=True)
        (folder / "bin").mkdir(parents=True)
        (folder / "bin/amhex").symlink_to(amhex)
        self.environment = {"PATH": f"{folder}/bin:{os.environ['PATH']}", "AMHEXD": str(amhexd), "HOME": str(folder), "TERM": "xterm",
                            "TMPDIR": "/tmp", "LC_ALL": "C.UTF-8", "PS1": "ready> "}
        # What a build with sanitizers needs.
        for name in ("TSAN_OPTIONS", "ASAN_OPTIONS", "UBSAN_OPTIONS", "AMHEX_WORKER_MEMORY_BYTES"):
            if name in os.environ:
                self.environment[name] = os.environ[name]

    def run(self, *words):
        return subprocess.run([self.amhex, *map(str, words)], cwd=self.folder, env=self.environment, capture_output=True, text=True,
                              check=True, timeout=DEADLINE).stdout

    def completes(self, shell, command, typed, wanted):
        """Types a part of a command line and a tabulator: the shell must write the rest."""
        terminal = Terminal(command, self.folder, self.environment)
        try:
            if not terminal.find(r"ready> "):
                check(f"{shell} starts", False, terminal.text)
                return
            terminal.text = ""
            terminal.type(typed + "\t")
            check(f"{shell} completes {typed!r}", terminal.find(re.escape(wanted)), terminal.text)
        finally:
            terminal.kill()

    def test_bash(self):
        (self.folder / "bashrc").write_text("PS1='ready> '\nbind 'set enable-bracketed-paste off'\nsource <(amhex completion bash)\n")
        command = ["bash", "--noprofile", "--rcfile", self.folder / "bashrc", "-i"]
        self.completes("bash", command, "amhex conv", "amhex convert ")
        self.completes("bash", command, "amhex mesh --solv", "--solver-ready")
        self.completes("bash", command, "amhex render --si", "--size")
        (self.folder / "named_part.stl").touch()
        self.completes("bash", command, "amhex mesh named_p", "named_part.stl")

    def test_zsh(self):
        (self.folder / ".zshrc").write_text("PROMPT='ready> '\nsource <(amhex completion zsh)\n")
        self.environment["ZDOTDIR"] = str(self.folder)
        command = ["zsh", "-d", "-i"]
        self.completes("zsh", command, "amhex conv", "amhex convert")
        self.completes("zsh", command, "amhex mesh --solv", "--solver-ready")
        (self.folder / "named_part.stl").touch()
        self.completes("zsh", command, "amhex mesh named_p", "named_part.stl")

    def test_fish(self):
        completions = self.folder / ".config/fish/completions"
        completions.mkdir(parents=True)
        (completions / "amhex.fish").write_text(self.run("completion", "fish"))

        def candidates(line):
            """As the shell has them after loading the file from where the help text puts it."""
            answer = subprocess.run(["fish", "-c", f"complete -C '{line}'"], cwd=self.folder, env=self.environment, capture_output=True,
                                    text=True, timeout=DEADLINE)
            return [word.split("\t")[0] for word in answer.stdout.splitlines()]

        check("fish completes a command", candidates("amhex conv") == ["convert"], candidates("amhex conv"))
        check("fish completes a flag", candidates("amhex mesh --solv") == ["--solver-ready"], candidates("amhex mesh --solv"))
        check("fish knows the flags of each command", "--jobs" in candidates("amhex bench --j") and not candidates("amhex list --jo"))
        (self.folder / "named_part.stl").touch()
        check("fish knows other names of commands", candidates("amhex rend") == ["render"] and "--cut" in candidates("amhex render --c"),
              (candidates("amhex rend"), candidates("amhex render --c")))
        check("fish completes files", candidates("amhex mesh named_p") == ["named_part.stl"], candidates("amhex mesh named_p"))

    def test_progress(self):
        self.run("demo", "--points", "20000", "-o", "scan.drc")
        columns = 72
        terminal = Terminal([self.amhex, "mesh", "scan.drc", "--cells", "2500", "--initialization", "grid", "--iterations", "40", "-o",
                             "scan.vtu"], self.folder, self.environment, columns)
        status = terminal.end()
        check("mesh on a terminal ends well", status == 0, terminal.text[-2000:])
        live = re.findall(r"\r\x1b\[2K([^\r\n\x1b]+)", terminal.text)
        check("there is a live line", any(re.match(r"\[#*\.*\] +\d+ %  +[\d.]+ s  ", line) for line in live), live[:5])
        check("it counts iterations and their movement", any(re.search(r"iteration \d+/40, movement", line) for line in live), live[-5:])
        check("it never wraps", all(len(line) < columns for line in live), max(map(len, live), default=0))
        shares = [int(share) for share in re.findall(r"\[#*\.*\] +(\d+) %", terminal.text)]
        check("the bar only grows", shares == sorted(shares) and shares and shares[-1] > 50, shares)
        left = "\n".join(lines_left(terminal.text))
        check("nothing of it is left at the end", not re.search(r"\[#*\.+\]", left), left)
        check("stages and summary are", all(word in left for word in ("check input", "place vertices", "scaled Jacobian")), left)
        (self.folder / "screen.txt").write_text(left)

    def test_interrupt(self):
        self.run("demo", "--points", "30000", "-o", "scan.drc")
        command = [self.amhex, "mesh", "scan.drc", "--cells", "200000", "-o", "large.vtu"]
        terminal = Terminal(command, self.folder, self.environment)
        if terminal.find(r"decode input +[\d.]+ s"):
            terminal.type("\x03")
        status = terminal.end()
        check("Ctrl-C ends with status 130", status == 130, (status, terminal.text[-2000:]))
        check("and says that the job was cancelled", "was cancelled" in terminal.text, terminal.text[-2000:])
        check("the live line is gone", not re.search(r"\[#*\.+\]", "\n".join(lines_left(terminal.text))))
        check("no mesh is written", not (self.folder / "large.vtu").exists())


GROUPS = {"bash": "bash", "zsh": "zsh", "fish": "fish", "progress": None, "interrupt": None}


def main():
    amhex, amhexd, folder = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
    groups = sys.argv[4:] or list(GROUPS)
    for group in groups:
        if GROUPS[group] and shutil.which(GROUPS[group]) is None:
            print("skipped:", GROUPS[group], "is not installed")
            if groups == [group]:
                sys.exit(SKIPPED)
            continue
        getattr(Try(amhex, amhexd, folder / group), f"test_{group}")()
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Writes docs/api.md from the comments in proto/amhex/v1.

    docs/generate_api.py           writes the file
    docs/generate_api.py --check   exit status 1 if the file is not what would be written

Either way the exit status is 1 if a field's comment does not say its range, default or absence.
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
# The order of the page; files that are not named here follow.
FIRST = ["meshing_service", "blob_service", "job", "params", "geometry", "capabilities", "errors"]
TARGET = ROOT / "docs/api.md"
HEAD = """# API reference

<!-- Written by docs/generate_api.py from proto/amhex/v1; do not edit. -->

Package `amhex.v1`, over gRPC. Every call is safe to repeat. Every error carries `google.rpc.ErrorInfo` with the domain `amhex` and a reason
of `ErrorReason`. Server reflection is on.

"""


def prose(comment):
    """Comment lines as Markdown: paragraphs stay, indented blocks become code, error codes a list."""
    blocks, block = [], []
    for line in comment + [""]:
        if line:
            block.append(line)
        elif block:
            blocks.append(block)
            block = []
    texts = []
    for block in blocks:
        if any(re.match(r"\s{2,}\S.*\s{2,}", line) for line in block):
            plain = [line for line in block if not line.startswith("  ")]
            coded = [line for line in block if line.startswith("  ")]
            texts.append("\n".join(plain) + "\n\n```\n" + "\n".join(line[2:] for line in coded) + "\n```")
        elif re.match(r"[A-Z_]{6,}[,:]", block[0]):
            items = []
            for line in block:
                if re.match(r"[A-Z_]{6,}[,:]", line):
                    items.append("- `" + re.sub(r"^([A-Z_]+)", r"\1`", line))
                else:
                    items[-1] += " " + line.strip()
            texts.append("\n".join(items))
        elif any(re.match(r"\s*\d+\. ", line) for line in block):
            texts.append(re.sub(r"\n(?!\d+\. )", " ", "\n".join(line.strip() for line in block)).replace(" 1. ", "\n\n1. ", 1)
                         .replace("\n1. ", "\n\n1. ", 1))
        else:
            texts.append(" ".join(line.strip() for line in block))
    return "\n\n".join(texts)


def cell(comment):
    """One line for a table, without the indented lines; those stand below it."""
    comment = [line for line in comment if not line.startswith("  ")]
    return " ".join(line.strip() for line in comment if line).replace("|", "\\|")


class Reader:
    """Reads the statements of one file with the comments above them."""

    def __init__(self, text):
        self.lines = text.split("\n")
        self.at = 0
        self.comment = []

    def next(self):
        """(comment, statement) or None; a statement ends with ; { or }."""
        statement = ""
        while self.at < len(self.lines):
            line = self.lines[self.at].strip()
            self.at += 1
            if line.startswith("//"):
                self.comment.append(line[3:].rstrip())
            elif not line:
                if not statement:
                    self.comment = []
            else:
                statement = f"{statement} {line}".strip()
                if statement[-1] in ";{}":
                    comment, self.comment = self.comment, []
                    return comment, statement
        return None


def type_text(statement):
    """(name, type) of a field."""
    found = re.match(r"(optional |repeated )?([\w.]+|map<[^>]+>) (\w+) = \d+", statement)
    label, kind, name = found.groups()
    return name, (label or "") + kind


NUMBERS = {"int32", "int64", "uint32", "uint64", "float", "double", "google.protobuf.Duration"}
TEXTS = {"string", "bytes"}
messages = set()  # names of all messages
lacking = []  # fields whose comments do not say what they must


def check(owner, name, kind, comment):
    """A number says its range, a text or list when it is empty, a message when it is absent."""
    text, bare = " ".join(comment), kind.split()[-1]
    if kind.startswith(("repeated", "map")) or bare in TEXTS:
        wanted = r"Required|[Ee]mpty|Range: \[1,"
    elif bare in NUMBERS:
        wanted = r"Range:"
    elif bare == "bool":
        wanted = r"Default:|Is true"
    elif "." in bare or bare in messages:
        wanted = r"Required|[Aa]bsent|Always set|[Oo]nly set"
    else:
        wanted = r"."
    if not re.search(wanted, text):
        lacking.append(f"{owner}.{name}: {wanted}")


def read_body(reader, owner, out):
    """The fields of a message: rows, and nested enums into `out`."""
    rows, oneof = [], None
    while True:
        comment, statement = reader.next()
        if statement == "}":
            if oneof is None:
                return rows
            oneof = None
        elif statement.startswith("oneof"):
            oneof = statement.split()[1]
        elif statement.startswith("enum"):
            out.append(read_enum(reader, comment, f"{owner}.{statement.split()[1]}"))
        else:
            name, kind = type_text(statement)
            if oneof is None:
                check(owner, name, kind, comment)
            rows.append((name, kind + (f", one of `{oneof}`" if oneof else ""), cell(comment)))


def read_enum(reader, comment, name):
    text = f"### enum {name}\n\n{prose(comment)}\n\n| value | number | meaning |\n|---|---|---|\n"
    below = ""
    while True:
        comment, statement = reader.next()
        if statement == "}":
            return text + below
        value, number = re.match(r"(\w+) = (\d+);", statement).groups()
        text += f"| `{value}` | {number} | {cell(comment)} |\n"
        coded = [line[2:] for line in comment if line.startswith("  ")]
        if coded:
            below += f"\nThe record of `{value}`:\n\n```\n" + "\n".join(coded) + "\n```\n"


def read_message(reader, comment, name):
    nested = []
    rows = read_body(reader, name, nested)
    text = f"### {name}\n\n{prose(comment)}\n"
    if rows:
        text += "\n| field | type | |\n|---|---|---|\n"
        text += "".join(f"| `{field}` | {kind} | {about} |\n" for field, kind, about in rows)
    return "\n".join([text] + nested)


def read_service(reader, comment, name):
    text = f"### service {name}\n\n{prose(comment)}\n"
    while True:
        comment, statement = reader.next()
        if statement == "}":
            return text
        call = re.match(r"rpc (\w+)\((stream )?([\w.]+)\) ?returns ?\((stream )?([\w.]+)\)", statement)
        method, sends, request, streams, response = call.groups()
        text += f"\n#### {name}.{method}\n\n`{sends or ''}{request}` → `{streams or ''}{response}`\n\n{prose(comment)}\n"


def document(name):
    text = (ROOT / f"proto/amhex/v1/{name}.proto").read_text()
    head, _, rest = text.partition('syntax = "proto3";')
    intro = prose([line[3:] for line in head.strip().split("\n")])
    out = [f"## {name}.proto\n\n{intro}\n"]
    reader = Reader(rest)
    while (entry := reader.next()) is not None:
        comment, statement = entry
        word = statement.split()[0]
        if statement.endswith("{}"):
            out.append(f"### {statement.split()[1].rstrip('{')}\n\n{prose(comment)}\n")
        elif word == "message":
            out.append(read_message(reader, comment, statement.split()[1]))
        elif word == "enum":
            out.append(read_enum(reader, comment, statement.split()[1]))
        elif word == "service":
            out.append(read_service(reader, comment, statement.split()[1]))
    return "\n".join(out)


def main():
    found = sorted(path.stem for path in (ROOT / "proto/amhex/v1").glob("*.proto"))
    names = [name for name in FIRST if name in found] + [name for name in found if name not in FIRST]
    for name in names:
        messages.update(re.findall(r"^message (\w+)", (ROOT / f"proto/amhex/v1/{name}.proto").read_text(), re.M))
    page = HEAD + "\n".join(document(name) for name in names)
    if lacking:
        sys.exit("comments of fields lack something:\n" + "\n".join(lacking))
    if sys.argv[1:] == ["--check"]:
        if TARGET.read_text() != page:
            sys.exit("docs/api.md is not what docs/generate_api.py writes; run it")
        print("docs/api.md is up to date")
    else:
        TARGET.write_text(page)


if __name__ == "__main__":
    main()

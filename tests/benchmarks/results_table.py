#!/usr/bin/env python3
"""Meshes a list of models with the `amhex` client and writes the measured table, docs/results.md.

    tests/benchmarks/results_table.py --amhex build/release/client/amhex --models FOLDER
    tests/benchmarks/results_table.py --server localhost:50051 part.obj:9500 scan.drc

Each model is FILE, FILE:CELLS, FILE:CELLS@paper (the paper's own start, relaxation and search for
cells), or for volume meshes FILE@USE (reassemble, subdivide). Without any, the default list is
looked for in --models. Every figure is read from what `amhex mesh --json` wrote for a mesh that it
had checked; a model without a valid mesh appears with its error. Standard library only.
"""

import argparse
import datetime
import json
import os
import pathlib
import platform
import re
import subprocess
import sys
import time
import typing

from paper_table import OTHERS, PAPER

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]

# The sizes of the paper's Table 1 where it has the model.
DEFAULT_MODELS = [
    "twistcube.obj:1300",
    "twistcube.obj:5700",
    "cylinder.obj:1670",
    "fandisk.obj:9500",
    "jumpramp.obj:1460",
    "holeblock.off:7500",
    "rod.obj:7400",
    "sculpt.ply:5200",
    "trefoil.ply:8500",
    "rocker-arm.obj:10000",
    "bunny_qp14.drc:3200",
    "bunny_qp14.drc:49000",
    "hand.obj:47000",
    "bunny-cloud_8k.ply",
    "igea_5k_qp14_qn10.drc",
    "twistcube_cloud_6k.ply",
    "igea_5k.ply",
    "igea_5k_noise.ply",
    "igea_5k_noise_nonormals.ply",
    "mixed_cells.vtk@reassemble",
    "block_hex.mesh@reassemble",
    "bunny_hex.vtk@reassemble",
    "twistcube_tet.mesh@reassemble",
    "twistcube_tet.mesh@subdivide",
    "bunny_tet.mesh@subdivide",
    "twistcube.obj:1300@paper",
    "cylinder.obj:1670@paper",
]

# Sites on a grid, 150 iterations on 12^3 lattice points per site, the search of section 5.2 alone.
PAPER_SETTINGS = ["--initialization", "grid", "--iterations", "150", "--lattice-points", "1728",
                  "--extraction", "paper", "--trials", "1"]

# The paper's threshold for cells that are put together from a volume mesh's (section 6.2).
REASSEMBLY_QUALITY = 0.1

# Small enough that sixteen of them may live in a repository.
PICTURE_SIZE = "480x360"
PICTURES_PER_ROW = 2

# What follows this line in the document is written by hand and kept.
BY_HAND = "<!-- Below: written by hand, kept by the script. -->"

CELL_TYPES = ["hexahedron", "hexprism", "prism", "slice", "pyramid", "tetrahedron"]


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("model", nargs="*", help="FILE, FILE:CELLS or FILE@USE")
    parser.add_argument("--models", type=pathlib.Path, help="folder of the default list")
    parser.add_argument("--amhex", default=REPOSITORY / "build/release/client/amhex",
                        type=pathlib.Path, help="the client (default: %(default)s)")
    parser.add_argument("--server", help="address of a running amhexd (default: --local)")
    parser.add_argument("--backend", default="auto", choices=["auto", "cpu", "cuda"])
    parser.add_argument("--output", default=REPOSITORY / "docs/results.md", type=pathlib.Path)
    parser.add_argument("--keep", type=pathlib.Path, default=REPOSITORY / "build/results",
                        help="folder for meshes and JSON files (default: build/results)")
    parser.add_argument("--pictures", type=pathlib.Path, metavar="FOLDER",
                        help="draw every mesh cut open there and show the pictures in the document")
    parser.add_argument("--timeout", type=float, default=1800, help="seconds per model")
    arguments = parser.parse_args()
    if not arguments.model and not arguments.models:
        parser.error("give models, or the folder of the default list with --models")
    return arguments


class Model(typing.NamedTuple):
    path: pathlib.Path
    cells: int | None  # wanted
    use: str | None  # of a volume mesh, or "paper"

    def wanted(self):
        return " ".join(str(part) for part in (self.cells, self.use) if part)


def split_model(text):
    """'a/b.obj:500' -> b.obj with 500 cells; 'a/b.mesh@subdivide' -> b.mesh, subdivided."""
    match = re.fullmatch(r"(.+?)(?::(\d+))?(?:@(\w+))?", text)
    return Model(pathlib.Path(match[1]), int(match[2]) if match[2] else None, match[3])


def mesh(arguments, model):
    """Runs the client on one model; its JSON report, or the error it printed."""
    arguments.keep.mkdir(parents=True, exist_ok=True)
    path = model.path
    report_path = arguments.keep / (path.stem + ".json")
    report_path.unlink(missing_ok=True)
    command = [str(arguments.amhex), "mesh", str(path)]
    command += ["-o", str(arguments.keep / (path.stem + ".vtu")), "--json", str(report_path)]
    command += ["--server", arguments.server] if arguments.server else ["--local"]
    command += ["--backend", arguments.backend]
    if model.cells:
        command += ["--cells", str(model.cells)]
    if model.use == "paper":
        command += PAPER_SETTINGS
    elif model.use:
        command += ["--volume-use", model.use, "--min-quality", str(REASSEMBLY_QUALITY)]
    print(" ".join(command), flush=True)
    started = time.monotonic()
    try:
        run = subprocess.run(command, capture_output=True, text=True, timeout=arguments.timeout)
    except subprocess.TimeoutExpired:
        return None, f"no result within {arguments.timeout:.0f} s", arguments.timeout
    seconds = time.monotonic() - started
    if run.returncode != 0:
        lines = [line for line in run.stderr.splitlines() if line.strip()]
        return None, lines[-1] if lines else f"exit status {run.returncode}", seconds
    with open(report_path, encoding="utf-8") as file:
        return json.load(file), None, seconds


def picture_path(arguments, path, cells):
    suffix = f"-{cells.replace(' ', '-')}" if cells else ""
    return arguments.pictures / (path.stem + suffix + ".png")


def draw(arguments, path, cells):
    """The mesh just written, cut open; the error of the client, if any, is only printed."""
    picture = picture_path(arguments, path, cells)
    picture.parent.mkdir(parents=True, exist_ok=True)
    command = [str(arguments.amhex), "picture", str(arguments.keep / (path.stem + ".vtu")),
               "-o", str(picture), "--size", PICTURE_SIZE]
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode != 0:
        print(f"  no picture: {run.stderr.strip()}", flush=True)


def picture_rows(arguments, done):
    """Rows of PICTURES_PER_ROW cells: picture and caption."""
    shown = []
    for path, cells, report, _ in done:
        picture = picture_path(arguments, path, cells)
        if not picture.exists():
            continue
        link = os.path.relpath(picture, arguments.output.parent)
        caption = f"{path.name}, {report['statistics']['cell_count']} cells"
        if cells and cells.endswith("paper"):
            caption += ", the paper's settings"
        shown.append(f"![{caption}]({link})<br>{caption}")
    shown += [""] * (-len(shown) % PICTURES_PER_ROW)
    return [shown[i:i + PICTURES_PER_ROW] for i in range(0, len(shown), PICTURES_PER_ROW)]


def paper_row(path, cells):
    """The paper's row of that model that is nearest in size, or None."""
    is_volume = path.suffix in (".mesh", ".vtk", ".vtu", ".msh")
    rows = PAPER.get(path.stem if is_volume else re.split(r"[_-]", path.stem)[0], [])
    return min(rows, key=lambda row: abs(row[0] - cells), default=None)


def figure(value, digits):
    return "–" if value is None else f"{value:.{digits}f}"


def others_rows(done):
    """Rows of other methods, each model's after ours of about that size."""
    rows = []
    for model, others in OTHERS.items():
        ours = [(path, report, seconds) for path, wanted, report, seconds in done
                if re.split(r"[_.-]", path.name)[0] == model and "paper" not in (wanted or "")
                and path.suffix not in (".mesh", ".vtk", ".vtu", ".msh")]
        for path, report, seconds in ours:
            s = report["statistics"]
            rows.append([f"**{path.name}**", str(s["cell_count"]), percent(s["hexahedra_ratio"]),
                         percent(s["hexahedra_volume_ratio"]), f"{s['min_scaled_jacobian']:.3f}",
                         f"{s['average_scaled_jacobian']:.3f}", f"{seconds:.0f}"])
        if ours:
            rows += [[f"{model}, [{name.split(',')[0]}]{name[len(name.split(',')[0]):]}",
                      figure(cells, 0), figure(by_number, 1), figure(by_volume, 1),
                      figure(least, 3), figure(average, 3), figure(seconds, 0)]
                     for name, cells, by_number, by_volume, least, average, seconds in others]
    return rows


def percent(ratio):
    return f"{100 * ratio:.1f}"


def quality_row(path, wanted, report):
    s = report["statistics"]
    by_type = s["cells_by_type"]
    return [
        path.name,
        str(wanted or "–"),
        str(s["cell_count"]),
        " / ".join(str(by_type.get(name, 0)) for name in CELL_TYPES),
        percent(s["hexahedra_ratio"]),
        percent(s["hexahedra_volume_ratio"]),
        f"{s['min_scaled_jacobian']:.3f}",
        f"{s['average_scaled_jacobian']:.3f}",
        f"{s['min_scaled_jacobian_hexahedra']:.3f}",
        f"{s['average_scaled_jacobian_hexahedra']:.3f}",
        f"{100 * s['mesh_to_input_max']:.2f}",
        f"{100 * s['input_to_mesh_max']:.2f} ({100 * s['input_to_mesh_mean']:.3f})",
        f"{s.get('sharp_edge_deviation_rms', 0):.3f}",
        f"{s.get('shortest_edge', 0) / s['edge_length']:.2f}",
        str(s["genus"]),
    ]


def cost_row(path, report, seconds, stage_names):
    wall = {stage["stage"]: stage["wall_seconds"] for stage in report["stages"]}
    peak = max((stage["peak_memory_bytes"] for stage in report["stages"]), default=0)
    row = [path.name, str(report["statistics"]["cell_count"])]
    row += [f"{wall.get(name, 0):.2f}" for name in stage_names]
    return row + [f"{sum(wall.values()):.2f}", f"{seconds:.2f}", f"{peak / 2**20:.0f}"]


def comparison_row(path, wanted, report, seconds):
    s = report["statistics"]
    paper = paper_row(path, s["cell_count"])
    ours = [str(s["cell_count"]), percent(s["hexahedra_ratio"]),
            percent(s["hexahedra_volume_ratio"]), f"{s['min_scaled_jacobian']:.3f}",
            f"{s['average_scaled_jacobian']:.3f}",
            f"{s['average_scaled_jacobian_hexahedra']:.3f}", f"{seconds:.0f}"]
    theirs = [str(paper[0]), f"{paper[1]:.1f}", f"{paper[2]:.1f}", f"{paper[3]:.3f}",
              f"{paper[4]:.3f}", f"{paper[4]:.3f}", str(paper[5])]
    name = path.name + (", the paper's settings" if (wanted or "").endswith("paper") else "")
    return [name] + [f"{a} ({b})" for a, b in zip(ours, theirs)]


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)


def commit_of(done):
    """The commit that the engine was built from, as it says itself: 'amhex 0.1.0 (COMMIT)'."""
    versions = {report["engine_version"] for _, _, report, _ in done}
    return ", ".join(sorted(re.sub(r".*\((.*)\)", r"\1", version) for version in versions)) or "–"


def machine():
    model = platform.processor() or platform.machine()
    memory = 0
    for line in pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            model = line.split(":", 1)[1].strip()
            break
    for line in pathlib.Path("/proc/meminfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("MemTotal"):
            memory = int(line.split()[1]) // 2**20
    return f"{model}, {os.cpu_count()} threads, {memory} GiB"


def write_document(arguments, results):
    done = [(path, wanted, report, seconds)
            for path, wanted, report, error, seconds in results if report]
    failed = [(path, wanted, error) for path, wanted, report, error, _ in results if not report]
    stage_names = [stage["stage"] for stage in done[0][2]["stages"]] if done else []

    parts = [
        "# Measured results",
        "Written by `tests/benchmarks/results_table.py`; run it on your own files. Default "
        "parameters but for the size. Every mesh passed the engine's validator and the client's "
        "check. The models are not part of the repository.",
        "\n".join([
            f"- commit: {commit_of(done)}",
            f"- machine: {machine()}, load average {arguments.load_average:.1f} at the start",
            f"- date: {datetime.datetime.now(datetime.timezone.utc):%Y-%m-%d}",
            f"- backend: {done[0][2]['backend_note'] if done else '–'}",
        ]),
        "## Quality",
        "Cells are hexahedra / hexprisms / prisms / slices / pyramids / tetrahedra. MSJ and ASJ are "
        "the minimum and the average over cells of the least scaled Jacobian. Distances are in "
        "percent of the diagonal of the input's box; sharp edges: the root mean square distance from "
        "the input's to the mesh's; shortest edge: of any cell; both in edge lengths. What is wanted: a number of cells, or of a volume "
        f"mesh, its cells reassembled (minimum quality {REASSEMBLY_QUALITY}) or subdivided. “paper”: "
        "the paper's own start, relaxation and search (`" + " ".join(PAPER_SETTINGS) + "`).",
        table(["model", "wanted", "cells", "by type", "hex %", "hex vol %", "MSJ", "ASJ",
               "MSJ hex", "ASJ hex", "mesh → input max", "input → mesh max (mean)", "sharp edges",
               "shortest edge", "genus"],
              [quality_row(*entry[:3]) for entry in done]),
        "## Cost",
        "Wall-clock seconds per stage; `engine` is their sum, `client` the whole command from start "
        "to exit: reading, encoding, queueing, meshing, checking, writing. Peak memory is the worker "
        "process's, in MiB.",
        table(["model", "cells"] + stage_names + ["engine", "client", "peak MiB"],
              [cost_row(path, report, seconds, stage_names)
               for path, _, report, seconds in done]),
    ]
    compared = [entry for entry in done if entry[1] != "subdivide"
                and paper_row(entry[0], entry[2]["statistics"]["cell_count"])]
    if compared:
        parts += [
            "## Beside the paper",
            "In brackets: Table 1, rows “Ours”. Seconds are on different machines, sizes differ "
            "where the counts say so, and cylinder, jumpramp and holeblock are look-alikes of the "
            "paper's models. The paper's one average stands beside both of ours, over all cells and "
            "over hexahedra alone, as only the second can be meant (“The paper's averages”, below).",
            table(["model", "cells", "hex %", "hex vol %", "MSJ", "ASJ", "ASJ hex", "seconds"],
                  [comparison_row(*entry) for entry in compared]),
        ]
    others = others_rows(done)
    if others:
        parts += [
            "## Beside other methods",
            "The other rows of the paper's Table 1, with the paper's keys, below ours (bold) of the "
            "same model. Their meshes may hold other polyhedra, hang or fold where the paper says so; "
            "a negative least scaled Jacobian is an inverted cell.",
            table(["mesh", "cells", "hex %", "hex vol %", "MSJ", "ASJ", "seconds"], others),
        ]
    pictures = picture_rows(arguments, done) if arguments.pictures else []
    if pictures:
        parts += ["## Cut open", "Hexahedra inside are bluish, all other cells yellow.",
                  table(["", ""], pictures)]
    warned = [(path, report["warnings"]) for path, _, report, _ in done if report["warnings"]]
    if warned:
        parts += ["## Warnings",
                  "\n".join(f"- {path.name}: {'; '.join(text)}" for path, text in warned)]
    if failed:
        parts += ["## Without a valid mesh",
                  "\n".join(f"- {path.name}{f' ({wanted})' if wanted else ''}: {error}"
                            for path, wanted, error in failed)]
    if arguments.output.exists():
        _, marker, rest = arguments.output.read_text(encoding="utf-8").partition(BY_HAND)
        parts += [(marker + rest).rstrip()] if marker else []
    arguments.output.parent.mkdir(parents=True, exist_ok=True)
    arguments.output.write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def main():
    arguments = parse_arguments()
    names = arguments.model or [str(arguments.models / name) for name in DEFAULT_MODELS]
    arguments.load_average = os.getloadavg()[0]
    results = []
    for name in names:
        model = split_model(name)
        path = model.path
        report, error, seconds = mesh(arguments, model)
        results.append((path, model.wanted(), report, error, seconds))
        if arguments.pictures and report:
            draw(arguments, path, model.wanted())
        verdict = f"failed: {error}" if error else "valid"
        print(f"  {path.name}: {verdict}, {seconds:.1f} s", flush=True)
        # After every model, so that an interrupted run leaves what it measured.
        write_document(arguments, results)
    print(f"wrote {arguments.output}")
    return 1 if any(error for *_, error, _ in results) else 0


if __name__ == "__main__":
    sys.exit(main())

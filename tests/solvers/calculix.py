#!/usr/bin/env python3
"""Elasticity and heat conduction on a mesh of amhex's, with CalculiX.

    tests/solvers/calculix.py AMHEX MESH FOLDER

The patch test: a linear field prescribed on the hull must come out at every node inside, whatever the cells look like.
Known solutions: fields that satisfy the equations exactly and are not linear come out but for what fields that are
linear over each cell cannot follow. Exit status 77 where ccx is not installed.
"""
import math
import pathlib
import re
import shutil
import subprocess
import sys

SKIPPED = 77
# ccx prints seven digits.
PATCH_TOLERANCE = 2e-5
YOUNG, POISSON = 210000.0, 0.3
failures = 0


def check(name, condition, *detail):
    global failures
    print("passed:" if condition else "FAILED:", name, *detail)
    failures += not condition


def read_deck(path):
    """Nodes by number, the numbers in NHULL, and the largest diameter of a cell."""
    nodes, hull, diameter, section = {}, set(), 0.0, ""
    for line in path.read_text().splitlines():
        if line.startswith("*"):
            section = line.upper()
        elif section.startswith("*NODE"):
            number, *place = line.split(",")
            nodes[int(number)] = tuple(map(float, place))
        elif section.startswith("*ELEMENT"):
            corners = [nodes[int(word)] for word in line.split(",")[1:] if word.strip()]
            diameter = max([diameter] + [math.dist(a, b) for a in corners for b in corners])
        elif section.startswith("*NSET"):
            hull.update(int(word) for word in line.split(",") if word.strip())
    return nodes, hull, diameter


def solve(folder, name, step, boundary, output):
    """Runs ccx; the printed values by node."""
    deck = folder / f"{name}.inp"
    deck.write_text(f"*INCLUDE, INPUT=mesh.inp\n*MATERIAL, NAME=STEEL\n*ELASTIC\n{YOUNG}, {POISSON}\n*CONDUCTIVITY\n50.\n"
                    "*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n*INITIAL CONDITIONS, TYPE=TEMPERATURE\nNALL, 0.\n"
                    f"*STEP\n{step}\n*BOUNDARY\n" + "".join(boundary) + f"*NODE PRINT, NSET=NALL\n{output}\n*END STEP\n")
    run = subprocess.run(["ccx", name], cwd=folder, capture_output=True, text=True, timeout=300)
    if run.returncode != 0 or "*ERROR" in run.stdout:
        sys.exit(f"ccx failed:\n{run.stdout[-3000:]}")
    values = {}
    for line in (folder / f"{name}.dat").read_text().splitlines():
        words = line.split()
        if len(words) >= 2 and re.fullmatch(r"\d+", words[0]):
            values[int(words[0])] = tuple(map(float, words[1:]))
    return values


def compare(name, nodes, hull, values, field, tolerance):
    """The largest error at inner nodes, in units of the field's range; `tolerance` is in the same units."""
    inner = [number for number in nodes if number not in hull and number in values]
    wanted = {number: field(*nodes[number]) for number in nodes}
    components = range(len(next(iter(wanted.values()))))
    spread = max(max(v[c] for v in wanted.values()) - min(v[c] for v in wanted.values()) for c in components)
    worst = max(abs(values[number][c] - wanted[number][c]) for number in inner for c in components)
    check(f"{name}: {len(inner)} inner nodes", worst < tolerance * spread, f"largest error {worst / spread:.2e} of the range, at most {tolerance:.2e}")
    return worst / spread


def main():
    amhex, mesh, folder = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    if shutil.which("ccx") is None:
        print("skipped: ccx is not installed")
        sys.exit(SKIPPED)
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run([amhex, "convert", mesh, "-o", folder / "mesh.inp", "--solver-ready"], check=True)
    nodes, hull, diameter = read_deck(folder / "mesh.inp")
    size = max(max(p[axis] for p in nodes.values()) - min(p[axis] for p in nodes.values()) for axis in range(3))

    def displaced(field):
        return [f"{n}, {c + 1}, {c + 1}, {value:.12e}\n" for n in sorted(hull) for c, value in enumerate(field(*nodes[n]))]

    def heated(field):
        return [f"{n}, 11, 11, {field(*nodes[n])[0]:.12e}\n" for n in sorted(hull)]

    def linear(x, y, z):
        return (1e-3 * x + 2e-4 * y - 3e-4 * z, 5e-4 * x - 2e-4 * y + 1e-4 * z, 3e-4 * x + 6e-4 * y + 4e-4 * z)

    def interpolation_error(curvature, field):
        """Half the curvature times the largest diameter squared: how far a field that is linear over each cell may be from one
        with that second derivative. In units of the field's range."""
        values = [field(*nodes[n]) for n in nodes]
        spread = max(max(v[c] for v in values) - min(v[c] for v in values) for c in range(len(values[0])))
        return curvature / 2 * diameter**2 / spread

    # The gradient of the harmonic x^3 - 3 x y^2: free of divergence and harmonic itself, so in balance without forces.
    def bent(x, y, z):
        return (3e-3 * (x * x - y * y) / size, -6e-3 * x * y / size, 0.0)

    static = "*STATIC"
    compare("elasticity, patch test", nodes, hull, solve(folder, "patch", static, displaced(linear), "U"), linear, PATCH_TOLERANCE)
    compare("elasticity, known solution", nodes, hull, solve(folder, "bent", static, displaced(bent), "U"), bent,
            interpolation_error(6e-3 / size, bent))
    steady = "*HEAT TRANSFER, STEADY STATE"

    def slope(x, y, z):
        return (10 + 3 * x - 2 * y + z,)

    def saddle(x, y, z):
        return ((x * x + y * y - 2 * z * z) / size,)

    compare("heat, patch test", nodes, hull, solve(folder, "slope", steady, heated(slope), "NT"), slope, PATCH_TOLERANCE)
    compare("heat, known solution", nodes, hull, solve(folder, "saddle", steady, heated(saddle), "NT"), saddle,
            interpolation_error(4 / size, saddle))
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()

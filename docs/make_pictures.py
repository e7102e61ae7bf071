#!/usr/bin/env python3
"""Draws the pictures of docs/guide.md and README.md from generated shapes, and prints the figures that stand below them.

    docs/make_pictures.py build/release/client/amhex [NAME]...     all, or those of the names given

Each is one run of `amhex mesh`: an input, flags, and where the picture is cut.
"""
import json
import math
import pathlib
import subprocess
import sys
import tempfile

IMAGES = pathlib.Path(__file__).resolve().parent / "images"
SIZE = "480x360"
SIZES = {"demo": "1200x900"}  # that of README.md
JITTERED = "--cells 300 --initialization jittered_grid --jitter "
# name: (input, flags, cut)
PICTURES = {
    "demo": ("scan.drc", "--cells 6000", ""),
    "cells_1000": ("scan.drc", "--cells 1000", ""),
    "cells_6000": ("scan.drc", "--cells 6000", ""),
    "trials_1": ("scan.drc", "--cells 1000 --trials 1", ""),
    "start_grid": ("scan.drc", "--cells 1000 --initialization grid", ""),
    "start_jittered": ("scan.drc", "--cells 1000 --initialization jittered_grid", ""),
    "sharp_35": ("hexagon.obj", "--cells 300", "none"),
    "sharp_180": ("hexagon.obj", "--cells 300 --sharp-angle 180", "none"),
    "sphere": ("sphere.ply", "--cells 1000", ""),
    "sphere_trial": ("sphere.ply", "--cells 1000 --trials 1", ""),
    "quality_60": ("sphere.ply", "--cells 1000 --trials 1 --min-quality 0.6", ""),
    "cube_20": ("cube.ply", JITTERED + "0.2", ""),
    "cube_iterations": ("cube.ply", JITTERED + "0.5 --iterations 10", ""),
    "cube_50": ("cube.ply", JITTERED + "0.5", ""),
    "cube_seed": ("cube.ply", JITTERED + "0.5 --seed 2", ""),
    "cube_lattice": ("cube.ply", JITTERED + "0.5 --lattice-points 8", ""),
    "cube_split_7": ("cube.ply", JITTERED + "0.5 --split-limit 7", ""),
    "cube_split_26": ("cube.ply", JITTERED + "0.5 --split-limit 26", ""),
    "cube_regularity": ("cube.ply", JITTERED + "0.5 --regularity-weight 0", ""),
    "extraction_paper": ("scan.drc", "--cells 1000 --trials 1 --extraction paper", ""),
    "guide_plane": ("sphere.ply", "--cells 1000 --guide-plane 0,0,0,1,0,1", "y"),
    "volume_reassemble": ("tetrahedra.mesh", "", "y:0.6"),
    "volume_subdivide": ("tetrahedra.mesh", "--volume-use subdivide", "y:0.6"),
    "volume_hull": ("tetrahedra.mesh", "--volume-use hull --cells 300", "y:0.6"),
}


def hexagon(path):
    """A prism over six corners: 60 degrees at each of its upright edges."""
    n = 6
    ring = [(math.cos(2 * math.pi * i / n), math.sin(2 * math.pi * i / n)) for i in range(n)]
    lines = [f"v {x:.17g} {y:.17g} {z}" for z in (0, 1) for x, y in ring]
    lines += ["f " + " ".join(str(i + 1) for i in reversed(range(n))), "f " + " ".join(str(n + i + 1) for i in range(n))]
    lines += [f"f {i + 1} {(i + 1) % n + 1} {n + (i + 1) % n + 1} {n + i + 1}" for i in range(n)]
    path.write_text("\n".join(lines) + "\n")


def tetrahedra(path, n=4):
    """A cube of n^3 cubes, each cut into six tetrahedra around its diagonal."""
    def node(i, j, k):
        return (k * (n + 1) + j) * (n + 1) + i + 1

    vertices = [(i / n, j / n, k / n) for k in range(n + 1) for j in range(n + 1) for i in range(n + 1)]
    cells = []
    for k in range(n):
        for j in range(n):
            for i in range(n):
                for a, b in ((0, 1), (1, 0), (1, 2), (2, 1), (0, 2), (2, 0)):
                    place, way = [i, j, k], [node(i, j, k)]
                    for axis in (a, b, 3 - a - b):
                        place[axis] += 1
                        way.append(node(*place))
                    # Odd permutations of the axes turn the tetrahedron inside out.
                    cells.append(way if (b - a) % 3 == 1 else [way[0], way[2], way[1], way[3]])
    path.write_text("MeshVersionFormatted 2\nDimension 3\nVertices\n%d\n" % len(vertices) + "".join("%.17g %.17g %.17g 0\n" % v for v in vertices) +
                    "Tetrahedra\n%d\n" % len(cells) + "".join("%d %d %d %d 0\n" % tuple(c) for c in cells) + "End\n")


def main():
    amhex = pathlib.Path(sys.argv[1]).resolve()
    wanted = sys.argv[2:] or list(PICTURES)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)

        def run(*words):
            subprocess.run([amhex, *words], cwd=folder, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

        run("demo", "-o", "scan.drc")
        run("demo", "--shape", "sphere", "--surface", "--resolution", "32", "-o", "sphere.ply")
        run("demo", "--shape", "cube", "--surface", "--resolution", "16", "-o", "cube.ply")
        hexagon(folder / "hexagon.obj")
        tetrahedra(folder / "tetrahedra.mesh")
        for picture in wanted:
            source, flags, cut = PICTURES[picture]
            where = ["--cut", cut] if cut else []
            run("mesh", source, *flags.split(), "-q", "-o", "mesh.vtu", "--json", "mesh.json", "--picture", IMAGES / f"{picture}.png", "--size",
                SIZES.get(picture, SIZE), *where)
            s = json.loads((folder / "mesh.json").read_text())["statistics"]
            print(f"{picture}: {int(s['cell_count']):,} cells, {100 * s['hexahedra_ratio']:.1f} % hexahedra, least scaled Jacobian "
                  f"{s['min_scaled_jacobian']:.3f}, mean distance {100 * s['input_to_mesh_mean']:.3f} %", flush=True)


if __name__ == "__main__":
    main()

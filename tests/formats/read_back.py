#!/usr/bin/env python3
"""Reads the files that amhex writes with other people's software, and compares what it found.

    tests/formats/read_back.py AMHEX MESH FOLDER READER      READER: gmsh, meshio, vtk or draco

MESH is a .vtu file that amhex wrote, with hexprisms and slices. Exit status 77 where the reader is not installed.
"""
import collections
import pathlib
import re
import shutil
import subprocess
import sys

SKIPPED = 77
GMSH_NAMES = {4: "tetra", 5: "hexahedron", 6: "wedge", 7: "pyramid"}
failures = 0


def check(name, condition, *detail):
    global failures
    print("passed:" if condition else "FAILED:", name, *(() if condition else detail))
    failures += not condition


def skip(reason):
    print("skipped:", reason)
    sys.exit(SKIPPED)


def run(*command):
    return subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True).stdout


class Meshes:
    """The mesh in every format, as it is and divided, and its figures as amhex's Medit file has them."""

    def __init__(self, amhex, mesh, folder):
        self.folder = folder
        for name in ("whole.vtk", "whole.mesh", "hull.ply", "hull.obj", "hull.stl", "hull.off", "hull.drc"):
            run(amhex, "convert", mesh, "-o", folder / name)
        shutil.copy(mesh, folder / "whole.vtu")
        for name in ("ready.vtu", "ready.vtk", "ready.mesh", "ready.msh", "ready.inp"):
            run(amhex, "convert", mesh, "-o", folder / name, "--solver-ready")
        self.whole = self.from_medit("whole.mesh")
        self.ready = self.from_medit("ready.mesh")
        hull = [line.split()[1:] for line in (folder / "hull.obj").read_text().splitlines() if line[:2] == "f "]
        self.hull_faces = len(hull)
        self.hull_triangles = sum(len(face) - 2 for face in hull)

    def from_medit(self, name):
        """Points, and counts by the number of distinct vertices of each listed hexahedron."""
        words = iter((self.folder / name).read_text().split())
        while next(words) != "Vertices":
            pass
        points = [[float(next(words)) for _ in range(4)][:3] for _ in range(int(next(words)))]
        assert next(words) == "Hexahedra"
        cells = [[int(next(words)) - 1 for _ in range(9)] for _ in range(int(next(words)))]
        names = {0: "tetra", 3: "pyramid", 4: "slice", 5: "wedge", 6: "hexprism", 7: "hexahedron"}
        return points, collections.Counter(names[cell[8]] for cell in cells)


def hexahedra_for(counts):
    """As VTK sees them: what has no word of its own is a hexahedron."""
    seen = collections.Counter(counts)
    seen["hexahedron"] += seen.pop("hexprism", 0) + seen.pop("slice", 0)
    return +seen


def box_of(points):
    return [(min(p[axis] for p in points), max(p[axis] for p in points)) for axis in range(3)]


def near(a, b, tolerance):
    return abs(a - b) <= tolerance


def test_gmsh(meshes):
    if shutil.which("gmsh") is None:
        skip("gmsh is not installed")
    points, counts = meshes.ready
    back = meshes.folder / "gmsh_back.msh"
    log = run("gmsh", meshes.folder / "ready.msh", "-save", "-save_all", "-format", "msh22", "-o", back)
    check("Gmsh reads .msh without complaint", "Error" not in log and "Warning" not in log, log)
    text = back.read_text()
    elements = text[text.index("$Elements"):].split("\n")[2:]
    found = collections.Counter()
    for line in elements:
        words = line.split()
        if len(words) > 2 and int(words[1]) in GMSH_NAMES:
            found[GMSH_NAMES[int(words[1])]] += 1
    check("and gives back every cell of its type", found == counts, found, counts)
    nodes = text[text.index("$Nodes"):text.index("$EndNodes")].split("\n")[2:-1]
    check("and every vertex", len(nodes) == len(points), len(nodes), len(points))
    check("and knows the physical group", '"solid"' in text)
    # Gmsh's own measure of all elements: signed volumes.
    script = meshes.folder / "volumes.geo"
    script.write_text(f'Merge "{meshes.folder}/ready.msh";\nPlugin(AnalyseMeshQuality).JacobianDeterminant = 1;\n'
                      "Plugin(AnalyseMeshQuality).CreateView = 0;\nPlugin(AnalyseMeshQuality).Run;\n")
    log = run("gmsh", "-v", "5", script, "-")
    least = re.search(r"minJ\s+=\s+([-+.\deE]+),", log)
    check("and finds none turned inside out", least is not None and float(least.group(1)) > 0, log[-1500:])
    log = run("gmsh", meshes.folder / "hull.stl", "-save", "-save_all", "-format", "msh22", "-o", back)
    check("Gmsh reads hull.stl", "Error" not in log and "$Elements" in back.read_text(), log)


def meshio_counts(mesh):
    counts = collections.Counter()
    for block in mesh.cells:
        counts[block.type] += len(block.data)
    return counts


def test_meshio(meshes):
    try:
        import meshio
    except ImportError:
        skip("meshio is not installed")
    for name, (points, counts) in (("whole.vtu", meshes.whole), ("whole.vtk", meshes.whole), ("ready.vtu", meshes.ready),
                                   ("ready.vtk", meshes.ready), ("ready.msh", meshes.ready)):
        mesh = meshio.read(meshes.folder / name)
        check(f"{name}: every cell", meshio_counts(mesh) == hexahedra_for(counts), meshio_counts(mesh), counts)
        check(f"{name}: every vertex, every bit", mesh.points.tolist() == points)
        if name.startswith("whole"):
            quality = mesh.cell_data["scaled_jacobian"]
            check(f"{name}: scaled Jacobians", sum(len(block) for block in quality) == sum(counts.values()))
    points, counts = meshes.ready
    deck = meshio.read(meshes.folder / "ready.inp")
    bricks = counts["hexahedron"] + counts["pyramid"]
    wanted = +collections.Counter(hexahedron=bricks, wedge=counts["wedge"], tetra=counts["tetra"])
    check("ready.inp: every cell", meshio_counts(deck) == wanted, meshio_counts(deck), wanted)
    error = abs(deck.points - points).max()
    check("ready.inp: vertices to 12 digits", error < 1e-12 * max(abs(v) for p in points for v in p), error)
    check("ready.inp: the set NHULL", "NHULL" in deck.point_sets)
    medit = meshio.read(meshes.folder / "whole.mesh")
    check("whole.mesh: a hexahedron per cell", meshio_counts(medit) == {"hexahedron": sum(meshes.whole[1].values())})
    for name in ("hull.ply", "hull.obj"):
        found = meshio_counts(meshio.read(meshes.folder / name))
        check(f"{name}: every face", found["quad"] + found["triangle"] == meshes.hull_faces, found, meshes.hull_faces)
    for name in ("hull.stl", "hull.off"):
        found = meshio_counts(meshio.read(meshes.folder / name))
        check(f"{name}: every triangle", found == {"triangle": meshes.hull_triangles}, found, meshes.hull_triangles)


def test_vtk(meshes):
    try:
        import vtk
    except ImportError:
        skip("VTK's Python module is not installed")
    types = {vtk.VTK_TETRA: "tetra", vtk.VTK_HEXAHEDRON: "hexahedron", vtk.VTK_WEDGE: "wedge", vtk.VTK_PYRAMID: "pyramid"}
    volumes = {}
    for name, (points, counts) in (("whole.vtu", meshes.whole), ("whole.vtk", meshes.whole),
                                   ("ready.vtu", meshes.ready), ("ready.vtk", meshes.ready)):
        reader = vtk.vtkXMLUnstructuredGridReader() if name.endswith("vtu") else vtk.vtkUnstructuredGridReader()
        reader.SetFileName(str(meshes.folder / name))
        if name.endswith("vtk"):
            reader.ReadAllScalarsOn()
            reader.ReadAllFieldsOn()
        reader.Update()
        grid = reader.GetOutput()
        found = collections.Counter(types[grid.GetCellType(i)] for i in range(grid.GetNumberOfCells()))
        check(f"{name}: every cell", found == hexahedra_for(counts), found, counts)
        check(f"{name}: every vertex", [list(grid.GetPoint(i)) for i in range(grid.GetNumberOfPoints())] == points)
        sizes = vtk.vtkCellSizeFilter()
        sizes.SetInputData(grid)
        sizes.Update()
        array = sizes.GetOutput().GetCellData().GetArray("Volume")
        cells = [array.GetValue(i) for i in range(grid.GetNumberOfCells())]
        check(f"{name}: every volume is positive", min(cells) > 0, min(cells))
        volumes[name] = sum(cells)
        check(f"{name}: cell data", grid.GetCellData().HasArray("scaled_jacobian") and grid.GetCellData().HasArray("cell_type"))
        wanted = grid.GetFieldData().GetArray("statistics.volume").GetValue(0)
        check(f"{name}: the volume in its field data", near(volumes[name], wanted, 5e-3 * wanted), volumes[name], wanted)


def test_draco(meshes):
    if shutil.which("draco_decoder") is None:
        skip("draco_decoder is not installed")
    back = meshes.folder / "draco_back.obj"
    run("draco_decoder", "-i", meshes.folder / "hull.drc", "-o", back)
    lines = back.read_text().splitlines()
    check("hull.drc: every triangle", sum(line[:2] == "f " for line in lines) == meshes.hull_triangles)
    points = [tuple(map(float, line.split()[1:])) for line in lines if line[:2] == "v "]
    ours, theirs = box_of(meshes.whole[0]), box_of(points)
    size = max(high - low for low, high in ours)
    check("hull.drc: the same box", all(near(a, b, 1e-3 * size) for pair in zip(ours, theirs) for a, b in zip(*pair)))


def main():
    amhex, mesh, folder, reader = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]), sys.argv[4]
    folder.mkdir(parents=True, exist_ok=True)
    meshes = Meshes(amhex, mesh, folder.resolve())
    check("the mesh has what needs dividing", meshes.whole[1]["hexprism"] > 0 and meshes.whole[1]["slice"] > 0, meshes.whole[1])
    {"gmsh": test_gmsh, "meshio": test_meshio, "vtk": test_vtk, "draco": test_draco}[reader](meshes)
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()

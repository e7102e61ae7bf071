#!/usr/bin/env python3
"""A mesh of amhex's in OpenFOAM: checkMesh, then Laplace's equation with laplacianFoam.

    tests/solvers/openfoam.py AMHEX MESH FOLDER

Exit status 77 where OpenFOAM is not installed.
"""
import pathlib
import re
import shutil
import subprocess
import sys

SKIPPED = 77
ENVIRONMENT = "/usr/share/openfoam/etc/bashrc"
# Of the field's range. With gradients by least squares and their correction, linear fields are exact on any mesh, whatever
# its angles and however its faces bend, but for what is left when the corrections end: each leaves a part of the one before.
LINEAR_TOLERANCE = 1e-7
CORRECTIONS = 400
# Scaled Jacobians, which the engine raises, say nothing of a face that is askew to the way to its cell's centre: short cells
# of wedges may have one that checkMesh counts (above 4), though solutions are no worse for it.
MOST_SKEW_FACES = 4
# Quadratic fields are exact at no mesh: what is left is the square of an edge length over that of the body.
KNOWN_TOLERANCE = 0.01
failures = 0


def check(name, condition, *detail):
    global failures
    print("passed:" if condition else "FAILED:", name, *detail)
    failures += not condition


def foam(case, command):
    return subprocess.run(["bash", "-c", f". {ENVIRONMENT} >/dev/null 2>&1; {command} -case {case}"],
                          capture_output=True, text=True, timeout=300).stdout


def dictionary(case, path, kind, text):
    file = case / path
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"FoamFile {{ version 2.0; format ascii; class {kind}; object {file.name}; }}\n{text}\n")


def write_case(case):
    dictionary(case, "system/controlDict", "dictionary", "application laplacianFoam; startFrom startTime; startTime 0; "
               "stopAt endTime; endTime 1; deltaT 1; writeControl timeStep; writeInterval 1; writePrecision 12;")
    dictionary(case, "system/fvSchemes", "dictionary", "ddtSchemes { default steadyState; }\n"
               "gradSchemes { default leastSquares; }\ndivSchemes { default none; }\n"
               "laplacianSchemes { default Gauss linear corrected; }\ninterpolationSchemes { default linear; }\n"
               "snGradSchemes { default corrected; }")
    dictionary(case, "system/fvSolution", "dictionary", "solvers { T { solver PCG; preconditioner DIC; tolerance 1e-12; relTol 0; } }\n"
               "SIMPLE { nNonOrthogonalCorrectors %d; }" % CORRECTIONS)
    dictionary(case, "constant/transportProperties", "dictionary", "DT DT [0 2 -1 0 0 0 0] 1;")


def entries(path):
    """The lines of an OpenFOAM list."""
    text = path.read_text()
    return re.search(r"\n(\d+)\n\(\n(.*?)\n\)", text, re.S).group(2).split("\n")


def cross(u, v):
    return [u[(a + 1) % 3] * v[(a + 2) % 3] - u[(a + 2) % 3] * v[(a + 1) % 3] for a in range(3)]


def dot(u, v):
    return sum(a * b for a, b in zip(u, v))


def centre_and_normal(points, corners):
    """As OpenFOAM has them: triangles around the mean, weighted by their area; the sum of their area vectors."""
    mean = [sum(points[c][a] for c in corners) / len(corners) for a in range(3)]
    total, weighted, normal = 0.0, [0.0] * 3, [0.0] * 3
    for i, corner in enumerate(corners):
        p, q = points[corner], points[corners[(i + 1) % len(corners)]]
        twice = cross([p[a] - mean[a] for a in range(3)], [q[a] - mean[a] for a in range(3)])
        area = dot(twice, twice) ** 0.5
        total += area
        weighted = [w + area * (p[a] + q[a] + mean[a]) / 3 for a, w in enumerate(weighted)]
        normal = [n + t for n, t in zip(normal, twice)]
    length = dot(normal, normal) ** 0.5
    return [w / total for w in weighted], [n / length for n in normal]


def cell_centres(case, time):
    (case / time).mkdir(exist_ok=True)
    foam(case, f"postProcess -func writeCellCentres -time {time}")
    return [tuple(map(float, line.strip("()").split())) for line in entries(case / time / "C")]


def places_on_hull(case):
    """Where OpenFOAM takes the value of each face on the hull to be: not at the face's centre, but where the perpendicular
    from the centre of the cell behind meets the face. It leaves out the correction for the way between the two (with the
    values of face centres here, the error is 0.6 % of a linear field's range)."""
    mesh = case / "constant/polyMesh"
    points = [tuple(map(float, line.strip("()").split())) for line in entries(mesh / "points")]
    faces = [[int(word) for word in line[line.index("(") + 1:-1].split()] for line in entries(mesh / "faces")]
    owners = [int(word) for word in entries(mesh / "owner")]
    start = int(re.search(r"startFace (\d+)", (mesh / "boundary").read_text()).group(1))
    cells = cell_centres(case, "0")
    places = []
    for face, owner in zip(faces[start:], owners[start:]):
        centre, normal = centre_and_normal(points, face)
        distance = dot(normal, [c - p for c, p in zip(centre, cells[owner])])
        places.append([p + distance * n for p, n in zip(cells[owner], normal)])
    return places


def solve(case, field):
    """Laplace with `field` on the hull; (centres, values) of the cells."""
    values = [field(*place) for place in places_on_hull(case)]
    listed = "\n".join(f"{value:.15g}" for value in values)
    dictionary(case, "0/T", "volScalarField", "dimensions [0 0 0 1 0 0 0]; internalField uniform 0;\n"
               f"boundaryField {{ hull {{ type fixedValue; value nonuniform List<scalar> {len(values)}\n(\n{listed}\n);\n}} }}")
    shutil.rmtree(case / "1", ignore_errors=True)
    log = foam(case, "laplacianFoam")
    if not (case / "1/T").exists():
        sys.exit(f"laplacianFoam failed:\n{log[-3000:]}")
    return cell_centres(case, "1"), [float(line) for line in entries(case / "1/T")]


def compare(case, name, field, tolerance):
    centres, values = solve(case, field)
    wanted = [field(*centre) for centre in centres]
    spread = max(wanted) - min(wanted)
    worst = max(abs(a - b) for a, b in zip(values, wanted))
    check(f"{name}: {len(values)} cells", worst < tolerance * spread, f"largest error {worst / spread:.2e} of the range")


def main():
    amhex, mesh, folder = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    if not pathlib.Path(ENVIRONMENT).exists():
        print("skipped: OpenFOAM is not installed")
        sys.exit(SKIPPED)
    case = folder.resolve()
    shutil.rmtree(case, ignore_errors=True)
    write_case(case)
    subprocess.run([amhex, "convert", mesh, "-o", case / "constant/polyMesh", "--solver-ready"], check=True)
    log = foam(case, "checkMesh")
    skewed = [int(count) for count in re.findall(r"(\d+) highly skew faces", log)]
    others = [line for line in re.findall(r"\*\*\*.*", log) if "skewness" not in line]
    check("checkMesh finds nothing wrong but skew faces, if any, few of them",
          ("Mesh OK." in log or skewed) and not others and sum(skewed) <= MOST_SKEW_FACES,
          *re.findall(r".*(?:\*\*\*|Max skewness|non-orthogonality Max).*", log))
    check("checkMesh knows all cells", re.search(r"polyhedra: +0\b", log) is not None, log[-2000:] if "polyhedra:" not in log else "")
    compare(case, "Laplace, linear field", lambda x, y, z: 3 * x - 2 * y + z, LINEAR_TOLERANCE)
    compare(case, "Laplace, known solution", lambda x, y, z: x * x + y * y - 2 * z * z, KNOWN_TOLERANCE)
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()

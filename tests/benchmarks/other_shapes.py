#!/usr/bin/env python3
"""Writes shapes that no parameter was chosen on, to be meshed and measured like the models.

    tests/benchmarks/other_shapes.py FOLDER
    tests/benchmarks/results_table.py --output other.md FOLDER/tetrahedron.obj:1500 ...

Solids with few large faces, acute edges, thin parts, and smooth ones of one formula. Closed,
outward oriented triangles as .obj. Standard library only; takes some two minutes.
"""

import itertools
import math
import pathlib
import random
import sys

GOLDEN = (1 + math.sqrt(5)) / 2

TETRAHEDRON = ([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)])
OCTAHEDRON = (
    [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)],
    [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)],
)
PYRAMID = (
    [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, 1.5)],
    [(0, 2, 1), (0, 3, 2), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
)


def icosahedron():
    vertices = [
        tuple(v[(i - turn) % 3] for i in range(3))
        for turn in range(3)
        for v in ((0, a, b * GOLDEN) for a in (-1, 1) for b in (-1, 1))
    ]
    near = lambda a, b: math.dist(vertices[a], vertices[b]) < 2.1
    triangles = []
    for a, b, c in itertools.combinations(range(12), 3):
        if not (near(a, b) and near(b, c) and near(a, c)):
            continue
        outward = dot(cross(minus(vertices[b], vertices[a]), minus(vertices[c], vertices[a])), vertices[a]) > 0
        triangles.append((a, b, c) if outward else (a, c, b))
    return vertices, triangles


def cone(sides=64, height=2.0):
    rim = [(math.cos(2 * math.pi * i / sides), math.sin(2 * math.pi * i / sides), 0.0) for i in range(sides)]
    floor, tip = sides, sides + 1
    triangles = [(i, (i + 1) % sides, tip) for i in range(sides)] + [((i + 1) % sides, i, floor) for i in range(sides)]
    return rim + [(0.0, 0.0, 0.0), (0.0, 0.0, height)], triangles


def sheared(corners, triangles, along_x, along_y):
    """Leans over: a box becomes one whose sides meet at acute and obtuse angles."""
    return [(x + along_x * z, y + along_y * z, z) for x, y, z in corners], triangles


def torus(radius, tube, around=48, across=12):
    ring = lambda n, k: (math.cos(2 * math.pi * k / n), math.sin(2 * math.pi * k / n))
    vertices = []
    for i, j in itertools.product(range(around), range(across)):
        (x, y), (out, up) = ring(around, i), ring(across, j)
        vertices.append(((radius + tube * out) * x, (radius + tube * out) * y, tube * up))
    triangles = []
    for i, j in itertools.product(range(around), range(across)):
        here, there = i * across, (i + 1) % around * across
        a, b, c, d = here + j, there + j, there + (j + 1) % across, here + (j + 1) % across
        triangles += [(a, b, c), (a, c, d)]
    return vertices, triangles


def minus(a, b):
    return tuple(x - y for x, y in zip(a, b))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def cut_ears(outline):
    """Triangles of a simple polygon, counterclockwise."""
    left = list(range(len(outline)))
    turn = lambda a, b, c: (outline[b][0] - outline[a][0]) * (outline[c][1] - outline[a][1]) - (
        outline[b][1] - outline[a][1]
    ) * (outline[c][0] - outline[a][0])

    def is_ear(k):
        a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
        inside = lambda p: min(turn(a, b, p), turn(b, c, p), turn(c, a, p)) > -1e-12
        return turn(a, b, c) > 1e-12 and not any(inside(p) for p in left if p not in (a, b, c))

    triangles = []
    while len(left) > 3:
        k = next(k for k in range(len(left)) if is_ear(k))
        triangles.append((left[k - 1], left[k], left[(k + 1) % len(left)]))
        left.pop(k)
    return triangles + [tuple(left)]


def extruded(outline, height):
    n = len(outline)
    vertices = [(x, y, 0.0) for x, y in outline] + [(x, y, height) for x, y in outline]
    triangles = []
    for a, b, c in cut_ears(outline):
        triangles += [(c, b, a), (a + n, b + n, c + n)]
    for i in range(n):
        j = (i + 1) % n
        triangles += [(i, j, j + n), (i, j + n, i + n)]
    return vertices, triangles


def star(points=5, outer=2.0, inner=0.8):
    radii = [outer, inner] * points
    return [(r * math.cos(math.pi * i / points), r * math.sin(math.pi * i / points)) for i, r in enumerate(radii)]


def gear(teeth=16, outer=2.0, inner=1.6):
    outline = []
    for tooth in range(teeth):
        for part, r in ((-0.4, inner), (-0.2, outer), (0.2, outer), (0.4, inner)):
            angle = 2 * math.pi * (tooth + part) / teeth
            outline.append((r * math.cos(angle), r * math.sin(angle)))
    return outline


def comb(fins=10):
    outline = [(0, 0), (fins, 0), (fins, 1)]
    for fin in reversed(range(fins)):
        outline += [(fin + 0.65, 1), (fin + 0.65, 4), (fin + 0.35, 4), (fin + 0.35, 1)]
    return outline + [(0, 1)]


def trough(length=4.0, height=2.0, wall=0.2):
    """A thin wall bent to a U."""
    inner = [(length - wall, height), (length - wall, wall), (wall, wall), (wall, height)]
    return [(0, height), (0, 0), (length, 0), (length, height)] + inner


def stairs(steps=5):
    outline = [(0, 0), (steps, 0)]
    for step in range(steps):
        outline += [(steps - step, step + 1), (steps - step - 1, step + 1)]
    return outline


def wedge(degrees, length):
    return [(0, 0), (length, 0), (length, length * math.tan(math.radians(degrees)))]


def joined(*meshes):
    vertices, triangles = [], []
    for own_vertices, own_triangles in meshes:
        offset = len(vertices)
        vertices += own_vertices
        triangles += [tuple(i + offset for i in t) for t in own_triangles]
    return vertices, triangles


def moved(mesh, by):
    return [tuple(x + d for x, d in zip(p, by)) for p in mesh[0]], mesh[1]


def flipped(mesh):
    return mesh[0], [(a, c, b) for a, b, c in mesh[1]]


def tilted(mesh, degrees, centre):
    """About the x axis through the centre."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    turn = lambda x, y, z: (x, centre[1] + c * (y - centre[1]) - s * (z - centre[2]), centre[2] + s * (y - centre[1]) + c * (z - centre[2]))
    return [turn(*p) for p in mesh[0]], mesh[1]


def cube(side):
    return extruded([(0, 0), (side, 0), (side, side), (0, side)], side)


def ball(radius, steps=24):
    """A cube's sides, divided and pushed out."""
    vertices, triangles = [], []
    for axis, sign in itertools.product(range(3), (-1, 1)):
        first = len(vertices)
        for i, j in itertools.product(range(steps + 1), repeat=2):
            p = [0.0] * 3
            p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = sign, 2 * i / steps - 1, 2 * j / steps - 1
            vertices.append(tuple(round(radius * x / math.hypot(*p), 12) for x in p))
        for i, j in itertools.product(range(steps), repeat=2):
            a = first + i * (steps + 1) + j
            b, c, d = a + steps + 1, a + steps + 2, a + 1
            triangles += [(a, b, c), (a, c, d)] if sign > 0 else [(a, c, b), (a, d, c)]
    return vertices, triangles


def slot(width, bottom):
    """Halves of 6 with a slot between them; a notch where its bottom is a line."""
    right = 12 + width
    floor = [(6 + width, bottom), (6, bottom)] if bottom > 2 else [(6 + width / 2, bottom)]
    return [(0, 0), (right, 0), (right, 8), (6 + width, 8), *floor, (6, 8), (0, 8)]


def gaps(width):
    """What is that far apart, for edges of 1."""
    yield "apart", joined(cube(8), moved(cube(8), (8 + width, 0.3, 0.4)))
    yield "askew", joined(cube(8), tilted(moved(cube(8), (8 + width, 0, 0)), 30, (0, 4, 4)))
    yield "slot", extruded(slot(width, 3), 8)
    yield "notch", extruded(slot(width, 2), 8)
    yield "balls", joined(ball(4), moved(ball(4), (8 + width, 0, 0)))
    yield "nested", joined(ball(3), ball(6), flipped(ball(3 + width)))


def level_set(value, half, steps):
    """Where value(x, y, z) < 0 in the box [-half, half], by tetrahedra of a grid."""
    at = lambda node: tuple(h * (2 * i / steps - 1) for h, i in zip(half, node))
    values = {node: value(*at(node)) or 1e-9 for node in itertools.product(range(steps + 1), repeat=3)}
    vertices, number, triangles = [], {}, []

    def between(a, b):
        a, b = min(a, b), max(a, b)
        if (a, b) not in number:
            t = min(max(values[a] / (values[a] - values[b]), 0.02), 0.98)
            number[a, b] = len(vertices)
            vertices.append(tuple(p + t * (q - p) for p, q in zip(at(a), at(b))))
        return number[a, b]

    def middle(nodes):
        return tuple(sum(c) / len(nodes) for c in zip(*map(at, nodes)))

    corners = [(b & 1, b >> 1 & 1, b >> 2 & 1) for b in range(8)]
    tetrahedra = [(0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7)]
    for cell in itertools.product(range(steps), repeat=3):
        nodes = [tuple(c + o for c, o in zip(cell, corner)) for corner in corners]
        if len({values[node] < 0 for node in nodes}) == 1:
            continue
        for tetrahedron in tetrahedra:
            inside = [nodes[k] for k in tetrahedron if values[nodes[k]] < 0]
            outside = [nodes[k] for k in tetrahedron if values[nodes[k]] >= 0]
            if not inside or not outside:
                continue
            if len(inside) == 2:
                (a, b), (c, d) = inside, outside
                quad = [between(a, c), between(a, d), between(b, d), between(b, c)]
                found = [quad[:3], [quad[0], quad[2], quad[3]]]
            else:
                found = [[between(a, b) for a in inside for b in outside]]
            outward = minus(middle(outside), middle(inside))
            for a, b, c in found:
                normal = cross(minus(vertices[b], vertices[a]), minus(vertices[c], vertices[a]))
                triangles.append((a, b, c) if dot(normal, outward) > 0 else (a, c, b))
    return vertices, triangles


def knot(radius=0.35):
    curve = []
    for i in range(120):
        t = 2 * math.pi * i / 120
        r = 2 + 0.8 * math.cos(3 * t)
        curve.append((r * math.cos(2 * t), r * math.sin(2 * t), 0.8 * math.sin(3 * t)))
    return lambda *p: min(math.dist(p, q) for q in curve) - radius


def dumbbell(x, y, z):
    balls = min(math.dist((x, y, z), (side, 0, 0)) - 1 for side in (-2, 2))
    return min(balls, max(math.hypot(y, z) - 0.15, abs(x) - 2))


def lens(x, y, z):
    return max(math.dist((x, y, z), (0, 0, side)) - 2.3 for side in (-2, 2))


def blob(x, y, z):
    centres = ((0, 0, 0), (1.2, 0.3, 0), (-0.5, 1.1, 0.4), (0.2, -0.9, 0.9))
    return 1 - sum(1 / (0.01 + math.dist((x, y, z), c) ** 2) for c in centres) / 2.2


def unit(vector):
    return tuple(x / math.hypot(*vector) for x in vector)


def random_part(draw, spread, scale):
    """A ball, box, cylinder or torus, anywhere near the origin and turned any way."""
    direction = lambda: unit([draw.uniform(-1, 1) for _ in range(3)])
    along = direction()
    across = unit(cross(along, direction()))
    axes = (along, across, cross(along, across))
    centre = [draw.uniform(-spread, spread) for _ in range(3)]
    a, b, c = (scale * draw.uniform(0.25, 0.6) for _ in range(3))
    radius, tube = scale * draw.uniform(0.4, 0.6), scale * draw.uniform(0.12, 0.22)
    kinds = (
        lambda x, y, z: math.hypot(x, y, z) - a,
        lambda x, y, z: max(abs(x) - a, abs(y) - b, abs(z) - c),
        lambda x, y, z: max(math.hypot(x, y) - a, abs(z) - b),
        lambda x, y, z: math.hypot(math.hypot(x, y) - radius, z) - tube,
    )
    kind = draw.choice(kinds)
    return lambda *p: kind(*(dot(axis, minus(p, centre)) for axis in axes))


def random_solid(seed):
    """A part, others added and some taken away."""
    draw = random.Random(seed)
    added, taken = [random_part(draw, 0, 1)], []
    for _ in range(draw.randint(1, 3)):
        if draw.random() < 0.4:
            taken.append(random_part(draw, 0.5, 0.7))
        else:
            added.append(random_part(draw, 0.5, 1))
    return lambda *p: max([min(part(*p) for part in added)] + [-part(*p) for part in taken])


def shapes():
    yield "tetrahedron", TETRAHEDRON
    yield "octahedron", OCTAHEDRON
    yield "icosahedron", icosahedron()
    yield "pyramid", PYRAMID
    yield "cone", cone()
    yield "beam", extruded([(0, 0), (50, 0), (50, 1), (0, 1)], 1)
    yield "plate", extruded([(0, 0), (20, 0), (20, 20), (0, 20)], 0.3)
    yield "star", extruded(star(), 1)
    yield "gear", extruded(gear(), 0.8)
    yield "comb", extruded(comb(), 3)
    yield "stairs", extruded(stairs(), 2)
    yield "wedge10", extruded(wedge(10, 6), 3)
    yield "wedge30", extruded(wedge(30, 4), 3)
    yield "octagon", extruded([(math.cos(math.pi * (2 * i + 1) / 8), math.sin(math.pi * (2 * i + 1) / 8)) for i in range(8)], 1)
    yield "oblique", sheared(*extruded([(0, 0), (1.5, 0), (1.5, 1.2), (0, 1.2)], 1.4), 0.9, 0.3)
    yield "spike", cone(sides=32, height=30.0)
    yield "ring", torus(2.0, 0.25)
    yield "trough", extruded(trough(), 3)
    yield "ellipsoid", level_set(lambda x, y, z: (x / 5) ** 2 + (y / 1.5) ** 2 + (z / 0.5) ** 2 - 1, (5.2, 1.7, 0.6), 40)
    yield "knot", level_set(knot(), (3.4, 3.4, 1.4), 44)
    yield "dumbbell", level_set(dumbbell, (3.2, 1.2, 1.2), 50)
    yield "lens", level_set(lens, (1.4, 1.4, 0.5), 44)
    yield "blob", level_set(blob, (2.9, 2.9, 2.9), 46)
    for width in (0.2, 0.4, 0.6):
        for name, mesh in gaps(width):
            yield f"{name}{width}", mesh
    for seed in range(1, 5):
        yield f"solid{seed}", level_set(random_solid(seed), (1.5, 1.5, 1.5), 64)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for name, (vertices, triangles) in shapes():
        lines = ["v %.17g %.17g %.17g" % tuple(v) for v in vertices]
        lines += ["f %d %d %d" % tuple(i + 1 for i in t) for t in triangles]
        (folder / (name + ".obj")).write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()

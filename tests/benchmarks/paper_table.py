"""Table 1 of the paper on at-most-hexa meshes, as far as results_table.py has the models."""

# Table 1 of the paper, rows "Ours": cells, hexahedra by number and by volume in percent, least and
# average scaled Jacobian, seconds. The paper's machine is its own; its cylinder is the native run.
PAPER = {
    "bunny": [(3201, 71.4, 84.9, 0.258, 0.935, 153), (49243, 76.7, 88.2, 0.252, 0.939, 1639)],
    "cylinder": [(1671, 85.8, 93.1, 0.298, 0.964, 16)],
    "fandisk": [(9523, 89.5, 95.3, 0.303, 0.973, 780)],
    "hand": [(47132, 81.5, 90.8, 0.253, 0.950, 521)],
    "holeblock": [(7491, 87.8, 93.9, 0.250, 0.970, 175)],
    "igea": [(27015, 76.8, 88.2, 0.251, 0.941, 1228)],
    "jumpramp": [(1460, 97.3, 98.7, 0.776, 0.994, 9)],
    "rod": [(7409, 87.2, 94.1, 0.355, 0.968, 541)],
    "sculpt": [(5247, 77.1, 89.1, 0.251, 0.934, 667)],
    "trefoil": [(8526, 65.0, 81.1, 0.252, 0.917, 362)],
    "twistcube": [
        (1301, 88.9, 95.6, 0.488, 0.978, 7),
        (5695, 96.2, 98.5, 0.571, 0.992, 16),
        (15841, 96.2, 98.4, 0.316, 0.990, 76),
    ],
    "twistcube_tet": [(2836, 21.4, 41.3, 0.125, 0.801, "–")],
}

# The other rows of Table 1 for models that stand above: cells, hexahedra by number and by volume in
# percent, least and average scaled Jacobian, seconds; None where the paper has no figure. Those
# marked * there make hexahedra only.
OTHERS = {
    "bunny": [
        ("SRUL16", None, 60.57, 88.61, None, 0.950, 469),
        ("RSR*18", None, None, 92.2, None, None, None),
        ("GJTP17", 2135, 66.16, 65.17, 0.285, 0.953, None),
        ("Tak19, hexahedra only", 2832, None, None, -0.771, 0.749, None),
        ("GSP19, hexahedra only", 29698, None, None, 0.292, 0.790, None),
        ("LPP*20, hexahedra only", 2172, None, None, 0.451, 0.911, 112),
    ],
    "cylinder": [
        ("SRUL16", None, 64.66, 90.85, None, 0.960, 327),
        ("RSR*18", None, None, 99.3, None, None, None),
    ],
    "fandisk": [
        ("SRUL16", None, 51.36, 77.82, None, 0.969, 10),
        ("GJTP17", 7069, 88.36, 87.74, 0.668, 0.986, None),
        ("Tak19, hexahedra only", 1774, None, None, 0.217, 0.905, None),
    ],
    "igea": [("GJTP17", 12936, 81.0, 81.0, -0.23, 0.970, None)],
    "rod": [
        ("GSP19, hexahedra only", 26918, None, None, 0.155, 0.828, 1536),
        ("Tak19, hexahedra only", 600, None, None, 0.221, 0.763, None),
    ],
    "sculpt": [
        ("GSP19, hexahedra only", 15202, None, None, 0.104, 0.759, 826),
        ("LPP*20, hexahedra only", 168, None, None, 0.806, 0.918, 18),
    ],
}

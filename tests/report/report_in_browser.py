#!/usr/bin/env python3
"""Opens report pages in a headless Chromium, works their controls, and looks at what is drawn.

    tests/report/report_in_browser.py AMHEX MESH FOLDER

MESH is a .vtu file that amhex wrote. Pages and screenshots stay in FOLDER. Exit status 77 where there is no
Chromium or no WebGL in it.
"""
import json
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import zlib

SKIPPED = 77
# Software rendering; the page has no network to use, and the profile is thrown away.
FLAGS = ["--headless", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
         "--enable-unsafe-swiftshader", "--window-size=1280,900", "--virtual-time-budget=60000",
         "--host-resolver-rules=MAP * ~NOTFOUND"]
# Without a window there are no frames to animate: what is to be drawn is drawn next. What is asked of the device is counted.
FRAMES = """
<script>
window.requestAnimationFrame = callback => setTimeout(() => callback(performance.now()), 0);
const asked = {calls: 0, triangles: 0, bytes: 0}, device = WebGLRenderingContext.prototype;
const count = (name, note) => {
  const original = device[name];
  device[name] = function (...values) { note(...values); return original.apply(this, values); };
};
count("drawElements", (mode, indices) => { ++asked.calls; asked.triangles += indices / 3; });
count("drawArrays", (mode, first, vertices) => { ++asked.calls; asked.triangles += vertices / 3; });
count("bufferData", (target, data) => { asked.bytes += data.byteLength; });
count("bufferSubData", (target, offset, data) => { asked.bytes += data.byteLength; });
</script>
"""
# Gives the page's viewer a name for the driver.
VIEWER_MADE, VIEWER_NAMED = "const viewer = new MeshViewer", "const viewer = window.shownViewer = new MeshViewer"
# Works every control as a user would, through events on the elements, and notes the outcome.
DRIVER = """
<script>
(async () => {
  const until = async condition => { while (!condition()) await new Promise(done => setTimeout(done, 20)); };
  await until(() => document.body.dataset.ready);
  const log = [], element = id => document.getElementById(id);
  const note = name => {
    const data = document.body.dataset;
    log.push({name, ready: data.ready, shown: Number(data.shown), triangles: Number(data.triangles),
      failure: element("failure").textContent});
  };
  // The mean colour of what is drawn, once it is.
  const meanColour = async () => {
    await new Promise(done => setTimeout(done, 50));
    const source = element("canvas"), copy = document.createElement("canvas");
    [copy.width, copy.height] = [source.width, source.height];
    const context = copy.getContext("2d");
    context.drawImage(source, 0, 0);
    const pixels = context.getImageData(0, 0, copy.width, copy.height).data, sums = [0, 0, 0];
    for (let i = 0; i < pixels.length; ++i) if (i % 4 < 3) sums[i % 4] += pixels[i];
    return sums.map(sum => (sum / (pixels.length / 4)).toFixed(2)).join(" ");
  };
  const set = (id, value) => {
    const target = element(id);
    if (target.type === "checkbox") target.checked = value; else target.value = value;
    target.dispatchEvent(new Event("input", {bubbles: true}));
  };
  note("start");
  if (document.body.dataset.ready === "yes") {
    set("cut-axis", "none"); note("whole");
    for (const axis of ["0", "1", "2", "view"]) { set("cut-axis", axis); note("cut " + axis); }
    set("cut-axis", "0"); set("cut-place", 0.25); note("cut 0 at 0.25");
    set("cut-flip", true); note("cut 0 at 0.25 flipped"); set("cut-flip", false);
    element("all-cells").click(); note("all cells");
    set("peel", 1); note("one layer peeled"); set("peel", 0);
    element("only-other").click(); note("not hexahedra");
    element("all-cells").click(); element("only-worst").click(); note("worst");
    element("all-cells").click(); set("type-hexahedron", false); note("without hexahedra"); set("type-hexahedron", true);
    for (const colour of ["type", "quality", "layer", "distance"]) {
      set("colour", colour);
      note("coloured by " + colour);
      note(`mean colour ${colour} ` + await meanColour());
    }
    note("scale " + element("scale").textContent);
    const viewer = window.shownViewer, {mesh, shown} = viewer;
    // By definition: the triangles between a shown cell and all that is not shown, each by its cell.
    const expectedOwners = view => {
      const normal = viewer.cutNormal(view), place = normal ? viewer.cutPlace(view) : 0, owners = [], face = new Int32Array(4);
      const isShown = cell => {
        if (!view.types[mesh.types[cell]] || mesh.layers[cell] < view.peel || mesh.quality[cell] > view.worst) return false;
        if (!normal) return true;
        const [x, y, z] = mesh.centres.subarray(3 * cell, 3 * cell + 3);
        const offset = Math.fround(x * normal[0] + y * normal[1] + z * normal[2]);
        return view.cutFlip ? offset >= place : offset <= place;
      };
      const keep = Uint8Array.from({length: mesh.cellCount}, (_, cell) => isShown(cell));
      for (let side = 0; side < 6 * mesh.cellCount; ++side) {
        const cell = Math.floor(side / 6), other = mesh.neighbours[side];
        if (!keep[cell] || other === -2 || (other >= 0 && keep[other])) continue;
        for (let k = faceVertices(mesh.corners, cell, side % 6, face); k > 2; --k) owners.push(cell);
      }
      return [owners.sort((a, b) => a - b).join(), keep.reduce((a, b) => a + b, 0)];
    };
    const drawnOwners = () => [...shown.outer.owners.subarray(shown.range.start / 3, (shown.range.start + shown.range.count) / 3),
      ...shown.bare.owners.subarray(0, shown.bare.indexCount / 3)].sort((a, b) => a - b).join();
    const isSmall = mesh.cellCount < 20000, axes = isSmall ? ["none", "0", "1", "2", "view"] : ["1"], places = isSmall ? [0, 0.31, 0.5, 0.87, 1] : [0.31];
    let compared = 0, different = 0;
    for (const axis of axes) for (const hexahedra of [true, false]) for (const [peel, worst] of [[0, 1], [1, 1], [0, 0.95], [1, 0.9]]) {
      for (const flip of [false, true]) for (const place of axis === "none" ? [0.5] : places) {
        const values = {"cut-axis": axis, "type-hexahedron": hexahedra, peel, worst, "cut-flip": flip, "cut-place": place};
        for (const [id, value] of Object.entries(values)) {
          if (typeof value === "boolean") element(id).checked = value; else element(id).value = value;
        }
        set("cut-place", place);
        const [owners, count] = expectedOwners(readView());
        ++compared;
        different += owners !== drawnOwners() || count !== Number(document.body.dataset.shown) ? 1 : 0;
      }
    }
    note(`views compared ${compared} different ${different}`);
    set("type-hexahedron", true); set("cut-flip", false); set("peel", 0); set("worst", 1); set("cut-axis", "0"); set("cut-place", 0.4);
    const ask = step => { Object.assign(asked, {calls: 0, triangles: 0, bytes: 0}); step(); viewer.draw(); };
    viewer.draw();
    await until(() => viewer.coarseness === 1);
    const fullWidth = element("canvas").width;
    ask(() => { viewer.move(); viewer.camera.position.applyAxisAngle(new THREE.Vector3(0, 0, 1), 0.3); viewer.camera.lookAt(0, 0, 0); });
    note(`turning ${JSON.stringify({...asked, shown: viewer.triangleCount})}`);
    ask(() => set("cut-place", 0.6));
    const cutBytes = 20 * shown.bare.vertexCount + 4 * shown.bare.indexCount;
    note(`cutting ${JSON.stringify({...asked, shown: viewer.triangleCount, cutBytes, outerBytes: 20 * shown.outer.vertexCount})}`);
    const movingWidth = element("canvas").width;
    await until(() => viewer.coarseness === 1);
    note(`widths ${JSON.stringify({fullWidth, movingWidth, stillWidth: element("canvas").width})}`);
    element("all-cells").click();
    set("ghost", true); set("edges", false); note("glass without edges");
    const frame = element("canvas").getBoundingClientRect();
    // Somewhere on a grid of points there is the mesh, whatever its shape.
    for (let i = 1; i < 50 && element("picked").hidden; ++i) {
      element("canvas").dispatchEvent(new MouseEvent("click", {bubbles: true,
        clientX: frame.left + frame.width * (i % 7 + 0.5) / 7, clientY: frame.top + frame.height * Math.floor(i / 7) / 7}));
    }
    note("picked " + element("picked").textContent.split(",")[0]);
    note("charts " + document.querySelectorAll("#charts .chart").length);
    note("hexahedra " + document.querySelector("#types .count").textContent);
  }
  const result = document.createElement("pre");
  result.id = "driver-result";
  result.textContent = JSON.stringify(log);
  document.body.appendChild(result);
})();
</script>
"""


def check(name, condition, detail=""):
    print(("passed: " if condition else "FAILED: ") + name, detail if not condition else "")
    if not condition:
        check.failures += 1


check.failures = 0


def chromium(*arguments):
    return subprocess.run([shutil.which("chromium"), *FLAGS, *arguments], capture_output=True, text=True, timeout=300)


def read_png(path):
    """Width, height and rows of RGB triples; 8-bit RGB or RGBA without interlacing, which is what Chromium writes."""
    data, at, pixels = path.read_bytes(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, _, colour_type = struct.unpack(">IIBB", body[:10])
        elif kind == b"IDAT":
            pixels += body
        at += 12 + length
    step = {2: 3, 6: 4}[colour_type]
    raw, rows, above = zlib.decompress(pixels), [], bytearray(width * step)
    for y in range(height):
        kind, line = raw[y * (width * step + 1)], bytearray(raw[y * (width * step + 1) + 1:(y + 1) * (width * step + 1)])
        for i in range(len(line)):
            left = line[i - step] if i >= step else 0
            up, corner = above[i], above[i - step] if i >= step else 0
            guess = left + up - corner
            paeth = min((left, up, corner), key=lambda value: abs(guess - value))
            line[i] = (line[i] + (0, left, up, (left + up) // 2, paeth)[kind]) & 255
        rows.append([tuple(line[i:i + 3]) for i in range(0, len(line), step)])
        above = line
    return width, height, rows


def coloured_share(path):
    """The share of pixels in the viewer's part of a screenshot that are neither white nor grey."""
    width, height, rows = read_png(path)
    inside = [pixel for row in rows[int(height * 0.12):int(height * 0.8)] for pixel in row[int(width * 0.05):int(width * 0.7)]]
    return sum(max(pixel) - min(pixel) > 30 for pixel in inside) / len(inside)


def drive(page, folder):
    """Runs DRIVER in the page; its notes by name."""
    driven = folder / f"{page.stem}_driven.html"
    text = page.read_text()
    check("the page makes its viewer where it did", text.count(VIEWER_MADE) == 1)
    driven.write_text(text.replace("<head>", "<head>" + FRAMES).replace(VIEWER_MADE, VIEWER_NAMED).replace("</body>", DRIVER + "</body>"))
    answer = chromium("--dump-dom", driven.as_uri())
    found = re.search(r'<pre id="driver-result">(.*?)</pre>', answer.stdout, re.S)
    if not found:
        sys.exit(f"the page did not get ready\n{answer.stderr[-2000:]}")
    return {note["name"]: note for note in json.loads(found.group(1).replace("&amp;", "&").replace("&lt;", "<"))}


def block(path, n):
    """A Medit file of n^3 cubes."""
    with path.open("w") as out:
        out.write(f"MeshVersionFormatted 2\nDimension 3\nVertices\n{(n + 1) ** 3}\n")
        out.writelines(f"{i} {j} {k} 0\n" for k in range(n + 1) for j in range(n + 1) for i in range(n + 1))
        out.write(f"Hexahedra\n{n ** 3}\n")
        row, layer = n + 1, (n + 1) ** 2
        for k in range(n):
            for j in range(n):
                for i in range(n):
                    a = k * layer + j * row + i + 1
                    ring = (a, a + 1, a + row + 1, a + row)
                    out.write(" ".join(map(str, ring + tuple(v + layer for v in ring))) + " 8\n")
        out.write("End\n")


def test_controls(notes, cells):
    whole, count = notes["whole"]["shown"], lambda name: notes[name]["shown"]
    check("the page gets ready", notes["start"]["ready"] == "yes", notes["start"])
    check("without a cut all cells are shown", whole == cells, whole)
    for axis in ("0", "1", "2", "view"):
        check(f"cut {axis} leaves a part", 0 < count(f"cut {axis}") < cells, count(f"cut {axis}"))
    check("both sides of a cut make the whole", count("cut 0 at 0.25") + count("cut 0 at 0.25 flipped") == cells)
    check("'all' shows all again", count("all cells") == cells)
    check("peeling takes a layer away", 0 < count("one layer peeled") < cells, count("one layer peeled"))
    check("filters show what is not a hexahedron", count("not hexahedra") == count("without hexahedra") < cells)
    hexahedra = int(next(name for name in notes if name.startswith("hexahedra ")).split()[1])
    check("types are counted", count("not hexahedra") == cells - hexahedra)
    check("the worst cells are few", cells * 0.009 <= count("worst") < cells * 0.2, count("worst"))
    colours = ("type", "quality", "layer", "distance")
    check("colouring hides nothing", all(count(f"coloured by {colour}") == cells for colour in colours))
    means = {name.split(" ", 3)[3] for name in notes if name.startswith("mean colour ")}
    check("each colouring looks different", len(means) == len(colours) and "255.00 255.00 255.00" not in means, means)
    scale = next(name for name in notes if name.startswith("scale "))
    check("distances have their scale", re.fullmatch(r"scale 0[0-9.e-]*[1-9][0-9]* and morenot measured", scale), scale)
    check("a click names a cell", any(re.match(r"picked cell \d+", name) for name in notes), list(notes))
    check("there are diagrams", int(next(name for name in notes if name.startswith("charts ")).split()[1]) >= 8)


def noted(notes, name):
    """The values that a note whose name begins so has behind it."""
    return json.loads(next(note for note in notes if note.startswith(name + " ")).split(" ", 1)[1])


def test_work(notes):
    """What is shown is right, and no more is done for it than must be."""
    compared = next(name for name in notes if name.startswith("views compared "))
    check("the faces shown are those of the definition", re.fullmatch(r"views compared \d{2,} different 0", compared), compared)
    turning, cutting, widths = (noted(notes, name) for name in ("turning", "cutting", "widths"))
    check("turning draws each shown triangle once", turning["triangles"] == turning["shown"] > 0, turning)
    check("in two calls at most", turning["calls"] <= 2, turning)
    check("and moves nothing to the device", turning["bytes"] == 0, turning)
    check("a moving cut draws each shown triangle once", cutting["triangles"] == cutting["shown"] > 0, cutting)
    check("and moves the faces that it lays bare", 0 < cutting["bytes"] == cutting["cutBytes"] < cutting["outerBytes"], cutting)
    check("pixels are coarser in motion only", widths["movingWidth"] == widths["fullWidth"] // 2 and
          widths["stillWidth"] == widths["fullWidth"] > 0, widths)


def main():
    amhex, mesh, folder = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    if shutil.which("chromium") is None:
        print("skipped: no chromium")
        sys.exit(SKIPPED)
    folder.mkdir(parents=True, exist_ok=True)
    page, shot = folder / "report.html", folder / "report.png"
    scan = pathlib.Path(mesh).with_suffix(".drc")
    subprocess.run([amhex, "report", mesh, "-o", page, "--input", scan], check=True)
    text = page.read_text()
    check("the page names no other file", not re.search(r'(src|href)\s*=\s*["\'](?!data:)', text[:text.index("<script>")]))
    cells = int(re.search(r'"cellCount":(\d+)', text).group(1))
    notes = drive(page, folder)
    if "WebGL" in notes["start"]["failure"]:
        print("skipped: this Chromium has no WebGL:", notes["start"]["failure"])
        sys.exit(SKIPPED)
    test_controls(notes, cells)
    test_work(notes)
    chromium(f"--screenshot={shot}", page.as_uri())
    share = coloured_share(shot)
    check("the screenshot shows the mesh", 0.05 < share < 0.95, share)
    far = folder / "report_distance.png"
    chromium(f"--screenshot={far}", page.as_uri() + "#colour=distance&cut-axis=none")
    check("so does one of its distances", 0.05 < coloured_share(far) < 0.95 and far.read_bytes() != shot.read_bytes())
    block(folder / "large.mesh", 59)
    large = folder / "large.html"
    subprocess.run([amhex, "report", folder / "large.mesh", "-o", large], check=True)
    notes = drive(large, folder)
    check("200,000 cells are shown", notes["whole"]["shown"] == 59 ** 3, notes["whole"])
    test_work(notes)
    turned = noted(notes, "turning")["triangles"]
    check("of which only the faces that can be seen are drawn", turned < 6 * 2 * 59 ** 2, turned)
    sys.exit(check.failures > 0)


if __name__ == "__main__":
    main()

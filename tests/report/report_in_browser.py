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
# Without a window there are no frames to animate: what is to be drawn is drawn next.
FRAMES = "<script>window.requestAnimationFrame = callback => setTimeout(() => callback(performance.now()), 0);</script>"
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
    driven.write_text(page.read_text().replace("<head>", "<head>" + FRAMES).replace("</body>", DRIVER + "</body>"))
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
    sys.exit(check.failures > 0)


if __name__ == "__main__":
    main()

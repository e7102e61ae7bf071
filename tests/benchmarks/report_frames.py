#!/usr/bin/env python3
"""Frames per second of a report with 205,379 cells, in a headless Chromium that renders in software.

    tests/benchmarks/report_frames.py AMHEX [CELLS_PER_SIDE]

The page is turned by hand, so to say: the camera moves, the scene is drawn, and one pixel is read back so that nothing is left to be done;
in the larger pixels that the page uses while something moves, and once in its smallest. Then the cut is moved step by step. Prints milliseconds per frame: the median by the clock, and the processor time of
all the browser's processes, which is the same beside other work.
"""
import http.server
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import threading

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "report"))
from report_in_browser import block  # noqa: E402

FLAGS = ["--headless", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--window-size=1280,900"]
DEADLINE = 570
DRIVER = """
<script>
(async () => {
  while (!document.body.dataset.ready) await new Promise(done => setTimeout(done, 20));
  const element = id => document.getElementById(id), canvas = element("canvas"), viewer = window.shownViewer;
  const context = viewer.renderer.getContext(), pixel = new Uint8Array(4);
  const finish = () => context.readPixels(0, 0, 1, 1, context.RGBA, context.UNSIGNED_BYTE, pixel);
  const set = (id, value) => { element(id).value = value; element(id).dispatchEvent(new Event("input", {bubbles: true})); };
  const timed = async (count, step) => {
    const times = [], processorBegin = Number(await (await fetch("/processor_seconds")).text());
    for (let i = 0; i < count; ++i) {
      const begin = performance.now();
      step(i);
      finish();
      times.push(performance.now() - begin);
    }
    times.sort((a, b) => a - b);
    const processorSeconds = Number(await (await fetch("/processor_seconds")).text()) - processorBegin;
    return {median: times[count >> 1], processor: 1000 * processorSeconds / count, triangles: Number(document.body.dataset.triangles)};
  };
  const still = () => {
    viewer.camera.position.applyAxisAngle(new THREE.Vector3(0, 0, 1), 0.05);
    viewer.camera.lookAt(0, 0, 0);
    viewer.draw();
  };
  const turn = () => { viewer.move(); still(); };
  const result = {size: [canvas.width, canvas.height]};
  const FRAMES = 20;
  set("cut-axis", "0");
  result["turning, cut open"] = await timed(FRAMES, turn);
  set("cut-axis", "none");
  result["turning, whole"] = await timed(FRAMES, turn);
  set("cut-axis", "0");
  result["moving the cut"] = await timed(FRAMES, i => { set("cut-place", 0.2 + 0.6 * i / FRAMES); viewer.draw(); });
  viewer.setCoarseness(1);
  result["still, with all pixels"] = await timed(FRAMES, still);
  await fetch("/result", {method: "POST", body: JSON.stringify(result)});
})();
</script>
"""


def processor_seconds(root):
    """User and system time of a process and all below it."""
    parents, seconds = {}, {}
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue  # ended meanwhile
        parents[int(folder.name)] = int(fields[1])
        seconds[int(folder.name)] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    inside = {root}
    while True:
        more = {process for process, parent in parents.items() if parent in inside} - inside
        if not more:
            return sum(seconds.get(process, 0) for process in inside)
        inside |= more


class Page(http.server.BaseHTTPRequestHandler):
    """Serves the page and takes its figures."""
    html, result, arrived, browser = b"", {}, threading.Event(), None

    def do_GET(self):
        self.send_response(200)
        self.end_headers()
        measured = self.path == "/processor_seconds"
        self.wfile.write(str(processor_seconds(Page.browser.pid)).encode() if measured else Page.html)

    def do_POST(self):
        Page.result = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.send_response(204)
        self.end_headers()
        Page.arrived.set()

    def log_message(self, *arguments):
        pass


def main():
    amhex, side = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 59
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        block(folder / "block.mesh", side)
        subprocess.run([amhex, "report", folder / "block.mesh", "-o", folder / "block.html"], check=True)
        text = (folder / "block.html").read_text()
        shown = text.replace("const viewer = new MeshViewer", "const viewer = window.shownViewer = new MeshViewer")
        if shown == text:
            sys.exit("the page does not make its viewer where it did")
        Page.html = shown.replace("</body>", DRIVER + "</body>").encode()
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Page)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        Page.browser = subprocess.Popen([shutil.which("chromium"), *FLAGS, f"--user-data-dir={folder / 'profile'}", "--remote-debugging-port=0",
                                    f"http://127.0.0.1:{server.server_port}/"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        arrived = Page.arrived.wait(DEADLINE)
        Page.browser.terminate()
        Page.browser.wait()
        server.shutdown()
        if not arrived:
            sys.exit("the page did not answer")
    width, height = Page.result.pop("size")
    print(f"{side ** 3} cells, {width} x {height} pixels, software rendering, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    for what, times in Page.result.items():
        print(f"  {what}: {times['triangles']} triangles, {times['median']:.0f} ms in the median ({1000 / times['median']:.0f} per second), "
              f"{times['processor']:.0f} ms of processor time")


if __name__ == "__main__":
    main()

// Reads the data, wires the controls, draws the diagrams.
"use strict";

const QUALITY_BINS = 40;

async function readArrays(facts) {
  const text = document.getElementById("arrays").textContent.trim();
  const packed = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  if (typeof DecompressionStream === "undefined") throw new Error("this browser is too old: it has no DecompressionStream");
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(stream).arrayBuffer();
  const {vertexCount: vertices, cellCount: cells} = facts;
  let at = 0;
  const take = (Type, length) => {
    const array = new Type(buffer, at, length);
    at += array.byteLength;
    return array;
  };
  return {vertexCount: vertices, cellCount: cells, vertices: take(Float32Array, 3 * vertices), quality: take(Float32Array, cells),
    distances: facts.hasDistances ? take(Float32Array, cells) : null,
    corners: take(Int32Array, 8 * cells), neighbours: take(Int32Array, 6 * cells), layers: take(Uint16Array, cells),
    types: take(Uint8Array, cells)};
}

// What follows from the arrays: centres, box, size, depth.
function complete(mesh) {
  mesh.centres = new Float32Array(3 * mesh.cellCount);
  for (let cell = 0; cell < mesh.cellCount; ++cell) {
    for (let k = 0; k < 8; ++k) {
      const v = 3 * mesh.corners[8 * cell + k];
      for (let axis = 0; axis < 3; ++axis) mesh.centres[3 * cell + axis] += mesh.vertices[v + axis] / 8;
    }
  }
  mesh.box = {low: [Infinity, Infinity, Infinity], high: [-Infinity, -Infinity, -Infinity]};
  for (let i = 0; i < mesh.vertices.length; ++i) {
    mesh.box.low[i % 3] = Math.min(mesh.box.low[i % 3], mesh.vertices[i]);
    mesh.box.high[i % 3] = Math.max(mesh.box.high[i % 3], mesh.vertices[i]);
  }
  mesh.radius = Math.hypot(...mesh.box.high.map((high, axis) => (high - mesh.box.low[axis]) / 2));
  mesh.sortedDistances = mesh.distances ? mesh.distances.filter(d => d >= 0).sort() : new Float32Array(0);
  const count = mesh.sortedDistances.length;
  // A single cell far away would leave one colour for all others.
  mesh.farDistance = count === 0 ? 0 : mesh.sortedDistances[Math.floor(0.99 * (count - 1))] || mesh.sortedDistances[count - 1];
  mesh.mostLayer = mesh.layers.reduce((a, b) => Math.max(a, b), 0);
  return mesh;
}

function qualityCounts(mesh, type) {
  const counts = new Array(QUALITY_BINS).fill(0);
  for (let cell = 0; cell < mesh.cellCount; ++cell) {
    if (type !== undefined && mesh.types[cell] !== type) continue;
    ++counts[Math.min(QUALITY_BINS - 1, Math.max(0, Math.floor(mesh.quality[cell] * QUALITY_BINS)))];
  }
  return counts;
}

function drawQuality(facts, mesh) {
  for (const {type, name, count} of facts.types) {
    if (count === 0) continue;
    let least = 1, sum = 0;
    for (let cell = 0; cell < mesh.cellCount; ++cell) {
      if (mesh.types[cell] !== type) continue;
      least = Math.min(least, mesh.quality[cell]);
      sum += mesh.quality[cell];
    }
    addChart(`Scaled Jacobian: ${name}`,
        histogram(qualityCounts(mesh, type), 0, 1, `rgb(${TYPE_COLOURS[type].join(",")})`, 130),
        `${count} cells, least ${least.toFixed(3)}, average ${(sum / count).toFixed(3)}`);
  }
}

function drawDistances(facts, mesh) {
  const sorted = mesh.sortedDistances, count = sorted.length;
  if (count === 0) return;
  const bins = new Array(QUALITY_BINS).fill(0), end = mesh.farDistance > 0 ? mesh.farDistance : 1;
  for (const distance of sorted) ++bins[Math.min(QUALITY_BINS - 1, Math.floor(distance / end * QUALITY_BINS))];
  const inEdges = facts.edges.mean > 0 ? `, ${niceNumber(sorted[count - 1] / facts.edges.mean)} mean edges` : "";
  addChart("Distance to the input, cell by cell", histogram(bins, 0, end, "#b0784a", 130),
      `${count} cells on the hull, the largest distance of each; median ${niceNumber(sorted[count >> 1])}, ` +
      `most ${niceNumber(sorted[count - 1])}${inEdges}; the last bar holds what is beyond`);
}

function drawCharts(facts, mesh) {
  drawQuality(facts, mesh);
  const edges = facts.edges, wanted = edges.wanted > 0 ? `, wanted ${niceNumber(edges.wanted)}` : "";
  addChart("Edge length, in units of the mean", histogram(edges.bins, 0, edges.binsEnd, "#7d93ad", 130),
      `${edges.count} edges, mean ${niceNumber(edges.mean)}, ${niceNumber(edges.least)} to ${niceNumber(edges.most)}${wanted}`);
  if (facts.timings.length > 0) {
    const total = facts.timings.reduce((sum, [, seconds]) => sum + seconds, 0);
    addChart("Seconds per stage", bars(facts.timings.map(([name, s]) => [name, s, s.toFixed(3)]), "#5b8c6e"),
        `${total.toFixed(2)} s in all`);
  }
  if (facts.distance.length > 0) {
    addChart("Distance to the input", bars(facts.distance.map(([name, d]) => [name, 100 * d, (100 * d).toFixed(4)]), "#b0784a"),
        "in % of the input's diagonal");
  }
  drawDistances(facts, mesh);
  const {iterations, movements} = facts.convergence;
  if (movements.some(m => m > 0)) {
    addChart("Relaxation: mean movement of the sites", decay(iterations, movements, 150), "in edge lengths per iteration");
  } else {
    addChart("Relaxation", null, facts.convergence.note);
  }
}

// The state of all controls.
function readView() {
  const value = id => document.getElementById(id).value;
  const checked = id => document.getElementById(id).checked;
  const types = {};
  for (const box of document.querySelectorAll("#types input")) types[box.value] = box.checked;
  return {cutAxis: value("cut-axis"), cutPlace: Number(value("cut-place")), cutFlip: checked("cut-flip"),
    peel: Number(value("peel")), worst: Number(value("worst")), types, colour: value("colour"),
    edges: checked("edges"), ghost: checked("ghost")};
}

function fillTypes(facts) {
  for (const {type, name, count} of facts.types) {
    const label = document.createElement("label");
    label.className = "type";
    const box = Object.assign(document.createElement("input"), {type: "checkbox", value: type, checked: true, id: `type-${name}`});
    const swatch = Object.assign(document.createElement("span"), {className: "swatch"});
    swatch.style.background = `rgb(${TYPE_COLOURS[type].join(",")})`;
    label.append(box, swatch, name, Object.assign(document.createElement("span"), {className: "count", textContent: count}));
    document.getElementById("types").appendChild(label);
  }
}

function showScale(view, mesh) {
  const scale = document.getElementById("scale"), isDistance = view.colour === "distance";
  scale.hidden = view.colour === "type";
  scale.style.display = scale.hidden ? "none" : "flex";
  const stops = [0, 0.25, 0.5, 0.75, 1].map(f => `rgb(${rampColour(isDistance ? 1 - f : f).join(",")})`).join(",");
  const most = isDistance ? `${niceNumber(mesh.farDistance)} and more` : view.colour === "quality" ? 1 : mesh.mostLayer;
  scale.innerHTML = `<span>0</span><span class="bar" style="background:linear-gradient(90deg,${stops})"></span>` +
      `<span>${most}</span>${isDistance ? '<span class="swatch none"></span><span>not measured</span>' : ""}`;
}

function wire(facts, mesh, viewer) {
  const element = id => document.getElementById(id);
  const update = () => {
    const view = readView(), begin = performance.now();
    const shown = viewer.show(view);
    element("peel-said").textContent = view.peel;
    element("worst-said").textContent = view.worst.toFixed(2);
    element("shown").textContent = `${shown} of ${mesh.cellCount} cells`;
    showScale(view, mesh);
    Object.assign(document.body.dataset, {shown, triangles: viewer.triangleCount,
      updateMilliseconds: (performance.now() - begin).toFixed(1)});
  };
  element("peel").max = mesh.mostLayer;
  if (mesh.sortedDistances.length === 0) element("colour").querySelector("[value=distance]").remove();
  element("controls").addEventListener("input", event => {
    if (event.target.type === "range") viewer.move();
    update();
  });
  element("controls").addEventListener("submit", event => event.preventDefault());
  const setTypes = wanted => {
    for (const box of document.querySelectorAll("#types input")) box.checked = wanted(Number(box.value));
    update();
  };
  element("only-other").addEventListener("click", () => { element("worst").value = 1; setTypes(type => type !== 8); });
  element("only-worst").addEventListener("click", () => {
    const sorted = Float32Array.from(mesh.quality).sort();
    // The slider's step would round down and lose the cells that it means.
    element("worst").value = Math.ceil(200 * sorted[Math.floor(sorted.length / 100)]) / 200;
    setTypes(() => true);
  });
  element("all-cells").addEventListener("click", () => {
    Object.assign(element("worst"), {value: 1});
    Object.assign(element("peel"), {value: 0});
    element("cut-axis").value = "none";
    setTypes(() => true);
  });
  element("home").addEventListener("click", () => viewer.home());
  viewer.controls.addEventListener("end", () => { if (readView().cutAxis === "view") update(); });
  wirePicking(facts, mesh, viewer);
  return update;
}

function wirePicking(facts, mesh, viewer) {
  const canvas = document.getElementById("canvas"), picked = document.getElementById("picked");
  let down = null;
  canvas.addEventListener("pointerdown", event => { down = [event.clientX, event.clientY]; }, true);
  canvas.addEventListener("click", event => {
    if (down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4) return;
    const frame = canvas.getBoundingClientRect();
    const cell = viewer.pick((event.clientX - frame.left) / frame.width, (event.clientY - frame.top) / frame.height);
    picked.hidden = cell < 0;
    if (cell < 0) return;
    const name = facts.types.find(entry => entry.type === mesh.types[cell]).name;
    const centre = [0, 1, 2].map(axis => niceNumber(mesh.centres[3 * cell + axis] + facts.centre[axis]));
    picked.textContent = `cell ${cell}, ${name}\nscaled Jacobian ${mesh.quality[cell].toFixed(3)}, layer ${mesh.layers[cell]}\n` +
        (mesh.distances && mesh.distances[cell] >= 0 ? `distance to the input ${niceNumber(mesh.distances[cell])}\n` : "") +
        `at ${centre.join(", ")}`;
  });
}

// Controls named in the address, as in part.html#colour=distance&cut-axis=none.
function setFromAddress() {
  for (const [id, value] of new URLSearchParams(location.hash.slice(1))) {
    const control = document.getElementById(id);
    if (!control || !control.closest("#controls") || !("value" in control)) continue;
    if (control.type === "checkbox") control.checked = value !== "0"; else control.value = value;
    // An option that this page does not have leaves nothing chosen.
    if (control.selectedIndex === -1) control.selectedIndex = 0;
  }
}

async function main() {
  const facts = JSON.parse(document.getElementById("facts").textContent);
  document.getElementById("title").textContent = facts.title;
  document.getElementById("summary").textContent = facts.summary;
  fillTypes(facts);
  for (const [title, rows] of facts.tables) addTable(title, rows);
  const mesh = complete(await readArrays(facts));
  drawCharts(facts, mesh);
  const viewer = new MeshViewer(document.getElementById("canvas"), mesh);
  const update = wire(facts, mesh, viewer);
  // A first view that shows the inside: the whole mesh looks like its hull.
  document.getElementById("cut-axis").value = String(facts.firstCut);
  setFromAddress();
  update();
  viewer.draw();
  document.body.dataset.ready = "yes";
}

main().catch(error => {
  const failure = document.getElementById("failure");
  failure.hidden = false;
  failure.textContent = `This page cannot show the mesh: ${error.message}`;
  document.body.dataset.ready = "failed";
});

// Diagrams as SVG, without a library: they are few and still.
"use strict";

const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 340, LEFT = 50, RIGHT = 10, TOP = 8, BOTTOM = 26;

function svgNode(name, attributes, text) {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text !== undefined) node.textContent = text;
  return node;
}

function addChart(title, drawing, note) {
  const box = document.createElement("div");
  box.className = "chart";
  box.appendChild(Object.assign(document.createElement("h2"), {textContent: title}));
  if (drawing) box.appendChild(drawing);
  box.appendChild(Object.assign(document.createElement("p"), {textContent: note}));
  document.getElementById("charts").appendChild(box);
}

function niceNumber(value) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size >= 1e5 || size < 1e-3 ? value.toExponential(1) : String(Number(value.toPrecision(3)));
}

// Bars over equal intervals of [low, high]; the heights are shares of the sum.
function histogram(counts, low, high, colour, height) {
  const svg = svgNode("svg", {viewBox: `0 0 ${WIDTH} ${height}`, role: "img"});
  const most = Math.max(1, ...counts), sum = counts.reduce((a, b) => a + b, 0);
  const inner = WIDTH - LEFT - RIGHT, room = height - TOP - BOTTOM;
  const step = inner / counts.length;
  counts.forEach((count, i) => {
    const size = room * count / most;
    const bar = svgNode("rect", {x: LEFT + i * step + 0.5, y: TOP + room - size, width: step - 1,
      height: size, fill: colour});
    bar.appendChild(svgNode("title", {}, `${count} in ${niceNumber(low + (high - low) * i / counts.length)} to ` +
        niceNumber(low + (high - low) * (i + 1) / counts.length)));
    svg.appendChild(bar);
  });
  svg.appendChild(svgNode("line", {x1: LEFT, x2: WIDTH - RIGHT, y1: TOP + room, y2: TOP + room, stroke: "#99a"}));
  for (const fraction of [0, 0.25, 0.5, 0.75, 1]) {
    svg.appendChild(svgNode("text", {x: LEFT + inner * fraction, y: height - 10, "text-anchor": "middle"},
        niceNumber(low + (high - low) * fraction)));
  }
  svg.appendChild(svgNode("text", {x: LEFT - 4, y: TOP + 9, "text-anchor": "end"},
      `${niceNumber(100 * most / Math.max(1, sum))} %`));
  return svg;
}

// Rows of [label, value, text].
function bars(rows, colour) {
  const rowHeight = 18, label = 128, height = rows.length * rowHeight + 4;
  const svg = svgNode("svg", {viewBox: `0 0 ${WIDTH} ${height}`, role: "img"});
  const most = Math.max(...rows.map(row => row[1]), 1e-300);
  rows.forEach(([name, value, text], i) => {
    const y = i * rowHeight + 2, size = Math.max(0.5, (WIDTH - label - 66) * value / most);
    svg.appendChild(svgNode("text", {x: label - 6, y: y + 12, "text-anchor": "end"}, name));
    svg.appendChild(svgNode("rect", {x: label, y: y + 2, width: size, height: rowHeight - 6, fill: colour}));
    svg.appendChild(svgNode("text", {x: label + size + 5, y: y + 12, class: "value"}, text));
  });
  return svg;
}

// A falling series on a logarithmic scale.
function decay(xs, ys, height) {
  const svg = svgNode("svg", {viewBox: `0 0 ${WIDTH} ${height}`, role: "img"});
  const positive = ys.filter(y => y > 0);
  const low = Math.floor(Math.log10(Math.min(...positive))), high = Math.ceil(Math.log10(Math.max(...positive)) + 1e-9);
  const inner = WIDTH - LEFT - RIGHT, room = height - TOP - BOTTOM, last = Math.max(1, xs[xs.length - 1]);
  const atY = y => TOP + room * (high - Math.log10(y)) / Math.max(1, high - low);
  for (let power = low; power <= high; ++power) {
    const y = atY(Math.pow(10, power));
    svg.appendChild(svgNode("line", {x1: LEFT, x2: WIDTH - RIGHT, y1: y, y2: y, stroke: "#e3e6ea"}));
    svg.appendChild(svgNode("text", {x: LEFT - 4, y: y + 4, "text-anchor": "end"}, niceNumber(Math.pow(10, power))));
  }
  const points = xs.map((x, i) => [x, ys[i]]).filter(([, y]) => y > 0)
      .map(([x, y]) => `${(LEFT + inner * x / last).toFixed(1)},${atY(y).toFixed(1)}`);
  svg.appendChild(svgNode("polyline", {points: points.join(" "), fill: "none", stroke: "#3b6fb6", "stroke-width": 1.6}));
  svg.appendChild(svgNode("text", {x: WIDTH - RIGHT, y: height - 8, "text-anchor": "end"}, `iteration ${last}`));
  return svg;
}

function addTable(title, rows) {
  if (rows.length === 0) return;
  const box = document.createElement("div"), table = document.createElement("table");
  box.appendChild(Object.assign(document.createElement("h2"), {textContent: title}));
  for (const [name, value] of rows) {
    const row = table.insertRow();
    row.insertCell().textContent = name;
    row.insertCell().textContent = value;
  }
  box.appendChild(table);
  document.getElementById("details").appendChild(box);
}

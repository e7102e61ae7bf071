// The mesh in three dimensions: which cells are shown, and their faces as triangles.
"use strict";

// The hexahedron's faces by corner, outward; as in the description of the cells' corner order.
const FACE_CORNERS = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
const TYPE_COLOURS = {8: [158, 194, 245], 7: [250, 204, 41], 6: [86, 180, 132], 5: [214, 96, 77], 4: [171, 130, 214], 1: [240, 140, 60]};

// Of cells inside, and where there is nothing of the input to measure to; #scale shows it too.
const NO_DISTANCE = [200, 204, 210];

// From red over yellow to blue, for a fraction in [0, 1].
function rampColour(fraction) {
  const stops = [[178, 24, 43], [239, 138, 98], [253, 219, 120], [166, 206, 200], [67, 120, 191]];
  const at = Math.min(Math.max(fraction, 0), 1) * (stops.length - 1);
  const low = Math.min(Math.floor(at), stops.length - 2);
  return stops[low].map((value, i) => Math.round(value + (stops[low + 1][i] - value) * (at - low)));
}

// The distinct vertices of a face, in order, into `out`; how many there are.
function faceVertices(corners, cell, face, out) {
  let count = 0;
  for (const corner of FACE_CORNERS[face]) {
    const vertex = corners[8 * cell + corner];
    let known = false;
    for (let i = 0; i < count; ++i) known = known || out[i] === vertex;
    if (!known) out[count++] = vertex;
  }
  return count;
}

// Whether the browser draws without a graphics processor, where each sample of a pixel costs time.
function rendersInSoftware() {
  const context = document.createElement("canvas").getContext("webgl");
  const names = context && context.getExtension("WEBGL_debug_renderer_info");
  const name = names ? context.getParameter(names.UNMASKED_RENDERER_WEBGL) : "";
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

class MeshViewer {
  constructor(canvas, mesh) {
    this.canvas = canvas;
    this.mesh = mesh;
    this.keep = new Uint8Array(mesh.cellCount);
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: !rendersInSoftware(), preserveDrawingBuffer: true});
    this.renderer.setClearColor(0xffffff, 1);
    this.renderer.setPixelRatio(window.devicePixelRatio || 1);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(30, 1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.scene.add(this.camera);
    this.scene.add(new THREE.AmbientLight(0xffffff, 0.72));
    const lamp = new THREE.DirectionalLight(0xffffff, 0.42);
    lamp.position.set(-0.4, 0.7, 1);
    this.camera.add(lamp);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.requestDraw());
    this.controls.addEventListener("start", () => { this.atHome = false; });
    this.makeObjects();
    this.home();
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
  }

  makeObjects() {
    this.faces = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshPhongMaterial(
        {vertexColors: THREE.VertexColors, flatShading: true, shininess: 0, specular: 0,
          polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1, side: THREE.DoubleSide}));
    this.lines = new THREE.LineSegments(new THREE.BufferGeometry(),
        new THREE.LineBasicMaterial({color: 0x33383f}));
    this.glass = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshPhongMaterial(
        {color: 0x8899aa, flatShading: true, transparent: true, opacity: 0.14, depthWrite: false,
          side: THREE.DoubleSide}));
    this.glass.visible = false;
    for (const object of [this.faces, this.lines, this.glass]) {
      object.frustumCulled = false;
      this.scene.add(object);
    }
  }

  // From the front right, from above, just far enough for every vertex.
  home() {
    const direction = new THREE.Vector3(0.62, -1.0, 0.55).normalize();
    const right = new THREE.Vector3(0, 0, 1).cross(direction).normalize();
    const up = direction.clone().cross(right);
    const slope = Math.tan(this.camera.fov * Math.PI / 360), vertex = new THREE.Vector3();
    let distance = 0;
    for (let i = 0; i < this.mesh.vertices.length; i += 3) {
      vertex.fromArray(this.mesh.vertices, i);
      const aside = Math.max(Math.abs(vertex.dot(right)) / this.camera.aspect, Math.abs(vertex.dot(up)));
      distance = Math.max(distance, vertex.dot(direction) + aside / slope);
    }
    distance *= 1.06;
    this.camera.position.copy(direction.multiplyScalar(distance));
    this.camera.near = distance / 100;
    this.camera.far = distance * 10;
    this.camera.updateProjectionMatrix();
    this.controls.target.set(0, 0, 0);
    this.controls.update();
    this.atHome = true;
    this.requestDraw();
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas.parentElement;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (this.atHome) this.home();
    this.requestDraw();
  }

  requestDraw() {
    if (this.drawRequested) return;
    this.drawRequested = true;
    requestAnimationFrame(() => { this.drawRequested = false; this.draw(); });
  }

  draw() { this.renderer.render(this.scene, this.camera); }

  // Which cells `view` shows: not cut off, deep enough, bad enough, of a wanted type.
  select(view) {
    const {cellCount, types, quality, layers, centres, box} = this.mesh;
    let normal = null, place = 0;
    if (view.cutAxis === "view") {
      normal = this.camera.position.clone().sub(this.controls.target).normalize().toArray();
      place = (2 * view.cutPlace - 1) * this.mesh.radius;
    } else if (view.cutAxis !== "none") {
      const axis = Number(view.cutAxis);
      normal = [0, 0, 0];
      normal[axis] = 1;
      place = box.low[axis] + view.cutPlace * (box.high[axis] - box.low[axis]);
    }
    const sign = view.cutFlip ? -1 : 1;
    let shown = 0;
    for (let cell = 0; cell < cellCount; ++cell) {
      let keep = view.types[types[cell]] && layers[cell] >= view.peel && quality[cell] <= view.worst;
      if (keep && normal) {
        const c = 3 * cell;
        const offset = centres[c] * normal[0] + centres[c + 1] * normal[1] + centres[c + 2] * normal[2] - place;
        keep = offset * sign <= 0;
      }
      this.keep[cell] = keep ? 1 : 0;
      shown += this.keep[cell];
    }
    return shown;
  }

  colourTable(view) {
    const {cellCount, types, quality, layers, mostLayer, distances, farDistance} = this.mesh;
    const colourOf = {
      type: cell => TYPE_COLOURS[types[cell]],
      quality: cell => rampColour(quality[cell]),
      layer: cell => rampColour(layers[cell] / Math.max(1, mostLayer)),
      distance: cell => distances[cell] >= 0 ? rampColour(1 - distances[cell] / (farDistance || 1)) : NO_DISTANCE,
    }[view.colour];
    const table = new Uint8Array(3 * cellCount);
    for (let cell = 0; cell < cellCount; ++cell) table.set(colourOf(cell), 3 * cell);
    return table;
  }

  // Shows the faces between shown cells and everything else. Returns the number of shown cells.
  show(view) {
    const {cellCount, corners, neighbours, vertices} = this.mesh;
    const shown = this.select(view), keep = this.keep, colours = this.colourTable(view);
    const face = new Int32Array(4), visible = [];
    let triangles = 0, edges = 0;
    for (let cell = 0; cell < cellCount; ++cell) {
      if (!keep[cell]) continue;
      for (let f = 0; f < 6; ++f) {
        const other = neighbours[6 * cell + f];
        if (other === -2 || (other >= 0 && keep[other])) continue;
        visible.push(cell, f);
      }
    }
    const positions = new Float32Array(9 * visible.length), tints = new Uint8Array(9 * visible.length);
    const lines = new Float32Array(12 * visible.length);
    this.owner = new Int32Array(visible.length);
    for (let i = 0; i < visible.length; i += 2) {
      const cell = visible[i], count = faceVertices(corners, cell, visible[i + 1], face);
      for (let k = 2; k < count; ++k) {
        for (const [slot, vertex] of [[0, face[0]], [1, face[k - 1]], [2, face[k]]]) {
          const at = 9 * triangles + 3 * slot;
          for (let axis = 0; axis < 3; ++axis) {
            positions[at + axis] = vertices[3 * vertex + axis];
            tints[at + axis] = colours[3 * cell + axis];
          }
        }
        this.owner[triangles++] = cell;
      }
      // The shown faces close, so that every edge is passed in both directions: one is drawn.
      for (let k = 0; k < count; ++k) {
        const from = face[k], to = face[(k + 1) % count];
        if (from > to) continue;
        for (let axis = 0; axis < 3; ++axis) {
          lines[6 * edges + axis] = vertices[3 * from + axis];
          lines[6 * edges + 3 + axis] = vertices[3 * to + axis];
        }
        ++edges;
      }
    }
    this.triangleCount = triangles;
    this.replace(this.faces, {position: [positions.subarray(0, 9 * triangles), false],
      color: [tints.subarray(0, 9 * triangles), true]});
    this.replace(this.lines, {position: [lines.subarray(0, 6 * edges), false]});
    this.lines.visible = view.edges;
    this.showGlass(view.ghost);
    this.requestDraw();
    return shown;
  }

  replace(object, attributes) {
    object.geometry.dispose();
    object.geometry = new THREE.BufferGeometry();
    for (const [name, [array, normalized]] of Object.entries(attributes)) {
      object.geometry.setAttribute(name, new THREE.BufferAttribute(array, 3, normalized));
    }
  }

  showGlass(wanted) {
    this.glass.visible = wanted;
    if (!wanted || this.hasGlass) return;
    this.hasGlass = true;
    const {cellCount, corners, neighbours, vertices} = this.mesh;
    const face = new Int32Array(4), positions = [];
    for (let cell = 0; cell < cellCount; ++cell) {
      for (let f = 0; f < 6; ++f) {
        if (neighbours[6 * cell + f] !== -1) continue;
        const count = faceVertices(corners, cell, f, face);
        for (let k = 2; k < count; ++k) {
          for (const vertex of [face[0], face[k - 1], face[k]]) {
            positions.push(vertices[3 * vertex], vertices[3 * vertex + 1], vertices[3 * vertex + 2]);
          }
        }
      }
    }
    this.replace(this.glass, {position: [new Float32Array(positions), false]});
  }

  // The cell under a point of the canvas, or -1.
  pick(x, y) {
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2(2 * x - 1, 1 - 2 * y), this.camera);
    const positions = this.faces.geometry.attributes.position.array;
    const a = new THREE.Vector3(), b = new THREE.Vector3(), c = new THREE.Vector3(), hit = new THREE.Vector3();
    let nearest = Infinity, cell = -1;
    for (let t = 0; t < this.triangleCount; ++t) {
      a.fromArray(positions, 9 * t);
      b.fromArray(positions, 9 * t + 3);
      c.fromArray(positions, 9 * t + 6);
      if (!ray.ray.intersectTriangle(a, b, c, false, hit)) continue;
      const distance = hit.distanceTo(this.camera.position);
      if (distance < nearest) [nearest, cell] = [distance, this.owner[t]];
    }
    return cell;
  }
}

// The mesh in three dimensions: camera, light, colours, and what the controls say is shown.
"use strict";

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

// Whether the browser draws without a graphics processor, where each sample of a pixel costs time.
function rendersInSoftware() {
  const context = document.createElement("canvas").getContext("webgl");
  const names = context && context.getExtension("WEBGL_debug_renderer_info");
  const name = names ? context.getParameter(names.UNMASKED_RENDERER_WEBGL) : "";
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

// Light from the camera's upper left, and edges by how far a pixel is from them: lines of their own would cost as much as the faces.
const LIGHT = [-0.4, 0.7, 1], AMBIENT = 0.72, DIRECTED = 0.42;
const EDGE_COLOUR = [0.2, 0.22, 0.25];
const VERTEX_SHADER = `
uniform mat4 toScreen;
uniform vec3 light;
attribute vec4 tint;
varying vec3 colour;
varying vec2 place;
void main() {
  float code = floor(tint.a * 255.0 + 0.5);
  float triangle = step(4.0, code);
  code -= 4.0 * triangle;
  float second = step(2.0, code);
  place = vec2(code - 2.0 * second + 2.0 * triangle, second);
  colour = tint.rgb * (${AMBIENT} + ${DIRECTED} * max(0.0, dot(normal, light)));
  gl_Position = toScreen * vec4(position, 1.0);
}`;
const FRAGMENT_SHADER = `
uniform float edges;
varying vec3 colour;
varying vec2 place;
// How many pixels it takes for a coordinate to grow by one.
float pixels(float coordinate) { return inversesqrt(max(1e-12, dot(vec2(dFdx(coordinate), dFdy(coordinate)), vec2(dFdx(coordinate), dFdy(coordinate))))); }
void main() {
  float triangle = step(1.5, place.x), u = place.x - 2.0 * triangle, v = place.y, third = 1.0 - u - v;
  float wide = pixels(u), high = pixels(v), far = pixels(third);
  float inSquare = min(min(u, 1.0 - u) * wide, min(v, 1.0 - v) * high);
  float inTriangle = min(min(u * wide, v * high), third * far);
  // Half a line; the other half is in the next face. Faces of few pixels would be lines only.
  float line = clamp(0.95 - mix(inSquare, inTriangle, triangle), 0.0, 1.0) * clamp((min(wide, high) - 1.5) / 5.0, 0.0, 1.0);
  gl_FragColor = vec4(mix(colour, vec3(${EDGE_COLOUR.join(", ")}), edges * line), 1.0);
}`;
// While something moves and the browser draws in software, pixels are this much larger.
const COARSENESS_IN_MOTION = 2;
const STILL_AFTER_MILLISECONDS = 250;

class MeshViewer {
  constructor(canvas, mesh) {
    this.canvas = canvas;
    this.mesh = mesh;
    this.shown = new ShownFaces(mesh);
    this.last = {};
    this.coarseness = 1;
    this.inSoftware = rendersInSoftware();
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: !this.inSoftware, preserveDrawingBuffer: true});
    this.renderer.setClearColor(0xffffff, 1);
    this.renderer.setPixelRatio(window.devicePixelRatio || 1);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(30, 1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.scene.add(this.camera);
    this.scene.add(new THREE.AmbientLight(0xffffff, AMBIENT));
    const lamp = new THREE.DirectionalLight(0xffffff, DIRECTED);
    lamp.position.set(...LIGHT);
    this.camera.add(lamp);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => { if (this.isHeld) this.move(); this.requestDraw(); });
    this.controls.addEventListener("start", () => { this.atHome = false; this.isHeld = true; });
    this.controls.addEventListener("end", () => { this.isHeld = false; });
    this.makeObjects();
    this.home();
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
  }

  makeObjects() {
    this.material = new THREE.ShaderMaterial({vertexShader: VERTEX_SHADER, fragmentShader: FRAGMENT_SHADER,
      uniforms: {edges: {value: 1}, light: {value: new THREE.Vector3()}, toScreen: {value: new THREE.Matrix4()}}, extensions: {derivatives: true}});
    this.outer = new THREE.Mesh(new THREE.BufferGeometry(), this.material);
    this.bare = new THREE.Mesh(new THREE.BufferGeometry(), this.material);
    this.glass = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshPhongMaterial(
        {color: 0x8899aa, flatShading: true, transparent: true, opacity: 0.14, depthWrite: false,
          side: THREE.DoubleSide}));
    this.glass.visible = false;
    for (const object of [this.outer, this.bare, this.glass]) {
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

  draw() {
    const {camera, material: {uniforms: {light, toScreen}}} = this;
    camera.updateMatrixWorld();
    light.value.set(...LIGHT).transformDirection(camera.matrixWorld);
    toScreen.value.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
    this.renderer.render(this.scene, camera);
  }

  // Something moves: until it is still, a frame may be coarser.
  move() {
    if (!this.inSoftware) return;
    clearTimeout(this.stillness);
    this.stillness = setTimeout(() => this.setCoarseness(1), STILL_AFTER_MILLISECONDS);
    this.setCoarseness(COARSENESS_IN_MOTION);
  }

  setCoarseness(coarseness) {
    if (this.coarseness === coarseness) return;
    this.coarseness = coarseness;
    this.renderer.setPixelRatio((window.devicePixelRatio || 1) / coarseness);
    this.requestDraw();
  }

  // The direction across which `view` cuts, or none.
  cutNormal(view) {
    if (view.cutAxis === "none") return null;
    if (view.cutAxis === "view") return this.camera.position.clone().sub(this.controls.target).normalize().toArray();
    return [0, 1, 2].map(axis => Number(axis === Number(view.cutAxis)));
  }

  cutPlace(view) {
    if (view.cutAxis === "view") return (2 * view.cutPlace - 1) * this.mesh.radius;
    const {low, high} = this.mesh.box, axis = Number(view.cutAxis);
    return low[axis] + view.cutPlace * (high[axis] - low[axis]);
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

  // Whether `value` is another than in the last call with this name.
  isNew(name, value) {
    const text = JSON.stringify(value), is = this.last[name] !== text;
    this.last[name] = text;
    return is;
  }

  // Shows the faces between shown cells and everything else. Returns the number of shown cells. Does only what the change calls for.
  show(view) {
    const {shown} = this, normal = this.cutNormal(view);
    let collect = false;
    if (this.isNew("wanted", [view.types, view.peel, view.worst])) {
      shown.want(view);
      collect = true;
    }
    if (normal && this.isNew("normal", normal)) {
      shown.direct(normal);
      collect = true;
    }
    if (this.isNew("colour", view.colour)) {
      this.colours = this.colourTable(view);
      collect = true;
    }
    if (collect) {
      shown.collect(this.colours);
      this.upload(this.outer, shown.outer);
    }
    const count = normal ? shown.cut(this.cutPlace(view), view.cutFlip) : shown.whole();
    this.outer.geometry.setDrawRange(shown.range.start, shown.range.count);
    this.upload(this.bare, shown.bare);
    this.bare.geometry.setDrawRange(0, shown.bare.indexCount);
    this.triangleCount = (shown.range.count + shown.bare.indexCount) / 3;
    this.material.uniforms.edges.value = view.edges ? 1 : 0;
    this.showGlass(view.ghost);
    this.requestDraw();
    return count;
  }

  // Brings what is used of the arrays to the device.
  upload(object, {positions, tints, normals, indices, vertexCount, indexCount, generation}) {
    object.visible = indexCount > 0;
    if (indexCount === 0) return;
    if (object.generation !== generation) {
      object.generation = generation;
      object.geometry.dispose();
      object.geometry = new THREE.BufferGeometry();
      object.geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
      object.geometry.setAttribute("tint", new THREE.BufferAttribute(tints, 4, true));
      object.geometry.setAttribute("normal", new THREE.BufferAttribute(normals, 4, true));
      object.geometry.setIndex(new THREE.BufferAttribute(indices, 1));
      return;
    }
    const {attributes, index} = object.geometry;
    const used = [[attributes.position, 3 * vertexCount], [attributes.tint, 4 * vertexCount],
      [attributes.normal, 4 * vertexCount], [index, indexCount]];
    for (const [attribute, count] of used) {
      attribute.updateRange.count = count;
      attribute.needsUpdate = true;
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
    this.glass.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(positions), 3));
  }

  // The cell under a point of the canvas, or -1.
  pick(x, y) {
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2(2 * x - 1, 1 - 2 * y), this.camera);
    const {outer, bare, range} = this.shown;
    const a = new THREE.Vector3(), b = new THREE.Vector3(), c = new THREE.Vector3(), hit = new THREE.Vector3();
    let nearest = Infinity, cell = -1;
    for (const [{positions, indices, owners}, start, count] of [[outer, range.start, range.count], [bare, 0, bare.indexCount]]) {
      for (let i = start; i < start + count; i += 3) {
        a.fromArray(positions, 3 * indices[i]);
        b.fromArray(positions, 3 * indices[i + 1]);
        c.fromArray(positions, 3 * indices[i + 2]);
        if (!ray.ray.intersectTriangle(a, b, c, true, hit)) continue;
        const distance = hit.distanceTo(this.camera.position);
        if (distance < nearest) [nearest, cell] = [distance, owners[i / 3]];
      }
    }
    return cell;
  }
}

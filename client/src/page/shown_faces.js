// Which faces of cells are seen, in buffers for drawing that a moving cut does not fill anew.
//
// Cells are sorted along the direction of the cut, and the faces between wanted and unwanted cells follow that order: wherever the
// cut is, those that it leaves are one range. Only the faces that it lays bare, which lie close to it, are collected for each place.
"use strict";

// The hexahedron's faces by corner, outward; as in the description of the cells' corner order.
const FACE_CORNERS = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
const VANISHED = -2;  // in place of a neighbour where the cell has no such face

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

// Faces as the shader wants them. Per vertex: a place, a colour whose fourth byte says where in the face it is, a normal.
class FaceBuffer {
  constructor(mesh) {
    this.mesh = mesh;
    this.face = new Int32Array(4);
    this.generation = 0;  // changes with the arrays
    this.allocate(1024);
    this.clear();
  }

  clear() { this.vertexCount = this.indexCount = 0; }

  allocate(capacity) {
    const old = this.capacity ? this : null;
    const grown = (Type, perFace, before) => {
      const array = new Type(perFace * capacity);
      if (before) array.set(before);
      return array;
    };
    this.positions = grown(Float32Array, 12, old && old.positions);
    this.tints = grown(Uint8Array, 16, old && old.tints);
    this.normals = grown(Int8Array, 16, old && old.normals);
    this.indices = grown(Uint32Array, 6, old && old.indices);
    this.owners = grown(Uint32Array, 2, old && old.owners);  // the cell of each triangle
    this.capacity = capacity;
    ++this.generation;
  }

  add(cell, side, colours) {
    if (this.vertexCount + 4 > 4 * this.capacity) this.allocate(2 * this.capacity);
    const {corners, vertices} = this.mesh, {face, positions, indices, vertexCount: first} = this;
    const count = faceVertices(corners, cell, side, face);
    for (let k = 0; k < count; ++k) {
      const to = 3 * (first + k), from = 3 * face[k];
      for (let axis = 0; axis < 3; ++axis) positions[to + axis] = vertices[from + axis];
    }
    for (let k = 2; k < count; ++k) {
      this.owners[this.indexCount / 3] = cell;
      indices[this.indexCount++] = first;
      indices[this.indexCount++] = first + k - 1;
      indices[this.indexCount++] = first + k;
    }
    this.vertexCount += count;
    this.dress(first, count, 3 * cell, colours);
  }

  // Colour, normal and place in the face of `count` vertices from `first` on.
  dress(first, count, colour, colours) {
    const {positions: p, tints, normals} = this;
    const a = 3 * first, b = a + 3, c = a + 6, d = count === 4 ? a + 9 : a;
    // Of a quadrilateral the diagonals, of a triangle two sides.
    const ux = p[c] - p[a], uy = p[c + 1] - p[a + 1], uz = p[c + 2] - p[a + 2];
    const vx = p[d] - p[b], vy = p[d + 1] - p[b + 1], vz = p[d + 2] - p[b + 2];
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    const scale = 127 / (Math.hypot(x, y, z) || 1);
    for (let k = 0; k < count; ++k) {
      const to = 4 * (first + k);
      tints[to] = colours[colour];
      tints[to + 1] = colours[colour + 1];
      tints[to + 2] = colours[colour + 2];
      // Bits: first and second coordinate in the unit square or triangle, and whether it is a triangle.
      tints[to + 3] = count === 4 ? (k === 1 || k === 2 ? 1 : 0) + (k >= 2 ? 2 : 0) : 4 + k;
      normals[to] = x * scale;
      normals[to + 1] = y * scale;
      normals[to + 2] = z * scale;
    }
  }
}

class ShownFaces {
  constructor(mesh) {
    this.mesh = mesh;
    this.wanted = new Uint8Array(mesh.cellCount);    // but for the cut
    this.offsets = new Float32Array(mesh.cellCount); // along the direction of the cut
    this.order = Uint32Array.from({length: mesh.cellCount}, (_, cell) => cell);
    this.indicesBefore = new Uint32Array(mesh.cellCount + 1);  // by place in the order
    this.wantedBefore = new Uint32Array(mesh.cellCount + 1);
    this.outer = new FaceBuffer(mesh);
    this.bare = new FaceBuffer(mesh);
    this.range = {start: 0, count: 0};  // of the outer faces' indices: what the cut leaves
  }

  // Wanted are cells deep enough, bad enough and of a wanted type.
  want({types, peel, worst}) {
    const {mesh, wanted} = this;
    for (let cell = 0; cell < mesh.cellCount; ++cell) {
      wanted[cell] = types[mesh.types[cell]] && mesh.layers[cell] >= peel && mesh.quality[cell] <= worst ? 1 : 0;
    }
  }

  // Sorts the cells by their centres along `normal`.
  direct(normal) {
    const {offsets, order, mesh: {cellCount, centres, neighbours}} = this;
    for (let cell = 0; cell < cellCount; ++cell) {
      const c = 3 * cell;
      offsets[cell] = centres[c] * normal[0] + centres[c + 1] * normal[1] + centres[c + 2] * normal[2];
    }
    order.sort((a, b) => offsets[a] - offsets[b] || a - b);
    this.reach = 0;  // how far neighbours are from each other
    for (let side = 0; side < 6 * cellCount; ++side) {
      if (neighbours[side] < 0) continue;
      this.reach = Math.max(this.reach, Math.abs(offsets[neighbours[side]] - offsets[Math.floor(side / 6)]));
    }
  }

  // Collects the faces between wanted cells and all else, with colours [cell][3].
  collect(colours) {
    const {wanted, order, outer, mesh: {cellCount, neighbours}} = this;
    this.colours = colours;
    outer.clear();
    for (let i = 0; i < cellCount; ++i) {
      const cell = order[i];
      if (wanted[cell]) {
        for (let side = 0; side < 6; ++side) {
          const other = neighbours[6 * cell + side];
          if (other !== VANISHED && (other < 0 || !wanted[other])) outer.add(cell, side, colours);
        }
      }
      this.indicesBefore[i + 1] = outer.indexCount;
      this.wantedBefore[i + 1] = this.wantedBefore[i] + wanted[cell];
    }
  }

  // How many cells in the order come before `place`; with it, if `orAt`.
  countBefore(place, orAt) {
    let low = 0, high = this.order.length;
    while (low < high) {
      const middle = (low + high) >> 1, offset = this.offsets[this.order[middle]];
      if (offset < place || (orAt && offset === place)) low = middle + 1; else high = middle;
    }
    return low;
  }

  // Leaves the cells up to `place`, or from there on if `flip`. Returns how many of them are wanted.
  cut(place, flip) {
    const {offsets, order, bare, wanted, colours, reach, mesh: {cellCount, neighbours}} = this;
    const middle = this.countBefore(place, !flip);
    const [from, to] = flip ? [middle, cellCount] : [0, middle];
    this.range = {start: this.indicesBefore[from], count: this.indicesBefore[to] - this.indicesBefore[from]};
    bare.clear();
    for (let i = flip ? middle : middle - 1; i >= from && i < to; i += flip ? 1 : -1) {
      const cell = order[i];
      if (Math.abs(offsets[cell] - place) > reach) break;
      if (!wanted[cell]) continue;
      for (let side = 0; side < 6; ++side) {
        const other = neighbours[6 * cell + side];
        const isCutOff = other >= 0 && (flip ? offsets[other] < place : offsets[other] > place);
        if (isCutOff && wanted[other]) bare.add(cell, side, colours);
      }
    }
    return this.wantedBefore[to] - this.wantedBefore[from];
  }

  // Nothing is cut off.
  whole() {
    this.range = {start: 0, count: this.outer.indexCount};
    this.bare.clear();
    return this.wantedBefore[this.mesh.cellCount];
  }
}

// The mesh of the page: faces with the cells on their two sides, and frames, which are the mesh at different times.

import { decoded } from "./arrays.js";

export class Mesh {
  constructor(contents, arrays) {
    this.contents = contents;
    Object.assign(this, arrays); // faces (f, 4), sides (f, 2), middles (f, 5), layers, types, regions, featureEdges, ...
    this.count = contents.cells.count;
    this.faceCount = this.faces.length / 4;
    this.frames = contents.frames.map((frame) => new Frame(frame));
    this.first = this.frames[0];
    this.last = this.frames[this.frames.length - 1];
    this.mostLayers = this.layers === null ? 0 : this.layers.reduce((most, layer) => Math.max(most, layer), 0);
  }

  static async of(contents) {
    const named = {
      faces: contents.faces,
      sides: contents.sides,
      middles: contents.middles,
      layers: contents.layers,
      types: contents.cells.types,
      regions: contents.regions && contents.regions.labels,
      featureEdges: contents.features && contents.features.edges,
      featureCorners: contents.features && contents.features.corners,
    };
    const arrays = {};
    for (const [name, reference] of Object.entries(named)) arrays[name] = reference ? await decoded(reference) : null;
    const mesh = new Mesh(contents, arrays);
    await mesh.first.load();
    await mesh.last.load();
    mesh.centres = mesh.centresIn(mesh.last);
    mesh.findExtent();
    return mesh;
  }

  /** What the file calls a cell. */
  label(cell) {
    const { labels } = this.contents.cells;
    return labels === null ? cell : labels[cell];
  }

  /** The name of the type of a cell. */
  type(cell) {
    const names = this.contents.cells.type_names;
    return names[this.types === null ? 0 : this.types[cell]];
  }

  /** (m, 3) means of the nodes of the faces of the cells. */
  centresIn(frame) {
    const sums = new Float64Array(3 * this.count);
    const counts = new Float64Array(this.count);
    for (let face = 0; face < this.faceCount; face += 1) {
      for (let side = 0; side < 2; side += 1) {
        const cell = this.sides[2 * face + side];
        if (cell < 0) continue;
        counts[cell] += 4;
        for (let corner = 0; corner < 4; corner += 1) {
          const node = this.faces[4 * face + corner];
          for (let axis = 0; axis < 3; axis += 1) sums[3 * cell + axis] += frame.points[3 * node + axis];
        }
      }
    }
    for (let k = 0; k < sums.length; k += 1) sums[k] /= counts[Math.floor(k / 3)];
    return sums;
  }

  findExtent() {
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    for (const { points } of [this.first, this.last]) {
      for (const node of this.faces) {
        for (let axis = 0; axis < 3; axis += 1) {
          const x = points[3 * node + axis];
          if (x < low[axis]) low[axis] = x;
          if (x > high[axis]) high[axis] = x;
        }
      }
    }
    this.low = low;
    this.high = high;
    this.middle = low.map((x, axis) => (x + high[axis]) / 2);
    this.diagonal = Math.hypot(...low.map((x, axis) => high[axis] - x)) || 1;
    this.outline = this.placesOfSkin();
  }

  /** A place as it is drawn: from the middle, in diagonals, as graphics know only numbers from 1e-38 to 1e38. */
  drawn(place) {
    return [0, 1, 2].map((axis) => (place[axis] - this.middle[axis]) / this.diagonal);
  }

  /** Some hundred places of the skin, as they are drawn: what has to be in sight. */
  placesOfSkin() {
    const nodes = [];
    for (let face = 0; face < this.faceCount; face += 1) {
      if (this.sides[2 * face + 1] < 0) nodes.push(this.faces[4 * face], this.faces[4 * face + 2]);
    }
    const step = Math.max(1, Math.floor(nodes.length / 1500));
    const places = [];
    for (const { points } of [this.first, this.last]) {
      for (let k = 0; k < nodes.length; k += step) {
        places.push(this.drawn(points.subarray(3 * nodes[k], 3 * nodes[k] + 3)));
      }
    }
    return places;
  }

  /** Nodes of the faces of a cell, each once, and its faces. */
  around(cell) {
    const nodes = new Set();
    const faces = [];
    for (let face = 0; face < this.faceCount; face += 1) {
      if (this.sides[2 * face] === cell || this.sides[2 * face + 1] === cell) {
        faces.push(face);
        for (let corner = 0; corner < 4; corner += 1) nodes.add(this.faces[4 * face + corner]);
      }
    }
    return { nodes, faces };
  }

  /** The node in the middle of an edge, -1 where it has none. */
  middleOf(one, other) {
    if (this.middles === null) return -1;
    if (this.middleNodes === undefined) {
      this.middleNodes = new Map();
      for (let k = 0; k < this.faces.length; k += 1) {
        const next = (k & ~3) | ((k + 1) & 3);
        const middle = this.middles[5 * (k >> 2) + (k & 3)];
        if (middle >= 0) this.middleNodes.set(edgeKey(this.faces[k], this.faces[next]), middle);
      }
    }
    return this.middleNodes.get(edgeKey(one, other)) ?? -1;
  }

  /** Cells that share a node with a cell, itself among them. */
  neighbours(cell) {
    const { nodes } = this.around(cell);
    const found = new Set([cell]);
    for (let k = 0; k < this.faces.length; k += 1) {
      if (!nodes.has(this.faces[k])) continue;
      const face = k >> 2;
      for (const other of [this.sides[2 * face], this.sides[2 * face + 1]]) if (other >= 0) found.add(other);
    }
    return found;
  }

  /** Longest edge of the box around a cell. */
  sizeOf(cell, frame) {
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    for (const node of this.around(cell).nodes) {
      for (let axis = 0; axis < 3; axis += 1) {
        low[axis] = Math.min(low[axis], frame.points[3 * node + axis]);
        high[axis] = Math.max(high[axis], frame.points[3 * node + axis]);
      }
    }
    return Math.max(...low.map((x, axis) => high[axis] - x)) || this.diagonal / 100;
  }
}

/** A number for an edge, whichever of its nodes comes first. */
export function edgeKey(one, other) {
  return Math.min(one, other) * 2 ** 26 + Math.max(one, other);
}

/** The mesh at one time: its points, and arrays on cells and points by name. */
export class Frame {
  constructor(contents) {
    this.name = contents.name;
    this.position = contents.position;
    this.contents = contents;
    this.loading = null;
  }

  get loaded() {
    return this.points !== undefined;
  }

  load() {
    this.loading ??= this.decode();
    return this.loading;
  }

  async decode() {
    const arrays = { cell: {}, point: {} };
    for (const place of ["cell", "point"]) {
      for (const [name, reference] of Object.entries(this.contents[`${place}_arrays`])) {
        arrays[place][name] = { values: await decoded(reference), width: reference.shape[1] ?? 1 };
      }
    }
    this.arrays = arrays;
    this.points = await decoded(this.contents.points);
  }

  /** The values (m,) of an array on cells, undefined if the frame has none of that name. */
  cellValues(name) {
    return this.arrays.cell[name]?.values;
  }
}

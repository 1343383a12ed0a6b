// Geometry of faces: those between drawn and other cells, curved ones in small parts.

import { BufferAttribute, BufferGeometry } from "three";

import { edgeKey } from "./mesh.js";

const PARTS = 4; // of each side of a curved face
// Shares of corners and middles of sides in the centre, of faces of eight nodes and of triangles of six.
const OF_QUAD = [-0.25, -0.25, -0.25, -0.25, 0.5, 0.5, 0.5, 0.5];
const OF_TRIANGLE = [-0.125, -0.125, 0, 0, 0.25, 0.5, 0, 0.5];
const NONE = -1e30; // a value that is not there

/** Faces with a drawn cell on one side only, and that cell; where all are drawn those of the skin will do. */
export function facesOfDrawn(mesh, drawn, count) {
  if (count === mesh.count) return skinFaces(mesh);
  const faces = [];
  const owners = [];
  for (let face = 0; face < mesh.faceCount; face += 1) {
    const one = mesh.sides[2 * face];
    const other = mesh.sides[2 * face + 1];
    const first = drawn[one] === 1;
    const second = other >= 0 && drawn[other] === 1;
    if (first !== second) {
      faces.push(face);
      owners.push(first ? one : other);
    }
  }
  return { faces, owners };
}

/** Faces of the skin, and their cells. */
export function skinFaces(mesh) {
  const faces = [];
  const owners = [];
  for (let face = 0; face < mesh.faceCount; face += 1) {
    if (mesh.sides[2 * face + 1] < 0) {
      faces.push(face);
      owners.push(mesh.sides[2 * face]);
    }
  }
  return { faces, owners };
}

/** Faces between regions, and one of their cells. */
export function interfaceFaces(mesh) {
  const faces = [];
  const owners = [];
  if (mesh.regions === null) return { faces, owners };
  for (let face = 0; face < mesh.faceCount; face += 1) {
    const other = mesh.sides[2 * face + 1];
    if (other >= 0 && mesh.regions[mesh.sides[2 * face]] !== mesh.regions[other]) {
      faces.push(face);
      owners.push(mesh.sides[2 * face]);
    }
  }
  return { faces, owners };
}

/** Edges between regions of a surface, by their two nodes, one after the other. */
export function interfaceEdges(mesh) {
  const regionAt = new Map();
  const edges = [];
  for (let k = 0; k < mesh.faces.length; k += 1) {
    const cell = mesh.sides[2 * (k >> 2)];
    const one = mesh.faces[k];
    const other = mesh.faces[(k & ~3) | ((k + 1) & 3)];
    if (cell < 0 || one === other) continue;
    const key = edgeKey(one, other);
    const region = mesh.regions[cell];
    if (!regionAt.has(key)) regionAt.set(key, region);
    else if (regionAt.get(key) !== region) edges.push(one, other);
  }
  return edges;
}

/** Geometry of faces with a value at each vertex, that of their cell or, with place "point", of the node. */
export function geometryOf(mesh, frame, { faces, owners }, place, value) {
  const isCurved = (face) => mesh.middles !== null && mesh.middles[5 * face] >= 0;
  const curved = faces.reduce((count, face) => count + isCurved(face), 0);
  const target = new Target(mesh, frame, faces.length - curved, curved);
  const ofNodes = place === "point" && value !== null;
  for (let k = 0; k < faces.length; k += 1) {
    const ofCell = ofNodes || value === null || owners[k] < 0 ? NONE : shown(value(owners[k]));
    const valueOf = ofNodes && !lacksNode(mesh, faces[k], value) ? (node) => shown(value(node)) : () => ofCell;
    if (isCurved(faces[k])) target.addCurved(faces[k], owners[k], valueOf);
    else target.addFlat(faces[k], owners[k], valueOf);
  }
  return target.geometry();
}

/** Whether a node of a face has no value: the face then has none. */
function lacksNode(mesh, face, value) {
  return [0, 1, 2, 3].some((corner) => Number.isNaN(value(mesh.faces[4 * face + corner])));
}

/** As the shader takes it: no NaN, no infinity, and what is more than 0 stays so. */
function shown(x) {
  if (Number.isNaN(x)) return NONE;
  const bounded = Math.max(-1e29, Math.min(1e29, x));
  return bounded > 0 ? Math.max(bounded, 1e-30) : bounded;
}

// Where the corners of a face lie: 0 or 255 from each of its sides.
const QUAD_RIM = [0, 255, 0, 255, 255, 0, 0, 255, 255, 0, 255, 0, 0, 255, 255, 0];
const TRIANGLE_RIM = [255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255];
const NO_RIM = new Array(12).fill(255); // of triangles that are no cells, but stand for many

class Target {
  constructor(mesh, frame, flat, curved) {
    const vertices = 4 * flat + (PARTS + 1) ** 2 * curved;
    const triangles = 2 * flat + 2 * PARTS ** 2 * curved;
    this.mesh = mesh;
    this.points = frame.points;
    this.position = new Float32Array(3 * vertices);
    this.value = new Float32Array(vertices);
    this.rim = new Uint8Array(4 * vertices);
    this.index = new Uint32Array(3 * triangles);
    this.owners = new Int32Array(triangles);
    this.vertices = 0;
    this.triangles = 0;
  }

  vertex(x, y, z, value) {
    const { diagonal, middle } = this.mesh;
    const at = 3 * this.vertices;
    this.position[at] = (x - middle[0]) / diagonal;
    this.position[at + 1] = (y - middle[1]) / diagonal;
    this.position[at + 2] = (z - middle[2]) / diagonal;
    this.value[this.vertices] = value;
    this.vertices += 1;
  }

  triangle(a, b, c, owner) {
    this.index.set([a, b, c], 3 * this.triangles);
    this.owners[this.triangles] = owner;
    this.triangles += 1;
  }

  addFlat(face, owner, valueOf) {
    const { faces } = this.mesh;
    const { points } = this;
    const start = this.vertices;
    const isTriangle = faces[4 * face + 2] === faces[4 * face + 3];
    this.rim.set(owner < 0 ? NO_RIM : isTriangle ? TRIANGLE_RIM : QUAD_RIM, 4 * start);
    for (let corner = 0; corner < (isTriangle ? 3 : 4); corner += 1) {
      const node = faces[4 * face + corner];
      this.vertex(points[3 * node], points[3 * node + 1], points[3 * node + 2], valueOf(node));
    }
    this.triangle(start, start + 1, start + 2, owner);
    if (!isTriangle) this.triangle(start, start + 2, start + 3, owner);
  }

  addCurved(face, owner, valueOf) {
    const nodes = this.nineNodes(face, valueOf);
    const lacks = nodes.some(([, , , value]) => value === NONE);
    const start = this.vertices;
    for (let j = 0; j <= PARTS; j += 1) {
      for (let i = 0; i <= PARTS; i += 1) {
        const u = i / PARTS;
        const v = j / PARTS;
        const sum = [0, 0, 0, 0];
        lagrange(u, v).forEach((weight, k) => {
          for (let c = 0; c < 4; c += 1) sum[c] += weight * nodes[k][c];
        });
        this.rim.set([255 * u, 255 * (1 - u), 255 * v, 255 * (1 - v)].map(Math.round), 4 * this.vertices);
        this.vertex(sum[0], sum[1], sum[2], lacks ? NONE : sum[3]);
      }
    }
    for (let j = 0; j < PARTS; j += 1) {
      for (let i = 0; i < PARTS; i += 1) {
        const at = start + j * (PARTS + 1) + i;
        this.triangle(at, at + 1, at + PARTS + 2, owner);
        this.triangle(at, at + PARTS + 2, at + PARTS + 1, owner);
      }
    }
  }

  /**
   * Place and value at corners, middles of sides and centre of a face. The centre of eight nodes is a mean of these; a
   * triangle is a face with its last corner twice, and its centre another one.
   */
  nineNodes(face, valueOf) {
    const { faces, middles } = this.mesh;
    const at = (node) => [...this.points.subarray(3 * node, 3 * node + 3), valueOf(node)];
    const nodes = [0, 1, 2, 3].map((k) => at(faces[4 * face + k]));
    for (let k = 0; k < 4; k += 1) nodes.push(at(middles[5 * face + k]));
    const centre = middles[5 * face + 4];
    const weights = faces[4 * face + 2] === faces[4 * face + 3] ? OF_TRIANGLE : OF_QUAD;
    const mean = (c) => nodes.reduce((sum, node, k) => sum + weights[k] * node[c], 0);
    return [...nodes, centre >= 0 ? at(centre) : [0, 1, 2, 3].map(mean)];
  }

  geometry() {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(this.position.subarray(0, 3 * this.vertices), 3));
    geometry.setAttribute("value", new BufferAttribute(this.value.subarray(0, this.vertices), 1));
    geometry.setAttribute("rim", new BufferAttribute(this.rim.subarray(0, 4 * this.vertices), 4, true));
    geometry.setIndex(new BufferAttribute(this.index.subarray(0, 3 * this.triangles), 1));
    geometry.userData.owners = this.owners;
    return geometry;
  }
}

/** Shape functions of nine nodes: four corners, four middles of sides, the centre. */
function lagrange(u, v) {
  const along = (t) => [(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)];
  const a = along(u);
  const b = along(v);
  return [
    a[0] * b[0],
    a[2] * b[0],
    a[2] * b[2],
    a[0] * b[2],
    a[1] * b[0],
    a[2] * b[1],
    a[1] * b[2],
    a[0] * b[1],
    a[1] * b[1],
  ];
}

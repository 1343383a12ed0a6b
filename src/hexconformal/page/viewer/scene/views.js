// The views: each a frame of the mesh with what is drawn of it. All have one camera.

import { BufferAttribute, BufferGeometry, Group, Mesh as Drawing, Points, Scene } from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";

import { valuesOf } from "../mesh/colouring.js";
import { drawnCells, showsAll } from "../mesh/filters.js";
import { faceMaterial, pointMaterial } from "./materials.js";
import { facesOfDrawn, geometryOf, interfaceEdges, interfaceFaces, skinFaces } from "../mesh/surfaces.js";

const SEGMENTS = 6; // of a curved edge

export class View {
  constructor(mesh) {
    this.mesh = mesh;
    this.scene = new Scene();
    this.faces = new Drawing(new BufferGeometry(), faceMaterial());
    this.ghost = new Drawing(new BufferGeometry(), faceMaterial({ opacity: 0.07, edges: 0.5, offset: 2 }));
    this.between = new Drawing(new BufferGeometry(), faceMaterial({ opacity: 0.45, edges: 0.5, offset: 1.5 }));
    this.between.renderOrder = 1;
    this.ghost.renderOrder = 2;
    this.curves = lines(2.4);
    this.seams = lines(3.2);
    this.corners = new Points(new BufferGeometry(), pointMaterial(8));
    this.rim = lines(3);
    this.rim.material.depthTest = false;
    this.rim.renderOrder = 3;
    this.features = new Group();
    this.features.add(this.curves, this.corners);
    this.scene.add(this.faces, this.ghost, this.between, this.features, this.seams, this.rim);
    this.skin = skinFaces(mesh);
    this.interfaces = interfaceFaces(mesh);
    this.built = {};
    this.count = mesh.count;
  }

  /** Show a frame as the state says; only what has changed is built anew. */
  update(frame, state, colouring) {
    const { mesh } = this;
    const moved = this.frame !== frame;
    this.frame = frame;
    const { drawn, count } = drawnCells(mesh, state, frame);
    this.drawn = drawn;
    this.count = count;
    const chosen = valuesOf(mesh, frame, colouring);
    this.lacksValues = chosen === null;
    put(this.faces, geometryOf(mesh, frame, facesOfDrawn(mesh, drawn, count), colouring.place, chosen));
    const isCut = !showsAll(mesh, count);
    this.ghost.visible = isCut && state.ghost;
    this.between.visible = state.interfaces && this.interfaces.faces.length > 0;
    if (this.ghost.visible)
      this.once("ghost", moved, () => put(this.ghost, geometryOf(mesh, frame, this.skin, "", null)));
    if (this.between.visible) {
      this.once("between", moved, () => put(this.between, geometryOf(mesh, frame, this.interfaces, "", null)));
    }
    this.seams.visible = state.interfaces && mesh.layers === null;
    if (this.seams.visible) this.once("seams", moved, () => this.buildSeams());
    this.features.visible = state.features && mesh.featureEdges !== null;
    if (this.features.visible) this.once("features", moved, () => this.buildFeatures());
    this.rim.visible = state.focus >= 0;
    if (this.rim.visible) this.buildRim(state.focus);
  }

  /** Build a part unless it stands for this frame already. */
  once(name, moved, build) {
    if (moved) this.built = {};
    if (this.built[name]) return;
    build();
    this.built[name] = true;
  }

  /** Take the colours that the page has by name. */
  paint(colour) {
    this.faces.material.uniforms.plain.value.set(colour("--plain"));
    for (const part of [this.ghost, this.between]) {
      part.material.uniforms.plain.value.set(colour("--ghost"));
      part.material.uniforms.ink.value.set(colour("--ink"));
    }
    this.corners.material.uniforms.ink.value.set(colour("--ink"));
    this.curves.material.color.set(colour("--ink"));
    for (const drawing of [this.seams, this.rim]) drawing.material.color.set(colour("--accent"));
  }

  /** The samples per pixel, and the size of the picture: lines and points are as thick on the screen. */
  setPixels(ratio, width, height, turning) {
    this.ghost.material.uniforms.edges.value = turning ? 0 : 0.5;
    this.corners.material.uniforms.size.value = 8 * ratio;
    for (const drawing of [this.curves, this.seams, this.rim]) drawing.material.resolution.set(width, height);
    for (const part of [this.faces, this.ghost, this.between]) part.material.uniforms.width.value = ratio;
  }

  place(node) {
    return this.mesh.drawn(this.frame.points.subarray(3 * node, 3 * node + 3));
  }

  /** Curves between the regions of a surface. */
  buildSeams() {
    this.edgesBetween ??= interfaceEdges(this.mesh);
    this.setEdges(this.seams, this.edgesBetween);
  }

  setEdges(drawing, edges) {
    const places = [];
    for (let k = 0; k < edges.length; k += 2) this.addEdge(places, edges[k], edges[k + 1]);
    setLines(drawing, places);
  }

  buildFeatures() {
    const { featureEdges, featureCorners } = this.mesh;
    this.setEdges(this.curves, featureEdges);
    const corners = new Float32Array(Array.from(featureCorners, (node) => this.place(node)).flat());
    this.corners.geometry.dispose();
    this.corners.geometry = new BufferGeometry();
    this.corners.geometry.setAttribute("position", new BufferAttribute(corners, 3));
  }

  buildRim(cell) {
    const { mesh } = this;
    const places = [];
    for (const face of mesh.around(cell).faces) {
      for (let corner = 0; corner < 4; corner += 1) {
        const one = mesh.faces[4 * face + corner];
        const other = mesh.faces[4 * face + ((corner + 1) % 4)];
        if (one !== other) this.addEdge(places, one, other);
      }
    }
    setLines(this.rim, places);
  }

  /** Append the ends of the segments of an edge, which is a parabola where it has a node in its middle. */
  addEdge(places, one, other) {
    const middle = this.mesh.middleOf(one, other);
    const [start, end] = [this.place(one), this.place(other)];
    if (middle < 0) {
      places.push(...start, ...end);
      return;
    }
    const between = this.place(middle);
    const at = (t) =>
      start.map((x, axis) => (1 - t) * (1 - 2 * t) * x + 4 * t * (1 - t) * between[axis] + t * (2 * t - 1) * end[axis]);
    for (let k = 0; k < SEGMENTS; k += 1) places.push(...at(k / SEGMENTS), ...at((k + 1) / SEGMENTS));
  }
}

function lines(width) {
  const drawing = new LineSegments2(new LineSegmentsGeometry(), new LineMaterial({ linewidth: width }));
  drawing.frustumCulled = false;
  return drawing;
}

function setLines(drawing, places) {
  drawing.geometry.dispose();
  drawing.geometry = new LineSegmentsGeometry();
  drawing.geometry.setPositions(places.length > 0 ? places : [0, 0, 0, 0, 0, 0]);
}

function put(drawing, geometry) {
  drawing.geometry.dispose();
  drawing.geometry = geometry;
  drawing.frustumCulled = false;
}

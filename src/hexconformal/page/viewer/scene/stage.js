// The canvas with its camera: draws one view, two side by side, or one over the other with a divider.
// At rest there are two or more samples for each pixel of the screen; while it turns, as many as the machine can draw.

import { PerspectiveCamera, Vector3, WebGLRenderer } from "three";
import { TrackballControls } from "three/addons/controls/TrackballControls.js";

const UPWARDS = { x: [0, 0, 1], y: [0, 0, 1], z: [0, 1, 0] };
const SAMPLES = [0.35, 0.5, 0.7, 1, 2]; // per pixel along each side
const [SLOW, FAST] = [90, 25]; // milliseconds from one picture to the next
const REST = 160; // milliseconds after which the picture is drawn in full
const MARGIN = 1.12; // around the mesh
const FIRST_DIRECTION = [0.92, -1.0, 0.72]; // from the mesh to the camera, as in the pictures of `--picture`

export class Stage {
  constructor(canvas, mesh) {
    this.mesh = mesh;
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: false });
    this.renderer.setScissorTest(true);
    this.renderer.autoClear = false;
    this.renderer.outputColorSpace = "srgb-linear"; // colours are those of the maps, as they are
    this.camera = new PerspectiveCamera(28, 1, 0.01, 100);
    this.controls = new TrackballControls(this.camera, canvas);
    Object.assign(this.controls, { staticMoving: true, rotateSpeed: 2.4, zoomSpeed: 1.4, panSpeed: 0.5, keys: [] });
    this.parts = [];
    this.listeners = [];
    this.wanted = true;
    this.flight = null;
    this.frames = 0;
    this.level = SAMPLES.length - 2;
    this.drawnAt = -Infinity;
    this.held = false; // with the mouse
    this.controls.addEventListener("change", () => this.ask());
    this.controls.addEventListener("start", () => (this.held = true));
    this.controls.addEventListener("end", () => (this.held = false));
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
    this.fit(FIRST_DIRECTION, [0, 0, 1], false);
    const loop = (time) => {
      this.step(time);
      requestAnimationFrame(loop);
    };
    requestAnimationFrame(loop);
  }

  /** Draw before the screen is next refreshed. */
  ask() {
    this.wanted = true;
  }

  onDraw(listener) {
    this.listeners.push(listener);
  }

  /** Show parts: [{view, from, to, share}], a share of the width each, of a picture as wide as `share` of the canvas. */
  show(parts) {
    this.parts = parts;
    this.setAspect();
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.sampled = null;
    this.controls.handleResize();
    this.setAspect();
  }

  /** Take the shape of a part; in a narrower one the mesh is seen from farther away. */
  setAspect() {
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    const share = this.parts.length > 0 ? this.parts[0].share : 1;
    const distance = this.distanceToFit(this.direction(), this.camera.up);
    this.camera.aspect = (clientWidth * share) / clientHeight;
    this.camera.updateProjectionMatrix();
    const factor = this.distanceToFit(this.direction(), this.camera.up) / distance;
    const offset = this.camera.position.clone().sub(this.controls.target);
    this.camera.position.copy(this.controls.target).addScaledVector(offset, factor);
    this.ask();
  }

  step(time) {
    if (this.flight !== null) this.fly(time);
    this.controls.update();
    const since = time - this.drawnAt;
    if (this.wanted) {
      // Only pictures that follow each other tell how long one takes.
      if (since < 1000 && this.turning) this.adapt(since);
      this.turning = true;
      this.draw(this.level);
      this.drawnAt = time;
    } else if (this.turning && !this.held && since > REST) {
      this.turning = false;
      if (this.level < SAMPLES.length - 1) this.draw();
    }
  }

  adapt(took) {
    if (took > SLOW) this.level = Math.max(this.level - (took > 2 * SLOW ? 2 : 1), 0);
    else if (took < FAST) this.level = Math.min(this.level + 1, SAMPLES.length - 1);
  }

  /** So many samples per pixel; the last level is that of a picture at rest. */
  sample(level) {
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    const ratio = Math.min(Math.max(window.devicePixelRatio, 1), 2) * SAMPLES[level];
    if (this.sampled === ratio) return;
    this.sampled = ratio;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(clientWidth, clientHeight, false);
  }

  draw(level = SAMPLES.length - 1) {
    this.wanted = false;
    this.sample(level);
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    const far = this.camera.position.length() + 2;
    this.camera.near = Math.max(far * 1e-4, this.camera.position.distanceTo(this.controls.target) * 0.02);
    this.camera.far = far;
    this.camera.updateProjectionMatrix();
    for (const { view, from, to, share } of this.parts) {
      const left = share < 1 ? from * width : 0;
      this.renderer.setViewport(left, 0, share * width, height);
      this.renderer.setScissor(from * width, 0, (to - from) * width, height);
      this.renderer.clear();
      view.setPixels(this.sampled, share * width, height, level < SAMPLES.length - 1);
      this.renderer.render(view.scene, this.camera);
    }
    this.frames += 1;
    for (const listener of this.listeners) listener();
  }

  /** The part of the canvas at a place in pixels, and the place in its picture from -1 to 1. */
  at(x, y) {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    const part = this.parts.find(({ from, to }) => x >= from * width && x < to * width);
    if (!part) return null;
    const left = part.share < 1 ? part.from * width : 0;
    return { view: part.view, place: { x: (2 * (x - left)) / (part.share * width) - 1, y: 1 - (2 * y) / height } };
  }

  /** All of the mesh, seen along a direction. */
  fit(direction = null, up = null, flying = true) {
    const along = direction ? new Vector3(...direction).normalize() : this.direction();
    const upwards = up ? new Vector3(...up) : this.camera.up.clone();
    const distance = this.distanceToFit(along, upwards);
    this.goTo(along.multiplyScalar(distance), new Vector3(), upwards, flying);
  }

  /** Along an axis. */
  along(axis, sign = 1) {
    const direction = ["x", "y", "z"].map((name) => (name === axis ? sign : 0));
    this.fit(direction, UPWARDS[axis]);
  }

  /** Turn by angles to the right and upwards, as seen, and go so many times as far away. */
  turn(right, upwards, farther = 1) {
    const { position, up, matrixWorld } = this.camera;
    const { target } = this.controls;
    const offset = position.clone().sub(target).multiplyScalar(farther);
    const across = new Vector3().setFromMatrixColumn(matrixWorld, 0);
    const upright = new Vector3().setFromMatrixColumn(matrixWorld, 1);
    for (const turned of [offset, up]) turned.applyAxisAngle(upright, right).applyAxisAngle(across, -upwards);
    position.copy(target).add(offset);
    this.camera.lookAt(target);
    this.ask();
  }

  direction() {
    return this.camera.position.clone().sub(this.controls.target).normalize();
  }

  /** How far from its middle all of the mesh is in sight. */
  distanceToFit(along, upwards) {
    const right = new Vector3().crossVectors(upwards, along).normalize();
    const up = new Vector3().crossVectors(along, right);
    const tall = Math.tan((this.camera.fov * Math.PI) / 360);
    let distance = 0;
    const place = new Vector3();
    for (const given of this.mesh.outline) {
      place.set(...given);
      const aside = Math.max(Math.abs(place.dot(right)) / this.camera.aspect, Math.abs(place.dot(up)));
      distance = Math.max(distance, place.dot(along) + (MARGIN * aside) / tall);
    }
    return distance || 1;
  }

  distanceFor(radius) {
    const half = (this.camera.fov * Math.PI) / 360;
    const across = Math.atan(Math.tan(half) * Math.min(this.camera.aspect, 1));
    return (1.02 * radius) / Math.sin(across);
  }

  /** Close to a place of the mesh, which is seen with so much around it. */
  flyTo(place, radius) {
    const target = new Vector3(...this.mesh.drawn(place));
    const distance = this.distanceFor(radius / this.mesh.diagonal);
    const position = this.direction().multiplyScalar(distance).add(target);
    this.goTo(position, target, this.camera.up.clone(), true);
  }

  goTo(position, target, up, flying) {
    const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    const start = {
      position: this.camera.position.clone(),
      target: this.controls.target.clone(),
      up: this.camera.up.clone(),
    };
    this.flight = { start, position, target, up, began: null, time: flying && !still ? 600 : 0 };
    if (this.flight.time === 0) this.fly(0);
  }

  fly(time) {
    const { start, position, target, up } = this.flight;
    this.flight.began ??= time;
    const t = this.flight.time === 0 ? 1 : Math.min((time - this.flight.began) / this.flight.time, 1);
    const eased = t * t * (3 - 2 * t);
    // Round the target, not through the mesh.
    const offset = start.position.clone().sub(start.target);
    const end = position.clone().sub(target);
    const length = offset.length() * (1 - eased) + end.length() * eased;
    offset.normalize().lerp(end.clone().normalize(), eased);
    if (offset.length() < 1e-6) offset.copy(end);
    this.controls.target.lerpVectors(start.target, target, eased);
    this.camera.position.copy(this.controls.target).addScaledVector(offset.normalize(), length);
    this.camera.up.lerpVectors(start.up, up, eased).normalize();
    if (t === 1) {
      this.camera.position.copy(position);
      this.flight = null;
    }
    this.camera.lookAt(this.controls.target);
    this.ask();
  }
}

// The axes in a corner, as they are turned.

import { Vector3 } from "three";

import { h } from "../dom.js";

const AXES = [
  ["x", "#c8553d"],
  ["y", "#5b9a4f"],
  ["z", "#2a6f97"],
];

export class Axes {
  constructor(camera) {
    this.camera = camera;
    this.parts = AXES.map(([name, colour]) => ({
      line: h("line", { stroke: colour, "stroke-width": 2, x1: 0, y1: 0 }),
      text: h("text", { fill: colour, "text-anchor": "middle", "dominant-baseline": "central" }, name),
    }));
    const drawn = this.parts.map(({ line, text }) => [line, text]);
    this.element = h("svg", { class: "axes", viewBox: "-34 -34 68 68", "aria-hidden": "true" }, drawn);
  }

  show() {
    const turned = this.camera.quaternion.clone().invert();
    this.parts.forEach(({ line, text }, k) => {
      const tip = new Vector3().setComponent(k, 1).applyQuaternion(turned);
      line.setAttribute("x2", (22 * tip.x).toFixed(1));
      line.setAttribute("y2", (-22 * tip.y).toFixed(1));
      text.setAttribute("x", (29 * tip.x).toFixed(1));
      text.setAttribute("y", (-29 * tip.y).toFixed(1));
    });
  }
}

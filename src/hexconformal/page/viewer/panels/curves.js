// Curves over the iterations or steps of a run; a click chooses the frame there.

import { h, short } from "../dom.js";

const WIDTH = 300;
const HEIGHT = 90;

export class Curves {
  constructor(mesh, store) {
    this.mesh = mesh;
    this.panels = mesh.contents.curves.map((curve) => this.panel(curve, store));
    this.element = h(
      "div",
      { class: "curves" },
      this.panels.map((panel) => panel.element),
    );
  }

  panel(curve, store) {
    const low = curve.x[0];
    const high = curve.x[curve.x.length - 1];
    const across = (x) => (high > low ? ((x - low) / (high - low)) * WIDTH : WIDTH / 2);
    const marker = h("line", { class: "marker", y1: 0, y2: HEIGHT, x1: 0, x2: 0 });
    const values = curve.lines.flatMap((line) => line.y).filter((y) => y !== null && (!curve.log || y > 0));
    const ends = [Math.min(...values), Math.max(...values)];
    const scale = curve.log ? Math.log : (y) => y;
    let [bottom, top] = ends.map(scale);
    // What is constant up to rounding shows as a straight line.
    const least = curve.log ? 1e-3 : 1e-3 * Math.max(Math.abs(bottom), Math.abs(top), 1e-9);
    if (top - bottom < least) [bottom, top] = [(bottom + top - least) / 2, (bottom + top + least) / 2];
    const up = (y) => HEIGHT - 3 - ((scale(y) - bottom) / (top - bottom)) * (HEIGHT - 6);
    const lines = curve.lines.map((line, k) => {
      const points = line.y.map((y, i) =>
        y === null || (curve.log && y <= 0) ? null : `${across(curve.x[i]).toFixed(1)},${up(y).toFixed(1)}`,
      );
      return h("polyline", { class: `line line-${k}`, points: points.filter((point) => point !== null).join(" ") });
    });
    const svg = h(
      "svg",
      { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none", role: "img" },
      lines,
      marker,
    );
    svg.addEventListener("click", (event) => {
      const box = svg.getBoundingClientRect();
      const x = low + ((event.clientX - box.left) / box.width) * (high - low);
      const distance = (frame) => Math.abs(frame.position - x);
      const nearest = this.mesh.frames.reduce(
        (best, frame, k) => (distance(frame) < distance(this.mesh.frames[best]) ? k : best),
        0,
      );
      store.set({ frame: nearest });
    });
    const names =
      curve.lines.length > 1 ? curve.lines.map((line, k) => h("span", { class: `key line-${k}` }, line.name)) : [];
    const range =
      values.length > 0 ? `${short(ends[0])} to ${short(ends[1])}${curve.log ? ", logarithmic" : ""}` : "no values";
    const element = h(
      "section",
      { class: "curve" },
      h("header", {}, h("b", {}, curve.title), h("span", {}, names)),
      svg,
      h(
        "footer",
        {},
        h("span", {}, short(low)),
        h("span", {}, `${range}; over the ${curve.over}`),
        h("span", {}, short(high)),
      ),
    );
    return { element, marker, across };
  }

  show(frame) {
    for (const { marker, across } of this.panels) {
      const x = frame.position === null ? -1 : across(frame.position);
      marker.setAttribute("x1", x);
      marker.setAttribute("x2", x);
    }
  }
}

// Histograms of the measures before and after, each brushed to filter the cells.

import { h, short } from "../dom.js";

const WIDTH = 300;
const HEIGHT = 74;

export class Histograms {
  constructor(mesh, store) {
    this.store = store;
    const { measures, frames } = mesh.contents;
    this.panels = measures.map((measure) => new Panel(measure, frames.length > 1, store));
    const key = h(
      "p",
      { class: "figures" },
      h("span", { class: "before" }, "■ before"),
      h("span", { class: "after" }, "■ after"),
    );
    const hint = h(
      "p",
      { class: "hint" },
      "Drag over a histogram to leave only those cells; a double click ends that.",
    );
    this.element = h(
      "div",
      { class: "histograms" },
      hint,
      frames.length > 1 ? key : null,
      this.panels.map((panel) => panel.element),
    );
  }

  show(state) {
    for (const panel of this.panels) panel.show(state.brushes[panel.measure.name] ?? null);
  }
}

class Panel {
  constructor(measure, two, store) {
    this.measure = measure;
    this.store = store;
    this.low = measure.edges[0];
    this.high = measure.edges[measure.edges.length - 1];
    this.brush = h("rect", { class: "brush", y: 0, height: HEIGHT, width: 0 });
    this.note = h("span", { class: "brush-text" });
    const bars = [];
    const highest = Math.max(1, ...measure.before, ...measure.after);
    if (two) bars.push(h("path", { class: "before", d: outline(measure, measure.before, highest) }));
    bars.push(h("path", { class: "after", d: outline(measure, measure.after, highest) }));
    this.svg = h(
      "svg",
      { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none", "data-measure": measure.name, role: "img" },
      h("title", {}, `${measure.title}: number of cells`),
      this.brush,
      bars,
    );
    this.svg.addEventListener("pointerdown", (event) => this.begin(event));
    this.svg.addEventListener("dblclick", () => this.set(null));
    const figures = (name, one) =>
      h("span", { class: name }, `${short(one.min)} … ${short(one.mean)} … ${short(one.max)}`);
    const heads = [h("b", {}, measure.title)];
    const rows = two
      ? [figures("before", measure.figures.before), figures("after", measure.figures.after)]
      : [figures("after", measure.figures.after)];
    this.element = h(
      "section",
      { class: "histogram" },
      h("header", {}, heads, this.note),
      this.svg,
      h(
        "footer",
        {},
        h("span", {}, short(this.low)),
        h("span", {}, measure.scale === "log" ? "logarithmic" : ""),
        h("span", {}, short(this.high)),
      ),
      h("div", { class: "figures", title: "smallest … mean … largest" }, rows),
    );
  }

  toShare(value) {
    if (this.measure.scale === "log") return Math.log(value / this.low) / Math.log(this.high / this.low);
    return (value - this.low) / (this.high - this.low);
  }

  toValue(share) {
    if (this.measure.scale === "log") return this.low * (this.high / this.low) ** share;
    return this.low + share * (this.high - this.low);
  }

  begin(event) {
    const box = this.svg.getBoundingClientRect();
    const share = ({ clientX }) => Math.min(Math.max((clientX - box.left) / box.width, 0), 1);
    const start = share(event);
    this.svg.setPointerCapture(event.pointerId);
    const drag = (moved) => {
      const ends = [start, share(moved)].sort((a, b) => a - b);
      // The ends of the histogram are open: beyond are values that are not finite.
      const range = [ends[0] <= 0 ? -Infinity : this.toValue(ends[0]), ends[1] >= 1 ? Infinity : this.toValue(ends[1])];
      if (ends[1] - ends[0] > 0.01) this.set(range);
    };
    const end = () => {
      this.svg.removeEventListener("pointermove", drag);
      this.svg.removeEventListener("pointerup", end);
    };
    this.svg.addEventListener("pointermove", drag);
    this.svg.addEventListener("pointerup", end);
  }

  set(range) {
    const brushes = { ...this.store.state.brushes };
    if (range === null) delete brushes[this.measure.name];
    else brushes[this.measure.name] = range;
    this.store.set({ brushes });
  }

  show(range) {
    const shares = range === null ? [0, 0] : range.map((x, k) => (Number.isFinite(x) ? this.toShare(x) : k));
    this.brush.setAttribute("x", shares[0] * WIDTH);
    this.brush.setAttribute("width", Math.max(shares[1] - shares[0], 0) * WIDTH);
    this.note.textContent = range === null ? "" : `${short(range[0])} to ${short(range[1])}`;
  }
}

function outline(measure, counts, highest) {
  // Square roots: a few bad cells are to be seen beside many good ones.
  const height = (count) => HEIGHT - (HEIGHT - 4) * Math.sqrt(count / highest);
  const step = WIDTH / counts.length;
  const steps = counts.map((count, k) => `V${height(count).toFixed(1)}H${((k + 1) * step).toFixed(1)}`).join("");
  return `M0 ${HEIGHT}${steps}V${HEIGHT}Z`;
}

// The table of the worst cells; a click flies to one.

import { choice, h, select, short } from "../dom.js";

const ROWS = 50;

export class WorstCells {
  constructor(mesh, store, flyTo) {
    this.mesh = mesh;
    this.store = store;
    this.flyTo = flyTo;
    this.two = mesh.frames.length > 1;
    const ranked = mesh.contents.measures.filter((measure) => measure.best !== null);
    this.measure = select(
      "worst-measure",
      "measure",
      ranked.map((one) => [one.name, one.title]),
      store.state.thresholdMeasure,
      (name) => store.set({ thresholdMeasure: name, threshold: null }),
    );
    this.of = choice(
      "worst cells of",
      [
        ["before", "before"],
        ["after", "after"],
      ],
      "after",
      (worstOf) => store.set({ worstOf }),
    );
    this.body = h("tbody", { id: "worst-rows" });
    this.head = h("tr");
    const controls = h("div", { class: "row" }, this.measure, this.two ? this.of.element : null);
    const hint = h(
      "p",
      { class: "hint" },
      "A click flies to the cell and shows it with those behind it; Esc leads back.",
    );
    this.element = h("div", { class: "worst" }, controls, hint, h("table", {}, h("thead", {}, this.head), this.body));
  }

  show(state, shownFrame) {
    this.measure.value = state.thresholdMeasure;
    this.of.show(state.worstOf);
    const { mesh } = this;
    const measure = mesh.contents.measures.find((one) => one.name === state.thresholdMeasure);
    const after = shownFrame.cellValues(measure.name) ? shownFrame : mesh.last;
    const [frame, other] = state.worstOf === "before" ? [mesh.first, after] : [after, mesh.first];
    const values = frame.cellValues(measure.name);
    const others = this.two ? other.cellValues(measure.name) : null;
    const typed = mesh.contents.cells.type_names.length > 1;
    const told = this.two ? [state.worstOf, state.worstOf === "before" ? "after" : "before"] : ["value"];
    const heads = ["cell", ...told, ...(typed ? ["type"] : []), ...(mesh.regions ? ["region"] : [])];
    this.head.replaceChildren(...heads.map((text) => h("th", {}, text)));
    this.body.replaceChildren(
      ...worstOf(values, measure.best).map((cell) => {
        const cells = [
          h("td", {}, h("button", { type: "button", class: "link", "data-cell": cell }, String(mesh.label(cell)))),
          h("td", { class: "number", title: String(values[cell]) }, short(values[cell])),
          others ? h("td", { class: "number", title: String(others[cell]) }, short(others[cell])) : null,
          typed ? h("td", {}, mesh.type(cell)) : null,
          mesh.regions ? h("td", {}, mesh.contents.regions.names[mesh.regions[cell]]) : null,
        ];
        return h("tr", { class: cell === state.focus ? "chosen" : "", onclick: () => this.flyTo(cell, frame) }, cells);
      }),
    );
  }
}

/** The worst cells, worst first; those without a value are left out. */
export function worstOf(values, best, rows = ROWS) {
  const sign = best === "high" ? 1 : -1;
  const cells = Array.from({ length: values.length }, (_, cell) => cell).filter((cell) => !Number.isNaN(values[cell]));
  cells.sort((a, b) => sign * (values[a] < values[b] ? -1 : values[a] > values[b] ? 1 : 0) || a - b);
  return cells.slice(0, rows);
}

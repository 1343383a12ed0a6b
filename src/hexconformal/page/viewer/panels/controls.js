// The side panel's controls of the view: colours, worse cells, cut, layers, regions, lines.

import { ALL_CELLS } from "../choices.js";
import { check, choice, h, select, short } from "../dom.js";
import { regionColour } from "./legend.js";

export class Controls {
  constructor(mesh, store, all, viewDirection) {
    this.mesh = mesh;
    this.store = store;
    this.viewDirection = viewDirection;
    this.shown = []; // functions that bring an element in line with the state
    this.two = mesh.frames.length > 1;
    const reset = h(
      "button",
      { type: "button", id: "all-cells", onclick: () => store.set(ALL_CELLS) },
      "all cells again",
    );
    this.counts = h("div", { class: "counts", id: "counts" });
    this.element = h(
      "div",
      { class: "controls" },
      this.two ? this.section("Show", this.layouts()) : null,
      this.section("Colour", this.colours(all)),
      mesh.contents.measures.length > 0 ? this.section("Only the worse cells", this.threshold()) : null,
      mesh.layers === null ? null : this.section("Look inside", [this.cut(), this.peel()]),
      mesh.regions === null ? null : this.section("Regions", this.regions()),
      this.section("Lines", this.lines()),
      h("div", { class: "row" }, this.counts, reset),
    );
  }

  section(title, ...children) {
    return h("section", {}, h("h3", {}, title), children.flat());
  }

  show(state, counts) {
    for (const update of this.shown) update(state);
    this.counts.textContent = counts;
  }

  bound(id, text, name, title) {
    const made = check(id, text, this.store.state[name], (value) => this.store.set({ [name]: value }), title);
    this.shown.push((state) => (made.input.checked = state[name]));
    return made.element;
  }

  layouts() {
    const options = [
      ["before", "before", "1"],
      ["after", "after", "2"],
      ["both", "side by side", "3"],
      ["over", "over", "One over the other, with a divider (4)"],
    ];
    const made = choice("layout", options, this.store.state.layout, (layout) => this.store.set({ layout }));
    this.shown.push((state) => made.show(state.layout));
    return [made.element];
  }

  colours(all) {
    const { store, mesh } = this;
    const arrays = select(
      "colouring",
      "colour by",
      all.map((one) => [one.key, one.title]),
      store.state.colouring,
      (colouring) => store.set({ colouring, range: null }),
    );
    const maps = select(
      "map",
      "colour map",
      mesh.contents.maps.map(({ name }) => [name, name]),
      store.state.map,
      (map) => store.set({ map }),
    );
    this.shown.push((state) => {
      arrays.value = state.colouring;
      maps.value = state.map;
    });
    return [
      h("div", { class: "row" }, arrays),
      h("div", { class: "row" }, maps, this.bound("reversed", "reversed", "reversed")),
    ];
  }

  threshold() {
    const { store, mesh } = this;
    const ranked = mesh.contents.measures.filter((measure) => measure.best !== null);
    const measure = select(
      "threshold-measure",
      "measure",
      ranked.map((one) => [one.name, one.title]),
      store.state.thresholdMeasure,
      (name) => store.set({ thresholdMeasure: name, threshold: null }),
    );
    const slider = h("input", {
      type: "range",
      id: "threshold",
      min: 0,
      max: 1000,
      step: 1,
      "aria-label": "quality threshold",
    });
    const number = h("input", {
      type: "text",
      id: "threshold-value",
      inputMode: "decimal",
      "aria-label": "threshold",
      placeholder: "all",
    });
    const sign = h("span", { class: "sign" });
    slider.addEventListener("input", () => {
      const share = Number(slider.value) / 1000;
      store.set({ threshold: share >= 1 ? null : this.fromShare(share) });
    });
    number.addEventListener("change", () => {
      const typed = Number(number.value);
      store.set({ threshold: number.value.trim() === "" || !Number.isFinite(typed) ? null : typed });
    });
    const by = select(
      "chosen-by",
      "cells chosen by",
      [
        ["own", "each by its own values"],
        ["before", "those that were worse before"],
        ["after", "those that are worse after"],
      ],
      store.state.chosenBy,
      (chosenBy) => store.set({ chosenBy }),
    );
    this.shown.push((state) => {
      measure.value = state.thresholdMeasure;
      by.value = state.chosenBy;
      sign.textContent = this.best(state) === "high" ? "≤" : "≥";
      slider.value = state.threshold === null ? 1000 : Math.round(1000 * this.toShare(state.threshold));
      if (document.activeElement !== number)
        number.value = state.threshold === null ? "" : String(Number(state.threshold.toPrecision(12)));
    });
    return [
      h("div", { class: "row" }, measure, sign, number),
      slider,
      this.two ? h("div", { class: "row" }, by) : null,
    ];
  }

  best(state) {
    return this.mesh.contents.measures.find((one) => one.name === state.thresholdMeasure).best;
  }

  /** The ends of the slider: at its right all cells are drawn. */
  ends() {
    const { state } = this.store;
    let [low, high] = [Infinity, -Infinity];
    for (const frame of [this.mesh.first, this.mesh.last]) {
      for (const value of frame.cellValues(state.thresholdMeasure) ?? []) {
        if (!Number.isFinite(value)) continue;
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    return this.best(state) === "high" ? [low, high] : [high, low];
  }

  fromShare(share) {
    const [none, all] = this.ends();
    return none + share * (all - none);
  }

  toShare(value) {
    const [none, all] = this.ends();
    return none === all ? 1 : Math.min(Math.max((value - none) / (all - none), 0), 1);
  }

  cut() {
    const { store } = this;
    const normals = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
    const set = (axis) => {
      const seen = axis === "view" ? this.viewDirection() : normals[axis];
      store.set({ cut: true, cutAxis: axis, cutNormal: seen });
    };
    const axes = choice(
      "cut across",
      [
        ["x", "x"],
        ["y", "y"],
        ["z", "z"],
        ["view", "view", "Across the line of sight, as it is now"],
      ],
      "x",
      set,
    );
    const slider = h("input", {
      type: "range",
      id: "cut-position",
      min: 0,
      max: 1,
      step: 0.002,
      "aria-label": "place of the cut",
    });
    slider.addEventListener("input", () => store.set({ cut: true, cutPosition: Number(slider.value) }));
    this.shown.push((state) => {
      axes.show(state.cut ? state.cutAxis : "");
      slider.value = state.cutPosition;
    });
    const on = this.bound("cut", "cut", "cut", "Leave out whole cells on one side of a plane");
    return h(
      "div",
      {},
      h("div", { class: "row" }, on, axes.element, this.bound("cut-flipped", "flip", "cutFlipped")),
      slider,
    );
  }

  peel() {
    const slider = h("input", {
      type: "range",
      id: "peel",
      min: 0,
      max: this.mesh.mostLayers,
      step: 1,
      "aria-label": "layers that are peeled off",
    });
    const text = h("span", { class: "sign" });
    slider.addEventListener("input", () => this.store.set({ peel: Number(slider.value) }));
    this.shown.push((state) => {
      slider.value = state.peel;
      text.textContent = `${state.peel} of ${this.mesh.mostLayers + 1}`;
    });
    return h("div", {}, h("div", { class: "row" }, h("label", { htmlFor: "peel" }, "peel off layers"), text), slider);
  }

  regions() {
    const { store } = this;
    const { names } = this.mesh.contents.regions;
    const boxes = names.map((name, region) => {
      const made = check(`region-${region}`, name, true, (value) => {
        const hidden = new Set(store.state.hiddenRegions);
        if (value) hidden.delete(region);
        else hidden.add(region);
        store.set({ hiddenRegions: hidden });
      });
      made.element.prepend(h("i", { class: "dot", style: `background:${regionColour(region)}` }));
      this.shown.push((state) => (made.input.checked = !state.hiddenRegions.has(region)));
      return made.element;
    });
    return [h("div", { class: "regions" }, boxes), this.bound("interfaces", "interfaces between them", "interfaces")];
  }

  lines() {
    return [
      this.bound("edges", "mesh", "edges"),
      this.mesh.contents.features === null ? null : this.bound("features", "feature curves and corners", "features"),
      this.bound("ghost", "outline of what is left out", "ghost"),
    ];
  }
}

/** Numbers of cells drawn, in words. */
export function countsText(mesh, views) {
  const total = mesh.count;
  const all = views.every((view) => view.count === total);
  const cells = mesh.contents.cells.total > total ? "cells that this page has" : "cells";
  if (all) return `all ${short(total)} ${cells}`;
  const counts = [...new Set(views.map((view) => short(view.count)))];
  return `${counts.join(" and ")} of ${short(total)} ${cells}`;
}

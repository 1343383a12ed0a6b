// The legend: colours with their range, which can be typed in; regions by name.

import { REGION_COLOURS, dataRange, naturalRange } from "../mesh/colouring.js";
import { h, short } from "../dom.js";

export function regionColour(region) {
  return REGION_COLOURS[region % REGION_COLOURS.length];
}

/** The bytes of the colours of regions. */
export function regionBytes() {
  return REGION_COLOURS.flatMap((colour) => [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16)));
}

/** The bytes (3 k) of a colour map of the page. */
export function mapBytes(contents, name, reversed) {
  const { colours } = contents.maps.find((one) => one.name === name);
  const bytes = Uint8Array.from(atob(colours), (letter) => letter.charCodeAt(0));
  if (!reversed) return bytes;
  const count = bytes.length / 3;
  return bytes.map((_, k) => bytes[3 * (count - 1 - Math.floor(k / 3)) + (k % 3)]);
}

export class Legend {
  constructor(mesh, store) {
    this.mesh = mesh;
    this.store = store;
    this.title = h("div", { class: "legend-title" });
    this.bar = h("canvas", { width: 256, height: 1, class: "legend-bar" });
    const end = (label, k) =>
      h("input", {
        type: "text",
        inputMode: "decimal",
        "aria-label": label,
        onchange: (event) => this.type(k, event.target),
      });
    this.ends = [end("colours from", 0), end("colours to", 1)];
    const fit = h(
      "button",
      { type: "button", title: "Colours over the values that there are", onclick: () => this.fit() },
      "fit",
    );
    const reset = h(
      "button",
      { type: "button", title: "The range at first", onclick: () => store.set({ range: null }) },
      "reset",
    );
    this.scale = h("div", { class: "legend-scale" }, this.ends[0], fit, reset, this.ends[1]);
    this.more = h("div", { class: "legend-more" });
    this.element = h("div", { class: "legend", id: "legend" }, this.title, this.bar, this.scale, this.more);
  }

  fit() {
    this.store.set({ range: dataRange(this.mesh, [this.mesh.first, this.mesh.last], this.colouring) });
  }

  type(k, input) {
    const typed = Number(input.value);
    const range = [...rangeOf(this.mesh, this.store.state, this.colouring)];
    if (input.value.trim() !== "" && Number.isFinite(typed)) range[k] = typed;
    this.store.set({ range });
  }

  show(state, colouring, marksFolded) {
    this.colouring = colouring;
    const ofRegions = colouring.place === "regions";
    this.title.textContent = colouring.title;
    this.bar.hidden = ofRegions;
    this.scale.hidden = ofRegions;
    this.more.replaceChildren();
    if (ofRegions) {
      const names = this.mesh.contents.regions.names;
      this.more.append(...names.slice(0, 24).map((name, k) => swatch(regionColour(k), name)));
      return;
    }
    const bytes = mapBytes(this.mesh.contents, state.map, state.reversed);
    const context = this.bar.getContext("2d");
    const pixels = context.createImageData(256, 1);
    for (let k = 0; k < 256; k += 1) {
      const from = 3 * Math.round((k / 255) * (bytes.length / 3 - 1));
      pixels.data.set([bytes[from], bytes[from + 1], bytes[from + 2], 255], 4 * k);
    }
    context.putImageData(pixels, 0, 0);
    const range = rangeOf(this.mesh, state, colouring);
    this.ends.forEach((input, k) => (input.value = short(range[k]).replaceAll(",", "")));
    if (marksFolded) this.more.append(swatch("#7b1fa2", "0 or less: inverted"));
  }
}

/** The range that colours stand for now. */
export function rangeOf(mesh, state, colouring) {
  return state.range ?? naturalRange(mesh, colouring);
}

function swatch(colour, text) {
  return h("span", { class: "swatch" }, h("i", { style: `background:${colour}` }), text);
}

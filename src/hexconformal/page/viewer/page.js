// The page: puts the parts together, and keeps them in line with what is chosen.

import { Axes } from "./scene/axes.js";
import { firstState } from "./choices.js";
import { colourings } from "./mesh/colouring.js";
import { Controls, countsText } from "./panels/controls.js";
import { Curves } from "./panels/curves.js";
import { choice, h, short } from "./dom.js";
import { Histograms } from "./panels/histograms.js";
import { help, keysOf, listen } from "./panels/keyboard.js";
import { Legend, mapBytes, rangeOf, regionBytes } from "./panels/legend.js";
import { mapTexture } from "./scene/materials.js";
import { card } from "./scene/picking.js";
import { picture, save } from "./scene/picture.js";
import { report } from "./panels/report.js";
import { Stage } from "./scene/stage.js";
import { listenToMouse } from "./mouse.js";
import { createStore } from "./store.js";
import { View } from "./scene/views.js";
import { WorstCells, worstOf } from "./panels/worst.js";

const VIEW_KEYS = [
  "frame",
  "colouring",
  "hiddenRegions",
  "peel",
  "cut",
  "cutNormal",
  "cutPosition",
  "cutFlipped",
  "threshold",
  "thresholdMeasure",
  "chosenBy",
  "brushes",
  "focus",
  "nest",
  "ghost",
  "features",
  "interfaces",
  "layout",
];

export class Page {
  constructor(mesh) {
    this.mesh = mesh;
    this.contents = mesh.contents;
    this.store = createStore(firstState(mesh));
    this.all = colourings(mesh);
    this.canvas = h("canvas", { class: "stage", tabIndex: 0, "aria-label": "the mesh" });
    this.place = h("main", {}, this.canvas);
    this.build();
    this.stage = new Stage(this.canvas, mesh);
    this.views = { before: new View(mesh), after: new View(mesh) };
    this.axes = new Axes(this.stage.camera);
    this.place.append(this.axes.element);
    this.stage.onDraw(() => this.axes.show());
    this.store.subscribe((changed, state) => this.update(changed, state));
    listenToMouse(this);
    this.setTheme();
    this.update(new Set(Object.keys(this.store.state)), this.store.state);
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.setTheme());
  }

  get frame() {
    return this.mesh.frames[this.store.state.frame];
  }

  get colouring() {
    return this.all.find((one) => one.key === this.store.state.colouring);
  }

  build() {
    const { mesh, store, contents } = this;
    this.legend = new Legend(mesh, store);
    this.labels = [h("div", { class: "label", id: "label-before" }), h("div", { class: "label", id: "label-after" })];
    this.divider = h("div", { class: "divider", title: "drag" });
    this.card = h("div", { class: "card-place" });
    this.helpPlace = h("div");
    this.controls = new Controls(mesh, store, this.all, () => this.stage.direction().toArray());
    this.histograms = new Histograms(mesh, store);
    this.curves = new Curves(mesh, store);
    this.worst = new WorstCells(mesh, store, (cell, frame) => this.flyTo(cell, frame));
    this.panels = {
      view: this.controls.element,
      quality: h("div", {}, this.histograms.element),
      worst: this.worst.element,
      run: h("div", {}, this.curves.element),
      report: report(contents),
    };
    const tabs = [
      ["view", "View"],
      ["quality", "Quality"],
      ["worst", "Worst cells"],
      ["run", "Run"],
      ["report", "Report"],
    ];
    const present = tabs.filter(([name]) => name !== "run" || contents.curves.length > 0);
    this.tabs = choice("panel", present, store.state.panel, (panel) => store.set({ panel }));
    this.side = h("aside", {}, this.tabs.element, Object.values(this.panels));
    const button = (id, text, title, action) => h("button", { type: "button", id, title, onclick: action }, text);
    const head = h(
      "header",
      { class: "top" },
      h("h1", {}, contents.title),
      h("span", { class: "subtitle" }, contents.subtitle),
      h("span", { class: "space" }),
      button("picture", "picture", "Save a picture (p)", () => this.savePicture()),
      button("theme", "light / dark", "Light or dark (t)", () => this.switchTheme()),
      button("keys", "?", "Keys (?)", () => store.set({ helpShown: !store.state.helpShown })),
      button("panel", "☰", "Side panel (b)", () => store.set({ panelShown: !store.state.panelShown })),
    );
    const remark =
      contents.remarks.length > 0 ? h("div", { class: "remark banner" }, contents.remarks.join(" ")) : null;
    this.place.append(...[...this.labels, this.legend.element, this.divider, remark, this.card].filter(Boolean));
    const body = h("div", { class: "body" }, h("div", { class: "middle" }, this.place, this.frameBar()), this.side);
    document.body.replaceChildren(head, body, this.helpPlace);
    this.keys = keysOf(mesh, store, this.actions());
    listen(this.keys);
  }

  frameBar() {
    const { mesh, store } = this;
    if (mesh.frames.length < 3) return null;
    this.slider = h("input", {
      type: "range",
      id: "frame",
      min: 0,
      max: mesh.frames.length - 1,
      step: 1,
      "aria-label": "frame",
    });
    this.slider.addEventListener("input", () => store.set({ frame: Number(this.slider.value) }));
    this.frameName = h("span", { class: "frame-name" });
    this.player = h("button", { type: "button", id: "play", title: "Play (space)", onclick: () => this.play() }, "▶");
    return h("div", { class: "frames" }, this.player, this.slider, this.frameName);
  }

  actions() {
    const { mesh, store } = this;
    return {
      stepFrame: (by) => store.set({ frame: Math.min(Math.max(store.state.frame + by, 0), mesh.frames.length - 1) }),
      play: () => this.play(),
      along: (key) => this.stage.along(key.toLowerCase(), key === key.toLowerCase() ? 1 : -1),
      fit: () => this.stage.fit(),
      turn: (...how) => this.stage.turn(...how),
      worst: () => this.flyToWorst(),
      nextColouring: () => {
        const at = this.all.findIndex((one) => one.key === store.state.colouring);
        store.set({ colouring: this.all[(at + 1) % this.all.length].key, range: null });
      },
      theme: () => this.switchTheme(),
      picture: () => this.savePicture(),
    };
  }

  update(changed, state) {
    const touches = (...names) => names.some((name) => changed.has(name));
    if (touches("frame") && !this.frame.loaded) {
      this.frame.load().then(() => this.update(changed, this.store.state));
      return;
    }
    if (touches(...VIEW_KEYS)) this.updateViews(state);
    if (touches("edges", "map", "reversed", "range", "colouring", "theme", ...VIEW_KEYS)) this.updateColours(state);
    if (touches("layout", "divider")) this.arrange(state);
    if (touches("panel", "panelShown")) this.showPanel(state);
    if (touches("brushes")) this.histograms.show(state);
    if (state.panel === "worst" && touches("panel", "thresholdMeasure", "worstOf", "focus", "frame")) {
      this.worst.show(state, this.frame);
    }
    if (touches("frame")) this.showFrame(state);
    if (touches("helpShown")) {
      this.helpPlace.replaceChildren(
        ...(state.helpShown ? [help(this.keys, () => this.store.set({ helpShown: false }))] : []),
      );
    }
    const shown = this.stage.parts.map(({ view }) => view);
    this.controls.show(state, countsText(this.mesh, shown));
    this.stage.ask();
  }

  updateViews(state) {
    const { before, after } = this.views;
    if (state.layout !== "after") before.update(this.mesh.first, state, this.colouring);
    if (state.layout !== "before") after.update(this.frame, state, this.colouring);
    this.showLabels();
  }

  updateColours(state) {
    const { colouring, mesh } = this;
    const ofRegions = colouring.place === "regions";
    const folded = colouring.measure?.folded_at_zero === true;
    const bytes = ofRegions ? regionBytes() : mapBytes(this.contents, state.map, state.reversed);
    const key = `${ofRegions} ${state.map} ${state.reversed}`;
    if (key !== this.mapKey) {
      this.texture?.dispose();
      this.texture = mapTexture(bytes, ofRegions);
      this.mapKey = key;
    }
    const count = bytes.length / 3;
    const range = ofRegions ? [-0.5, count - 0.5] : rangeOf(mesh, state, colouring);
    let anyFolded = false;
    const style = getComputedStyle(document.body);
    for (const view of Object.values(this.views)) {
      const { uniforms } = view.faces.material;
      uniforms.map.value = this.texture;
      uniforms.range.value.set(...range);
      uniforms.marksFolded.value = folded ? 1 : 0;
      uniforms.edges.value = state.edges ? 0.62 : 0;
      view.paint((name) => style.getPropertyValue(name).trim());
    }
    if (folded) {
      for (const frame of [mesh.first, this.frame])
        anyFolded ||= frame.cellValues(colouring.name)?.some((x) => x <= 0) ?? false;
    }
    this.legend.show(state, colouring, anyFolded);
  }

  arrange({ layout, divider }) {
    const { before, after } = this.views;
    const parts = {
      before: [{ view: before, from: 0, to: 1, share: 1 }],
      after: [{ view: after, from: 0, to: 1, share: 1 }],
      both: [
        { view: before, from: 0, to: 0.5, share: 0.5 },
        { view: after, from: 0.5, to: 1, share: 0.5 },
      ],
      over: [
        { view: before, from: 0, to: divider, share: 1 },
        { view: after, from: divider, to: 1, share: 1 },
      ],
    }[layout];
    this.stage.show(parts);
    this.divider.hidden = parts.length < 2;
    this.divider.classList.toggle("movable", layout === "over");
    this.divider.style.left = `${100 * (layout === "over" ? divider : 0.5)}%`;
    this.showLabels();
  }

  showLabels() {
    const { state } = this.store;
    const of = { before: [this.mesh.first, this.views.before], after: [this.frame, this.views.after] };
    const starts = { before: state.layout !== "after", after: state.layout !== "before" };
    this.titles = [];
    for (const [k, name] of ["before", "after"].entries()) {
      const [frame, view] = of[name];
      this.labels[k].hidden = !starts[name];
      if (!starts[name]) continue;
      const from =
        name === "after" && state.layout === "both"
          ? 0.5
          : name === "after" && state.layout === "over"
            ? state.divider
            : 0;
      const lines = [frame.name, `${short(view.count)} of ${short(this.mesh.count)} cells`];
      if (view.lacksValues) lines.push(`without ${this.colouring.title}`);
      this.labels[k].replaceChildren(h("b", {}, lines[0]), ...lines.slice(1).map((line) => h("span", {}, line)));
      this.labels[k].style.left = `calc(${100 * from}% + 12px)`;
      this.labels[k].dataset.count = view.count;
      this.titles.push({ from, lines });
    }
  }

  showPanel({ panel, panelShown }) {
    this.tabs.show(panel);
    for (const [name, element] of Object.entries(this.panels)) element.hidden = name !== panel;
    this.side.hidden = !panelShown;
  }

  showFrame({ frame }) {
    this.curves.show(this.frame);
    if (!this.slider) return;
    this.slider.value = frame;
    this.frameName.textContent = this.frame.name;
  }

  play() {
    const { mesh, store } = this;
    if (mesh.frames.length < 3) return;
    if (this.playing) {
      clearInterval(this.playing);
      this.playing = null;
    } else {
      const step = () => store.set({ frame: (store.state.frame + 1) % mesh.frames.length });
      this.playing = setInterval(step, 300);
    }
    this.player.textContent = this.playing ? "❚❚" : "▶";
  }

  flyTo(cell, frame) {
    const place = Array.from(this.mesh.centresIn(frame).subarray(3 * cell, 3 * cell + 3));
    this.stage.flyTo(place, 2.2 * this.mesh.sizeOf(cell, frame));
    this.store.set({ focus: cell, nest: this.nestOf(cell) });
    this.showCard(cell, frame);
  }

  /** A cell with those around it that do not hide it: of a surface none does. */
  nestOf(cell) {
    const { centres } = this.mesh;
    if (this.mesh.layers === null) return this.mesh.neighbours(cell);
    const towards = this.stage.direction().toArray();
    const height = (one) => towards.reduce((sum, x, axis) => sum + x * centres[3 * one + axis], 0);
    const nest = [...this.mesh.neighbours(cell)].filter((other) => other === cell || height(other) < height(cell));
    return new Set(nest);
  }

  flyToWorst() {
    const { state } = this.store;
    const measure = this.contents.measures.find((one) => one.name === state.thresholdMeasure);
    const wanted = state.layout === "before" ? this.mesh.first : this.frame;
    const frame = wanted.cellValues(measure.name) ? wanted : this.mesh.last;
    const [cell] = worstOf(frame.cellValues(measure.name), measure.best, 1);
    if (cell !== undefined) this.flyTo(cell, frame);
  }

  showCard(cell, frame) {
    const close = () => this.card.replaceChildren();
    this.card.replaceChildren(card(this.mesh, frame, cell, { close, flyTo: (one, of) => this.flyTo(one, of) }));
  }

  get isDark() {
    return (
      (this.store.state.theme ?? (window.matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light")) ===
      "dark"
    );
  }

  switchTheme() {
    this.store.set({ theme: this.isDark ? "light" : "dark" });
    this.setTheme();
  }

  setTheme() {
    document.documentElement.dataset.theme = this.isDark ? "dark" : "light";
    this.stage.renderer.setClearColor(getComputedStyle(document.body).getPropertyValue("--ground").trim());
    this.updateColours(this.store.state);
    this.stage.ask();
  }

  savePicture() {
    const width = this.canvas.clientWidth;
    const titles = this.titles.map(({ from, lines }) => ({ left: from * width, lines }));
    save(picture(this.stage, titles, this.legend), `${this.contents.title.replace(/[^\w.-]+/g, "_")}.png`);
  }
}

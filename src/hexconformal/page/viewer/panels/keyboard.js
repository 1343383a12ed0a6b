// Keys, and the list of them.

import { ALL_CELLS } from "../choices.js";
import { h } from "../dom.js";

const ANGLE = Math.PI / 18;
// The way the camera goes: the mesh turns the other way, that of the arrow.
const TURNS = { ArrowLeft: [ANGLE, 0], ArrowRight: [-ANGLE, 0], ArrowUp: [0, -ANGLE], ArrowDown: [0, ANGLE] };

/** [keys, what they do, action] */
export function keysOf(mesh, store, actions) {
  const toggle = (name) => () => store.set({ [name]: !store.state[name] });
  const layouts =
    mesh.frames.length > 1
      ? [
          [["1"], "before", () => store.set({ layout: "before" })],
          [["2"], "after", () => store.set({ layout: "after" })],
          [["3"], "side by side", () => store.set({ layout: "both" })],
          [["4"], "one over the other", () => store.set({ layout: "over" })],
        ]
      : [];
  const frames =
    mesh.frames.length > 2
      ? [
          [["."], "next frame", () => actions.stepFrame(1)],
          [[","], "frame before", () => actions.stepFrame(-1)],
          [[" "], "play", actions.play],
        ]
      : [];
  const volume =
    mesh.layers === null
      ? []
      : [
          [["]"], "peel a layer", () => store.set({ peel: Math.min(store.state.peel + 1, mesh.mostLayers) })],
          [["["], "put a layer back", () => store.set({ peel: Math.max(store.state.peel - 1, 0) })],
          [["k"], "cutting plane", toggle("cut")],
        ];
  return [
    ...layouts,
    [["x", "y", "z"], "look along an axis; with shift from the other side", (event) => actions.along(event.key)],
    [["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"], "turn", (event) => actions.turn(...TURNS[event.key])],
    [["+", "-"], "closer, farther", (event) => actions.turn(0, 0, event.key === "+" ? 0.8 : 1.25)],
    [["f"], "fit", actions.fit],
    ...frames,
    ...volume,
    [["w"], "fly to the worst cell", actions.worst],
    [["c"], "colour by the next array", actions.nextColouring],
    [["e"], "lines of the mesh", toggle("edges")],
    [["g"], "outline of what is left out", toggle("ghost")],
    [["l"], "feature curves and corners", toggle("features")],
    [["t"], "light or dark", actions.theme],
    [["b"], "side panel", toggle("panelShown")],
    [["p"], "save a picture", actions.picture],
    [["Escape"], "all cells again", () => store.set({ ...ALL_CELLS, helpShown: false })],
    [["?"], "these keys", toggle("helpShown")],
  ];
}

export function listen(keys) {
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { target } = event;
    const typing = target.matches?.("input[type=text], select, textarea");
    const sliding = target.matches?.("input[type=range]") && event.key.startsWith("Arrow");
    const pressing = target.matches?.("button, input[type=checkbox]") && event.key === " ";
    if (event.key === "Escape") target.blur?.(); // arrows turn the mesh again
    if (typing || sliding || pressing) return;
    const found = keys.find(([names]) => names.includes(event.key) || names.includes(event.key.toLowerCase()));
    if (!found) return;
    event.preventDefault();
    found[2](event);
  });
}

const WORDS = { ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓", " ": "space", Escape: "Esc" };

export function help(keys, close) {
  const rows = keys.map(([names, text]) =>
    h(
      "tr",
      {},
      h(
        "td",
        {},
        names.map((name) => h("kbd", {}, WORDS[name] ?? name)),
      ),
      h("td", {}, text),
    ),
  );
  const mouse = [
    ["drag", "turn"],
    ["wheel, or drag with the middle button", "closer, farther"],
    ["drag with the right button", "move"],
    ["click on a cell", "its values"],
    ["double click on a cell", "fly there"],
  ].map(([what, text]) => h("tr", {}, h("td", {}, what), h("td", {}, text)));
  return h(
    "div",
    { class: "help", role: "dialog", "aria-label": "keys" },
    h("button", { type: "button", class: "close", title: "Close", onclick: close }, "×"),
    h("h3", {}, "Keys"),
    h("table", {}, rows),
    h("h3", {}, "Mouse"),
    h("table", {}, mouse),
  );
}

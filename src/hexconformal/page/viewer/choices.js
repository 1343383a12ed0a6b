// What a page shows at first.

import { colourings } from "./mesh/colouring.js";

/** The first state of a page. */
export function firstState(mesh) {
  const { contents } = mesh;
  const all = colourings(mesh);
  const worst = all.find((one) => one.place === "cell" && one.name === contents.worst_measure);
  return {
    layout: mesh.frames.length > 1 ? "both" : "after",
    divider: 0.5,
    frame: mesh.frames.length - 1,
    colouring: (worst ?? all[0]).key,
    map: contents.maps[0].name,
    reversed: false,
    range: null, // that which the colouring has by nature
    edges: true,
    ghost: true,
    features: contents.features !== null,
    interfaces: false,
    hiddenRegions: new Set(),
    peel: 0,
    cut: false,
    cutAxis: "x",
    cutNormal: [1, 0, 0],
    cutPosition: 0.5,
    cutFlipped: false,
    threshold: null,
    thresholdMeasure: contents.worst_measure,
    chosenBy: "own",
    brushes: {},
    focus: -1,
    nest: new Set(),
    worstOf: "after",
    theme: null, // that of the system
    panel: "view",
    panelShown: window.innerWidth > 760,
    helpShown: false,
  };
}

/** What `Esc` and the button for all cells bring back. */
export const ALL_CELLS = { hiddenRegions: new Set(), peel: 0, cut: false, threshold: null, brushes: {}, focus: -1 };

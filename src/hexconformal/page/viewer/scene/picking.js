// The cell at a place of the canvas, and what is known of it.

import { Raycaster } from "three";

import { exact, h } from "../dom.js";

const ray = new Raycaster();

/** The cell that is seen at pixels (x, y), -1 where there is none. */
export function cellAt(stage, x, y) {
  const found = stage.at(x, y);
  if (found === null) return { cell: -1, view: null };
  ray.setFromCamera(found.place, stage.camera);
  const [hit] = ray.intersectObject(found.view.faces, false);
  return { cell: hit ? found.view.faces.geometry.userData.owners[hit.faceIndex] : -1, view: found.view };
}

/** A card with all values of a cell in a frame, with all their digits. */
export function card(mesh, frame, cell, actions) {
  const rows = Object.entries(frame.arrays.cell).map(([name, { values, width }]) => {
    const numbers = Array.from(values.subarray(width * cell, width * (cell + 1)), exact);
    return h("tr", {}, h("th", {}, name.replaceAll("_", " ")), h("td", {}, numbers.join(", ")));
  });
  if (mesh.regions !== null) {
    rows.unshift(h("tr", {}, h("th", {}, "region"), h("td", {}, mesh.contents.regions.names[mesh.regions[cell]])));
  }
  return h(
    "div",
    { class: "card" },
    h("button", { type: "button", class: "close", title: "Close", onclick: actions.close }, "×"),
    h("h3", {}, `${mesh.type(cell)} ${mesh.label(cell)}`),
    h("p", { class: "hint" }, frame.name),
    h("table", {}, rows),
    h("button", { type: "button", onclick: () => actions.flyTo(cell, frame) }, "fly there"),
  );
}

// The mouse on the mesh: a click tells of a cell, a double click flies there; the divider is dragged.

import { cellAt } from "./scene/picking.js";

/** Listen on the canvas and the divider of a page. */
export function listenToMouse(page) {
  let pressed = null;
  const place = (event) => {
    const box = page.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  page.canvas.addEventListener("pointerdown", (event) => (pressed = place(event)));
  page.canvas.addEventListener("pointerup", (event) => {
    const at = place(event);
    if (pressed === null || event.button !== 0 || Math.hypot(at[0] - pressed[0], at[1] - pressed[1]) > 4) return;
    const { cell, view } = cellAt(page.stage, ...at);
    if (cell >= 0) page.showCard(cell, view.frame);
    else page.card.replaceChildren();
  });
  page.canvas.addEventListener("dblclick", (event) => {
    const { cell, view } = cellAt(page.stage, ...place(event));
    if (cell >= 0) page.flyTo(cell, view.frame);
  });
  page.divider.addEventListener("pointerdown", (event) => {
    page.divider.setPointerCapture(event.pointerId);
    const drag = (moved) =>
      page.store.set({ divider: Math.min(Math.max(place(moved)[0] / page.canvas.clientWidth, 0.02), 0.98) });
    page.divider.addEventListener("pointermove", drag);
    page.divider.addEventListener("pointerup", () => page.divider.removeEventListener("pointermove", drag), {
      once: true,
    });
  });
}

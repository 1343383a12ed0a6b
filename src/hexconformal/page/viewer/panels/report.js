// What the report says: its text, notes, options, the versions.

import { h } from "../dom.js";

export function report(contents) {
  const { text, notes, options } = contents.report;
  const word = (given) => (given === null ? "none" : String(given));
  const value = (given) => (given !== null && typeof given === "object" ? JSON.stringify(given) : word(given));
  const rows = Object.entries(options).map(([name, given]) =>
    h("tr", {}, h("th", {}, name), h("td", {}, value(given))),
  );
  return h(
    "div",
    { class: "report" },
    contents.remarks.map((remark) => h("p", { class: "remark" }, remark)),
    notes.length > 0
      ? [
          h("h3", {}, "Notes"),
          h(
            "ul",
            {},
            notes.map((note) => h("li", {}, note)),
          ),
        ]
      : null,
    h("h3", {}, "Report"),
    h("pre", { id: "report-text" }, text),
    rows.length > 0 ? [h("h3", {}, "Options"), h("table", { class: "options" }, rows)] : null,
    h("p", { class: "hint" }, `Made by ${contents.program}. The page needs no network: it holds all that it shows.`),
  );
}

// Elements of the page, made in one call each.

const SVG = "http://www.w3.org/2000/svg";
const SVG_TAGS = new Set(["svg", "g", "path", "rect", "line", "text", "polyline", "circle", "title"]);

/** An element with attributes (on...: listeners; properties where there are such) and children. */
export function h(tag, attributes = {}, ...children) {
  const element = SVG_TAGS.has(tag) ? document.createElementNS(SVG, tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "class" || name.includes("-") || SVG_TAGS.has(tag) || !(name in element)) {
      element.setAttribute(name, value === true ? "" : value);
    } else element[name] = value;
  }
  element.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return element;
}

/** A group of buttons of which one is pressed: [[value, label, title], ...]. */
export function choice(label, options, value, onChange) {
  const buttons = options.map(([key, text, title]) =>
    h("button", { type: "button", title, "data-value": key, onclick: () => onChange(key) }, text),
  );
  const element = h("div", { class: "choice", role: "group", "aria-label": label }, buttons);
  const show = (chosen) => {
    for (const button of buttons) button.setAttribute("aria-pressed", String(button.dataset.value === chosen));
  };
  show(value);
  return { element, show };
}

/** A check box with its text. */
export function check(id, text, value, onChange, title = "") {
  const input = h("input", { type: "checkbox", id, checked: value, onchange: () => onChange(input.checked) });
  return { element: h("label", { class: "check", title }, input, h("span", {}, text)), input };
}

/** A list to choose from: [[value, label], ...]. */
export function select(id, label, options, value, onChange) {
  const input = h("select", { id, "aria-label": label, onchange: () => onChange(input.value) });
  input.append(...options.map(([key, text]) => h("option", { value: key }, text)));
  input.value = value;
  return input;
}

/** A number for people: four digits, or as many as a whole number has. */
export function short(value) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  if (Number.isInteger(value) && Math.abs(value) < 1e7) return value.toLocaleString("en");
  const size = Math.abs(value);
  const text = size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(3) : value.toPrecision(4);
  return text.includes("e") ? text : String(Number(text));
}

/** A number with all digits that a float64 has. */
export function exact(value) {
  return Number.isNaN(value) ? "NaN" : String(value);
}

// A picture of what is shown, with titles and legend, as a PNG file.

import { h } from "../dom.js";

/** Draw the canvas, the titles of its parts and the legend into one picture. */
export function picture(stage, titles, legend) {
  stage.draw(); // the buffer is kept only until the end of this turn
  const { canvas } = stage;
  const scale = canvas.width / canvas.parentElement.clientWidth;
  const target = h("canvas", { width: canvas.width, height: canvas.height });
  const context = target.getContext("2d");
  context.drawImage(canvas, 0, 0);
  const style = getComputedStyle(document.body);
  context.fillStyle = style.color;
  const write = (text, x, y, size, weight = "normal") => {
    context.font = `${weight} ${size * scale}px ${style.fontFamily}`;
    context.fillText(text, x * scale, y * scale);
  };
  for (const { left, lines } of titles)
    lines.forEach((line, k) => write(line, left + 14, 26 + 18 * k, k === 0 ? 14 : 12, k === 0 ? "bold" : "normal"));
  const bottom = canvas.height / scale;
  write(legend.title.textContent, 14, bottom - 44, 12, "bold");
  if (!legend.bar.hidden) {
    context.drawImage(legend.bar, 14 * scale, (bottom - 38) * scale, 220 * scale, 12 * scale);
    write(legend.ends[0].value, 14, bottom - 12, 11);
    context.textAlign = "right";
    write(legend.ends[1].value, 234, bottom - 12, 11);
  }
  return target;
}

/** Hand the picture to the user as a file. */
export function save(target, name) {
  target.toBlob((blob) => {
    const link = h("a", { href: URL.createObjectURL(blob), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  });
}

// What cells are coloured by: an array on cells or points, one of its components or their length, or the regions.

// Apart for colour-blind eyes, and light enough for dark lines; with more regions they come again.
export const REGION_COLOURS = ["#7fb3d5", "#f5b971", "#8cc9a1", "#e08e8e", "#c3a6d8", "#efe08a", "#9fd8d8", "#b8a28f"];

/** All that can be chosen: {key, title, place, name, component}. */
export function colourings(mesh) {
  const found = new Map();
  for (const frame of [mesh.last, mesh.first]) {
    for (const place of ["cell", "point"]) {
      for (const [name, { width }] of Object.entries(frame.arrays[place])) {
        for (const one of parts(mesh, place, name, width)) if (!found.has(one.key)) found.set(one.key, one);
      }
    }
  }
  const all = [...found.values()];
  if (mesh.regions !== null) all.unshift({ key: "regions", title: "regions", place: "regions" });
  return all;
}

function parts(mesh, place, name, width) {
  const measure = mesh.contents.measures.find((one) => one.name === name && place === "cell");
  const title = measure ? measure.title : name.replaceAll("_", " ");
  const key = `${place}:${name}`;
  if (width === 1) return [{ key, title, place, name, component: 0, width, measure }];
  const axes = width === 3 ? ["x", "y", "z"] : Array.from({ length: width }, (_, k) => String(k));
  const length = { key, title: `${title}, length`, place, name, component: -1, width };
  return [
    length,
    ...axes.map((axis, k) => ({ ...length, key: `${key}:${k}`, title: `${title} ${axis}`, component: k })),
  ];
}

/** The value at a place (a cell, or a point) as a function, null where the frame lacks the array. */
export function valuesOf(mesh, frame, colouring) {
  if (colouring.place === "regions") return (cell) => mesh.regions[cell] % REGION_COLOURS.length;
  const array = frame.arrays[colouring.place][colouring.name];
  if (array === undefined) return null;
  const { values } = array;
  const { component, width } = colouring;
  if (component >= 0) return width === 1 ? (k) => values[k] : (k) => values[width * k + component];
  return (k) => {
    let sum = 0;
    for (let c = 0; c < width; c += 1) sum += values[width * k + c] ** 2;
    return Math.sqrt(sum);
  };
}

/** Smallest and largest finite value in the frames. */
export function dataRange(mesh, frames, colouring) {
  let low = Infinity;
  let high = -Infinity;
  for (const frame of frames) {
    const value = frame.loaded ? valuesOf(mesh, frame, colouring) : null;
    if (value === null) continue;
    const count = colouring.place === "point" ? frame.points.length / 3 : mesh.count;
    for (let k = 0; k < count; k += 1) {
      const x = value(k);
      if (Number.isFinite(x)) {
        if (x < low) low = x;
        if (x > high) high = x;
      }
    }
  }
  return low > high ? [0, 1] : [low, high];
}

/** The range that colours stand for at first: that which a measure can have, or that of the values. */
export function naturalRange(mesh, colouring) {
  const given = colouring.measure?.range;
  const [low, high] = dataRange(mesh, [mesh.first, mesh.last], colouring);
  return given ? [given[0] ?? low, given[1] ?? high] : [low, high];
}

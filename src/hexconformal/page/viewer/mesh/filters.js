// Which cells are drawn.

/** The frame by whose values cells are chosen for a view that shows `frame`. */
export function decidingFrame(mesh, state, frame) {
  const lacks = (name) => name !== null && frame.cellValues(name) === undefined;
  if (state.chosenBy === "before") return mesh.first;
  if (state.chosenBy === "after" || lacks(state.thresholdMeasure)) return mesh.last;
  return frame;
}

/** (m,) 1 for the cells that are drawn, and their number. */
export function drawnCells(mesh, state, frame) {
  const drawn = new Uint8Array(mesh.count);
  const tests = activeTests(mesh, state, decidingFrame(mesh, state, frame));
  let count = 0;
  for (let cell = 0; cell < mesh.count; cell += 1) {
    if (tests.every((test) => test(cell))) {
      drawn[cell] = 1;
      count += 1;
    }
  }
  return { drawn, count };
}

function activeTests(mesh, state, frame) {
  if (state.focus >= 0) return [(cell) => state.nest.has(cell)];
  const tests = [];
  if (state.hiddenRegions.size > 0) tests.push((cell) => !state.hiddenRegions.has(mesh.regions[cell]));
  if (state.peel > 0) tests.push((cell) => mesh.layers[cell] >= state.peel);
  if (state.cut) tests.push(cutTest(mesh, state));
  if (state.threshold !== null) tests.push(thresholdTest(mesh, state, frame));
  for (const [name, [low, high]] of Object.entries(state.brushes)) {
    const values = frame.cellValues(name);
    if (values) tests.push((cell) => values[cell] >= low && values[cell] <= high);
  }
  return tests;
}

function cutTest(mesh, state) {
  const normal = state.cutNormal;
  const { low, high } = cutExtent(mesh, normal);
  const at = low + state.cutPosition * (high - low);
  const sign = state.cutFlipped ? -1 : 1;
  const { centres } = mesh;
  return (cell) => {
    const along = normal[0] * centres[3 * cell] + normal[1] * centres[3 * cell + 1] + normal[2] * centres[3 * cell + 2];
    return sign * (along - at) <= 0;
  };
}

/** Smallest and largest height of the corners of the box around the mesh along a normal. */
export function cutExtent(mesh, normal) {
  let low = 0;
  let high = 0;
  for (let axis = 0; axis < 3; axis += 1) {
    const ends = [normal[axis] * mesh.low[axis], normal[axis] * mesh.high[axis]];
    low += Math.min(...ends);
    high += Math.max(...ends);
  }
  return { low, high };
}

function thresholdTest(mesh, state, frame) {
  const measure = mesh.contents.measures.find((one) => one.name === state.thresholdMeasure);
  const values = frame.cellValues(measure.name);
  if (!values) return () => true;
  const bound = state.threshold;
  return measure.best === "high" ? (cell) => values[cell] <= bound : (cell) => values[cell] >= bound;
}

/** Whether every cell is drawn, whatever the values. */
export function showsAll(mesh, count) {
  return count === mesh.count;
}

// Arrays of the page: base64 of the zlib stream of their bytes, all first bytes of the numbers before all second ones.

const TYPES = {
  float64: Float64Array,
  float32: Float32Array,
  int32: Int32Array,
  int16: Int16Array,
  uint8: Uint8Array,
};

/** The numbers of the array with this reference: {id, type, shape}. */
export async function decoded(reference) {
  const bytes = bytesOf(document.getElementById(`array-${reference.id}`).textContent);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const size = TYPES[reference.type].BYTES_PER_ELEMENT;
  return new TYPES[reference.type](interleaved(planes, size).buffer);
}

function bytesOf(base64) {
  const text = atob(base64.trim());
  const bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k += 1) bytes[k] = text.charCodeAt(k);
  return bytes;
}

function interleaved(planes, size) {
  if (size === 1) return planes;
  const count = planes.length / size;
  const bytes = new Uint8Array(planes.length);
  for (let plane = 0; plane < size; plane += 1) {
    for (let k = 0, from = plane * count; k < count; k += 1) bytes[k * size + plane] = planes[from + k];
  }
  return bytes;
}

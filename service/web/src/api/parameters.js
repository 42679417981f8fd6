// Decoding of GET /v1/models/{group}/{name}/parameters (service/formats/parameters.py).

/** Description and arrays of a model: `{...description, arrays: {name: Float64Array}}`. */
export function decodeParameters(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {};
  for (const [name, { shape, offset }] of Object.entries(header.arrays)) {
    const size = shape.reduce((a, b) => a * b, 1);
    arrays[name] = new Float64Array(buffer, 4 + length + 8 * offset, size);
  }
  return { ...header, arrays };
}

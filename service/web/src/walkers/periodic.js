// Periodic signals: samples of `width` numbers each, in one flat array.

/** Interpolate at `phase` [cycles] into `out` by a Catmull-Rom spline. */
export function between(values, width, phase, out) {
  const count = values.length / width;
  const at = (phase - Math.floor(phase)) * count;
  const first = Math.floor(at);
  const u = at - first;
  const weights = [
    u * (-0.5 + u * (1 - 0.5 * u)),
    1 + u * u * (-2.5 + 1.5 * u),
    u * (0.5 + u * (2 - 1.5 * u)),
    u * u * (-0.5 + 0.5 * u),
  ];
  for (let c = 0; c < width; c++) {
    let sum = 0;
    for (let k = 0; k < 4; k++) sum += weights[k] * values[((first + k - 1 + count) % count) * width + c];
    out[c] = sum;
  }
  return out;
}

/** A quantile, with linear interpolation as in NumPy. */
export function quantile(values, share) {
  const sorted = Float64Array.from(values).sort();
  const at = share * (sorted.length - 1);
  const first = Math.floor(at);
  const next = Math.min(first + 1, sorted.length - 1);
  return sorted[first] + (at - first) * (sorted[next] - sorted[first]);
}

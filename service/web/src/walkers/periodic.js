// Periodic signals: samples of `width` numbers each, in one flat array.

/** Central differences per sample. */
export function slope(values, width) {
  const out = new Float64Array(values.length);
  const n = values.length;
  for (let i = 0; i < n; i++) out[i] = 0.5 * (values[(i + width) % n] - values[(i - width + n) % n]);
  return out;
}

/** Gaussian smoothing with a standard deviation of `sigma` samples, truncated at four as in SciPy. */
export function smooth(values, width, sigma) {
  const radius = Math.floor(4 * sigma + 0.5);
  const weights = Array.from({ length: radius + 1 }, (_, k) => Math.exp((-0.5 * k * k) / (sigma * sigma)));
  const total = weights.reduce((a, b) => a + 2 * b, -weights[0]);
  const count = values.length / width;
  const out = new Float64Array(values.length);
  for (let i = 0; i < count; i++) {
    for (let k = -radius; k <= radius; k++) {
      const weight = weights[Math.abs(k)] / total;
      const from = ((((i + k) % count) + count) % count) * width;
      for (let c = 0; c < width; c++) out[i * width + c] += weight * values[from + c];
    }
  }
  return out;
}

/**
 * Integrate a velocity (samples of x, y) [m per cycle]: the path minus uniform motion, of mean 0, and the stride (x, y).
 */
export function evenly(velocity) {
  const count = velocity.length / 2;
  const way = new Float64Array(velocity.length);
  const stride = [0, 1].map((c) => {
    let mean = 0;
    for (let i = 0; i < count; i++) mean += velocity[2 * i + c] / count;
    let at = 0;
    let middle = 0;
    for (let i = 0; i < count; i++) {
      const before = velocity[2 * ((i - 1 + count) % count) + c];
      at += (0.5 * (velocity[2 * i + c] + before) - mean) / count;
      way[2 * i + c] = at;
      middle += at / count;
    }
    for (let i = 0; i < count; i++) way[2 * i + c] -= middle;
    return mean;
  });
  return { way, stride };
}

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

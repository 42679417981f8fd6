// What perception research does to point-light walkers: turning them upside down, and scattering their dots.

import { uniform } from "./random.js";

/** By how much each marker (15 × 3) [m] is moved from its average place to a random one in the walker's own box. */
export function scattered(average, height, seed) {
  const next = uniform(seed + 1);
  const out = new Float64Array(45);
  for (let i = 0; i < 45; i += 3) {
    out[i] = 0.5 * height * (next() - 0.5) - average[i];
    out[i + 1] = 0.5 * height * (next() - 0.5) - average[i + 1];
    out[i + 2] = height * (0.06 + 0.88 * next()) - average[i + 2];
  }
  return out;
}

/** Write to `out` the markers, scattered and upside down where asked for; `moves` may be null. */
export function arranged(markers, moves, inverted, height, out) {
  for (let i = 0; i < 45; i++) {
    const value = markers[i] + (moves ? moves[i] : 0);
    out[i] = inverted && i % 3 === 2 ? height - value : value;
  }
  return out;
}

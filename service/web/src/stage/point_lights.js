// Point-light displays as in perception research: inverted and scrambled.

import { uniform } from "../walkers/random.js";

/** Displacement of each marker (15 × 3) [m] from its mean position to a random one in the walker's bounding box. */
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

/** Displace markers by `moves`, unless null, and invert them if requested, into `out`. */
export function arranged(markers, moves, inverted, height, out) {
  for (let i = 0; i < 45; i++) {
    const value = markers[i] + (moves ? moves[i] : 0);
    out[i] = inverted && i % 3 === 2 ? height - value : value;
  }
  return out;
}

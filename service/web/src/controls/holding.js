// Sliders that hold: a person moves along one direction while what was set along others stays.

import { LIMIT } from "../state.js";

const NEGLIGIBLE = 1e-9; // squared length of a direction of which others leave nothing
const STUCK = 0.02; // share of a direction that must be free to move along it

const sum = (a, b) => a.reduce((total, x, k) => total + x * b[k], 0);

/**
 * Deviations (q) whose part along a unit `direction` (q) is `value`, or as near to it as the others let it be.
 *
 * Their parts along the `held` directions stay as they are, and each remains within ±LIMIT: what has come to its limit
 * stays there, and the rest moves on.
 */
export function moved(deviations, direction, value, held) {
  const z = Array.from(direction, (_, k) => deviations[k] ?? 0);
  const free = z.map(() => true);
  for (;;) {
    const way = freed(direction, held, free);
    const slope = sum(direction, way);
    const rest = value - sum(direction, z);
    if (slope < STUCK || Math.abs(rest) < NEGLIGIBLE) return z;
    let step = rest / slope;
    let stopped = -1;
    way.forEach((share, k) => {
      const room = share * step > 0 ? LIMIT - z[k] : LIMIT + z[k];
      if (Math.abs(share * step) <= room + NEGLIGIBLE) return;
      step *= Math.max(room, 0) / Math.abs(share * step);
      stopped = k;
    });
    way.forEach((share, k) => (z[k] = Math.min(LIMIT, Math.max(-LIMIT, z[k] + share * step))));
    if (stopped < 0) return z;
    free[stopped] = false;
  }
}

/** What of a direction changes none of the held ones, in the components that are free. */
function freed(direction, held, free) {
  const within = (a) => Array.from(a, (x, k) => (free[k] ? x : 0));
  const less = (a, b) => {
    const share = sum(a, b);
    return a.map((x, k) => x - share * b[k]);
  };
  const basis = [];
  for (const one of held) {
    const rest = basis.reduce(less, within(one));
    const length = Math.sqrt(sum(rest, rest));
    if (length ** 2 > NEGLIGIBLE) basis.push(rest.map((x) => x / length));
  }
  return basis.reduce(less, within(direction));
}

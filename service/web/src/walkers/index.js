// Walkers: each says where its markers and limbs are at any time.
//
//   set(settings)         apply settings
//   show(moment)          set `markers` (45), `limbs` (limbs × 6) and `ground` (x, y), the way of the ground [m]
//   body, stride, seconds, curves, and what `Walker` (base.js) has

import { WalkerInPlace } from "./in_place.js";
import { GrownWalker } from "./recorded.js";

/** Whether the service sends a model's motion pose by pose, as it has no strides in place. */
export const streamed = ({ treadmill }) => treadmill === null;

/** A walker of a model called `name`, from its parameters; `how` as of `WalkerInPlace`. */
export const walkerOf = (parameters, name, how) =>
  streamed(parameters) ? new GrownWalker(parameters) : new WalkerInPlace(parameters, name, how);

/** Mean position of each marker over a cycle (15 × 3), around which dots are scrambled. */
export function averageMarkers(walker) {
  if (!walker.cyclic) {
    walker.show(0);
    return Float64Array.from(walker.markers);
  }
  const { markers } = walker.cycle;
  const mean = new Float64Array(45);
  for (let i = 0; i < markers.length; i++) mean[i % 45] += (45 * markers[i]) / markers.length;
  return mean;
}

// What the page computes: node parity.mjs <folder of the page's modules> < cases, each answered with numbers (JSON).
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const folder = pathToFileURL(`${process.argv[2]}/`);
const [{ decodeParameters }, { decodeStride }, { moved }, { Body, forward, limbEnds }, { between }, { WalkerInPlace }, { PointLights, ringOf }] = await Promise.all(
  ["api/parameters", "api/strides", "controls/holding", "walkers/kinematics", "walkers/periodic", "walkers/in_place", "stimuli/point_lights"].map(
    (name) => import(new URL(`${name}.js`, folder)),
  ),
);

const bytes = (path) => Uint8Array.from(readFileSync(path)).buffer;
const readStride = (path) => decodeStride(bytes(path));

/** Nodes and drawn limbs of every pose. */
function bodies(poses, body) {
  const nodes = new Float64Array(48);
  const rotations = new Float64Array(108);
  const found = { nodes: [], limbs: [] };
  for (let j = 0; j < poses.length; j += 25) {
    forward(poses.subarray(j, j + 25), body, nodes, rotations);
    found.nodes.push([...nodes]);
    found.limbs.push([...limbEnds(nodes, rotations, body, new Float64Array(6 * body.limbNodes.length))]);
  }
  return found;
}

const answers = {
  moved({ deviations, direction, value, held }) {
    return moved(deviations, direction, value, held);
  },
  walker({ stride, phases }, parameters) {
    const walker = new WalkerInPlace(parameters);
    walker.take(readStride(stride));
    walker.after(0, 1); // until the new stride has faded in
    const found = { markers: [], limbs: [], ground: [], speed: walker.speed };
    for (const phase of phases) {
      walker.show(phase);
      found.markers.push([...walker.markers]);
      found.limbs.push([...walker.limbs]);
      found.ground.push(walker.ground[0]);
    }
    return found;
  },
  poses({ poses }, parameters) {
    return bodies(Float64Array.from(poses.flat()), new Body(parameters, parameters.height));
  },
  dots({ display, stride, times }) {
    const lights = new PointLights(display, ringOf({ cycle: readStride(stride) }));
    return times.map((seconds) => lights.at(seconds).map(({ x, y, visible }) => [x, y, Number(visible)]));
  },
  between({ values, phases }) {
    return phases.map((phase) => [...between(Float64Array.from(values.flat()), values[0].length, phase, [])]);
  },
};

const { cases, parameters } = JSON.parse(readFileSync(0, "utf8"));
const models = Object.fromEntries(Object.entries(parameters).map(([name, path]) => [name, decodeParameters(bytes(path))]));
console.log(JSON.stringify(cases.map((asked) => answers[asked.kind](asked, models[asked.model]))));

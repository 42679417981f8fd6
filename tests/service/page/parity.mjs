// What the page computes: node parity.mjs <folder of the page's modules> < cases, each answered with numbers (JSON).
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const folder = pathToFileURL(`${process.argv[2]}/`);
const [{ decodeParameters }, { moved }, { walkInPlace }, { walkerInPlace, Frame }, { Body, forward, limbEnds }, { between }, { walkerOf }, { PointLights, ringOf }] = await Promise.all(
  ["api/parameters", "controls/holding", "walkers/treadmill_cycle", "walkers/eigenwalkers", "walkers/kinematics", "walkers/periodic", "walkers/index", "stimuli/point_lights"].map(
    (name) => import(new URL(`${name}.js`, folder)),
  ),
);

const read = (path) => {
  const bytes = readFileSync(path);
  return decodeParameters(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
};

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
  walk({ deviations, options }, parameters) {
    const { poses, stride, seconds, body } = walkInPlace(parameters, deviations, options);
    return { frames: [...poses], stride, seconds, ...bodies(poses, body) };
  },
  eigenwalkers({ deviations, options }, parameters) {
    const { markers, stride, seconds } = walkerInPlace(parameters, deviations, options);
    return { frames: [...markers], stride, seconds };
  },
  poses({ poses }, parameters) {
    return bodies(Float64Array.from(poses.flat()), new Body(parameters, parameters.height));
  },
  dots({ display, deviations, options, times }, parameters) {
    const walker = walkerOf(parameters);
    walker.set({ deviations, speed: null, height: null, ...options });
    const lights = new PointLights(display, ringOf(walker));
    return times.map((seconds) => lights.at(seconds).map(({ x, y, visible }) => [x, y, Number(visible)]));
  },
  between({ values, phases }) {
    return phases.map((phase) => [...between(Float64Array.from(values.flat()), values[0].length, phase, [])]);
  },
};

const { cases, parameters } = JSON.parse(readFileSync(0, "utf8"));
const models = Object.fromEntries(Object.entries(parameters).map(([name, path]) => [name, read(path)]));
console.log(JSON.stringify(cases.map((asked) => answers[asked.kind](asked, models[asked.model]))));

// POST /v1/cycles: one stride in place, of which the latest are kept.

import { decodeParameters } from "./parameters.js";
import { request } from "./requests.js";

const TYPE = "application/x-motionenv-parameters";
const MOST = 100; // strides that are kept, of 54 kB each
const kept = new Map();

/** A stride from the bytes of a response: `poses`, `markers`, `offsets`, `radii`, `stride`, `seconds`, `height` and `weight`, null if unknown. */
export function decodeStride(buffer) {
  const { arrays, stride, seconds, height, weight } = decodeParameters(buffer);
  return { ...arrays, stride, seconds, height, weight };
}

/** The stride of some settings if it is kept, otherwise undefined. */
export const keptStride = (settings) => kept.get(JSON.stringify(settings));

/** The stride of some settings: `{model, deviations, speed, height}`. */
export async function strideOf(settings) {
  const body = JSON.stringify(settings);
  if (kept.has(body)) return kept.get(body);
  const headers = { "Content-Type": "application/json", Accept: TYPE };
  const answer = await request("/v1/cycles", { method: "POST", headers, body });
  const stride = decodeStride(await answer.arrayBuffer());
  kept.set(body, stride);
  if (kept.size > MOST) kept.delete(kept.keys().next().value);
  return stride;
}

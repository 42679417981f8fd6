// The list of models, and their descriptions.

import { models, parametersOf } from "../api/requests.js";
import { make } from "./widgets.js";

const SHIPPED = ["walk/fpca", "walk/eigenwalkers", "mixed/tree"];
const TITLES = {
  "walk/fpca": ["Joint angles", "Functional principal components of joint angles; feet stand on the ground"],
  "walk/eigenwalkers": ["Points", "Eigenwalkers: fifteen points that swing in two harmonics, as perception research uses them"],
  "mixed/tree": ["Endless", "A tree of captured clips, from which motion grows without end: it can turn, stop and be steered"],
  "walk/prior": ["Points, all people", "Eigenwalkers of every walk and its mirror image, which know how they err"],
};
const cache = new Map();

/** A model's parameters, cached. */
export function parameters(name) {
  if (!cache.has(name)) {
    const coming = parametersOf(name);
    coming.catch(() => cache.delete(name));
    cache.set(name, coming);
  }
  return cache.get(name);
}

/** Fill a fieldset with a radio button for each model; `chosen(name)` is called on selection. */
export async function listModels(fieldset, current, chosen) {
  const show = (names) => {
    const labels = names.map((name) => {
      const input = make("input", { type: "radio", name: "model", value: name, checked: name === current() });
      input.addEventListener("change", () => chosen(name));
      const [textContent, title] = TITLES[name] ?? [name.replace("fitted/", ""), "A model of this service"];
      return make("label", { title: `${title} (${name})` }, input, make("span", { textContent }));
    });
    fieldset.replaceChildren(fieldset.firstElementChild, ...labels);
  };
  show(SHIPPED);
  const listed = await models().catch(() => []);
  const others = listed.filter(({ name, problem }) => !problem && !SHIPPED.includes(name)).map(({ name }) => name);
  if (others.length) show([...SHIPPED, ...others]);
}

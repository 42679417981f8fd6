// The list of models, and their descriptions.

import { models, parametersOf } from "../api/requests.js";
import { make } from "./widgets.js";

const SHIPPED = ["walk/fpca", "walk/eigenwalkers", "mixed/tree"];
const TITLES = {
  "walk/fpca": ["Angles", "Functional principal components of joint angles; feet stand on the ground"],
  "walk/eigenwalkers": ["Points", "Eigenwalkers: fifteen points that swing in two harmonics, as perception research uses them"],
  "mixed/tree": ["Free motion", "A tree of clips, from which motion grows without end: it turns and can be steered"],
  "walk/prior": ["Points, asymmetric", "Eigenwalkers of every single walk and its mirror image: limping and other asymmetry, too"],
};
const SECRET = /-[0-9a-z]{24}$/; // the end of a visitor's own model's name
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

/** What the page calls a model. */
export const titleOf = (name) => (TITLES[name] ?? [name.replace("fitted/", "").replace(SECRET, "")])[0];

/** Fill a fieldset with a radio button for each model; `chosen(name)` is called on selection. */
export async function listModels(fieldset, current, chosen) {
  const show = (names) => {
    const labels = names.map((name) => {
      const input = make("input", { type: "radio", name: "model", value: name, checked: name === current() });
      input.addEventListener("change", () => chosen(name));
      const title = TITLES[name]?.[1] ?? "A model that was fitted here";
      return make("label", { title: `${title} (${name})` }, input, make("span", { textContent: titleOf(name) }));
    });
    fieldset.replaceChildren(fieldset.firstElementChild, ...labels);
  };
  show(SHIPPED);
  const listed = await models().catch(() => []);
  const others = new Set(listed.filter(({ problem }) => !problem).map(({ name }) => name)).add(current()); // it may be unlisted
  for (const name of SHIPPED) others.delete(name);
  if (others.size) show([...SHIPPED, ...others]);
}

// The list of models, and their descriptions.

import { models, parametersOf } from "../api/requests.js";
import { make } from "./widgets.js";

const SHIPPED = ["walk/fpca", "walk/eigenwalkers", "mixed/tree"];
const TITLES = { "walk/fpca": "Functional", "walk/eigenwalkers": "Eigenwalkers", "mixed/tree": "Tree", "walk/prior": "Prior" };
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
      const title = TITLES[name] ?? name.replace("fitted/", "");
      return make("label", { title: name }, input, make("span", { textContent: title }));
    });
    fieldset.replaceChildren(fieldset.firstElementChild, ...labels);
  };
  show(SHIPPED);
  const listed = await models().catch(() => []);
  const others = listed.filter(({ name, problem }) => !problem && !SHIPPED.includes(name)).map(({ name }) => name);
  if (others.length) show([...SHIPPED, ...others]);
}

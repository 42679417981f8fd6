// Which models there are to choose from, and what to say of them.

import { modelNames, parametersOf } from "./api.js";
import { make } from "./sliders.js";
import { known } from "./walkers.js";

const SHIPPED = ["walk/fpca", "walk/eigenwalkers", "mixed/tree"];
const TITLES = { "walk/fpca": "Functional", "walk/eigenwalkers": "Eigenwalkers", "mixed/tree": "Tree" };
const ABOUT = {
  walking: "Joint angles of whole gait cycles as functions: an average and how people differ from it.",
  eigenwalkers: "Fifteen points that swing in two harmonics: body shape and style in one space.",
  tree: "Motion without end, grown frame by frame from clips. The tree that ships knows walking, straight and in curves.",
};
const cache = new Map();

/** A model's parameters, asked for once. */
export function parameters(name) {
  if (!cache.has(name)) {
    const coming = parametersOf(name);
    coming.catch(() => cache.delete(name));
    cache.set(name, coming);
  }
  return cache.get(name);
}

/** What a kind of model is, for people. */
export const about = (kind) => ABOUT[kind] ?? "";

/** Put the models that the service has into a fieldset of radio buttons; `chosen(name)` hears which is taken. */
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
  const listed = await modelNames().catch(() => []);
  const fitted = listed.filter(({ name, kind }) => known(kind) && !SHIPPED.includes(name)).map(({ name }) => name);
  if (fitted.length) show([...SHIPPED, ...fitted]);
}

// The state of the page, and its encoding as a link.

import { parsed, plain, SETTINGS } from "./stimuli/settings.js";

export const LIMIT = 3; // standard deviations to either side

/** What fields and sliders take: least and greatest value. */
export const RANGES = { speed: [0.3, 2.6], height: [1, 2.2], weight: [15, 150], heading: [-180, 180], seed: [0, 2 ** 32 - 1] };

/** Whom the service may draw. */
export const PEOPLE = ["adult", "woman", "man", "child", "girl", "boy"];

/** What is ticked or not; ids of the page's elements, too. */
export const FLAGS = ["lines", "inverted", "scattered", "hiding", "markers"];

const FAR = 1e4; // greatest number of a view
const TEMPERATURE = 0.05; // default for trees
const person = () => ({
  deviations: [],
  drawn: false, // whether the service draws the person with the seed, as everywhere; then there are no deviations
  held: [], // sliders whose values stay: t0 is the first trait, c0 the first component
  of: null, // the model of deviations and held; null is the one that the state names
  elsewhere: {}, // deviations, drawn and held in other models, by their names
  speed: null,
  height: null,
  weight: null,
  who: PEOPLE[0], // the kind of people of whom one is drawn
  activity: null,
  heading: null,
  temperature: TEMPERATURE,
  seed: 0,
});

/** The default state. */
export const fresh = () => ({
  model: "walk/fpca",
  figure: "body",
  lines: false,
  inverted: false,
  scattered: false,
  hiding: false, // whether the body hides the points behind it
  markers: false, // the captured points over the body
  together: false, // whether two walkers keep step
  camera: null,
  capture: null, // id of the inspection whose capture is shown
  stimulus: null, // the settings of the dialogue for experiments while it is open
  people: [person()],
  chosen: 0,
});

const number = (text, low, high, otherwise) => {
  const value = Number.parseFloat(text);
  return Number.isFinite(value) ? Math.min(high, Math.max(low, value)) : otherwise;
};

const short = (value) => String(Math.round(value * 1000) / 1000);

/** The state as the fragment of a link. */
export function link(state) {
  const fields = new URLSearchParams();
  fields.set("model", state.model);
  if (state.figure !== "body") fields.set("figure", state.figure);
  for (const flag of [...FLAGS, "together"]) if (state[flag]) fields.set(flag, "1");
  if (state.camera) fields.set("camera", state.camera.map(short).join(","));
  if (state.capture) fields.set("capture", state.capture);
  if (state.stimulus) stimulusTo(fields, state.stimulus);
  state.people.forEach((one, i) => {
    const mark = i === 0 ? "" : "2";
    if (one.deviations.some((d) => d !== 0) || i > 0) fields.set(`walker${mark}`, one.deviations.map(short).join(","));
    if (one.drawn) fields.set(`drawn${mark}`, "1");
    if (one.held.length) fields.set(`held${mark}`, one.held.join(","));
    if (one.speed !== null) fields.set(`speed${mark}`, short(one.speed));
    if (one.height !== null) fields.set(`height${mark}`, short(one.height));
    if (one.weight !== null) fields.set(`weight${mark}`, short(one.weight));
    if (one.who !== PEOPLE[0]) fields.set(`who${mark}`, one.who);
    if (one.activity !== null) fields.set(`activity${mark}`, one.activity);
    if (one.heading !== null) fields.set(`heading${mark}`, short(one.heading));
    if (one.temperature !== TEMPERATURE) fields.set(`temperature${mark}`, short(one.temperature));
    if (one.seed) fields.set(`seed${mark}`, String(one.seed));
  });
  return fields.toString().replaceAll("%2F", "/").replaceAll("%2C", ",");
}

/** Settings that aren't the defaults, as fields. */
function stimulusTo(fields, stimulus) {
  fields.set("stimulus", "1");
  for (const { name, home } of SETTINGS) {
    const value = stimulus[name];
    if (value !== home) fields.set(`stimulus.${name}`, typeof value === "boolean" ? "1" : String(value));
  }
}

function stimulusFrom(fields) {
  const given = SETTINGS.filter(({ name }) => fields.has(`stimulus.${name}`));
  return { ...plain(), ...Object.fromEntries(given.map((setting) => [setting.name, parsed(setting, fields.get(`stimulus.${setting.name}`))])) };
}

/** A person who enters a model: with the deviations that were set there, and with nothing that it doesn't have. */
export function enter(one, name, { components, traits, activities }) {
  if (one.of !== null && one.of !== name) {
    const { deviations, drawn, held } = one;
    one.elsewhere = { ...one.elsewhere, [one.of]: { deviations, drawn, held } };
    Object.assign(one, one.elsewhere[name] ?? { deviations: [], held: [] });
  }
  one.of = name;
  one.deviations = one.deviations.slice(0, components ?? 0);
  const most = { t: traits?.length ?? 0, c: components ?? 0 };
  one.held = one.held.filter((slider) => Number(slider.slice(1)) < most[slider[0]]);
  if (!activities?.includes(one.activity)) one.activity = null;
  return one;
}

/** A person whom the service draws with a `seed`: the same who walks over HTTP and in Python. */
export const drawn = (one, seed) => Object.assign(one, { seed, drawn: true, held: [], deviations: [], speed: null, height: null, weight: null });

/** A drawn person with settings of its own, as they are in a stride; from then on sliders move them. */
export function settled(one, { deviations, stride, seconds, height, weight }) {
  if (!one.drawn || !deviations) return one;
  const round = (value) => Math.round(100 * value) / 100;
  const within = (d) => round(Math.min(LIMIT, Math.max(-LIMIT, d)));
  const { speed = null, height: tall = null, weight: heavy = null } = one;
  const [lightest, heaviest] = RANGES.weight;
  return Object.assign(one, {
    drawn: false,
    deviations: Array.from(deviations, within),
    speed: speed ?? round(stride / seconds),
    height: tall ?? round(height),
    weight: heavy ?? (weight ? Math.min(heaviest, Math.max(lightest, Math.round(weight))) : null),
  });
}

/** Make a person average in the present model. */
export const level = (one) => Object.assign(one, { ...person(), of: one.of, elsewhere: one.elsewhere });

function personFrom(fields, mark) {
  const one = person();
  const given = fields.get(`walker${mark}`);
  if (given) one.deviations = given.split(",").slice(0, 64).map((d) => number(d, -LIMIT, LIMIT, 0));
  one.drawn = !given && fields.get(`drawn${mark}`) === "1";
  const held = (fields.get(`held${mark}`) ?? "").split(",");
  one.held = [...new Set(held.filter((slider) => /^[tc]\d{1,2}$/.test(slider)))];
  for (const name of ["speed", "height", "weight", "heading"]) {
    if (fields.has(name + mark)) one[name] = number(fields.get(name + mark), ...RANGES[name], null);
  }
  if (PEOPLE.includes(fields.get(`who${mark}`))) one.who = fields.get(`who${mark}`);
  one.activity = fields.get(`activity${mark}`);
  one.temperature = number(fields.get(`temperature${mark}`), 0.01, 1, TEMPERATURE);
  one.seed = Math.round(number(fields.get(`seed${mark}`), ...RANGES.seed, 0));
  return one;
}

/** The state in a link; missing and invalid values are the defaults. */
export function fromLink(text) {
  const fields = new URLSearchParams(text.replace(/^#/, ""));
  const state = fresh();
  const model = fields.get("model") ?? "";
  if (/^[a-z0-9]+\/[a-z0-9][a-z0-9-]{0,62}$/.test(model)) state.model = model;
  if (["body", "stick", "points"].includes(fields.get("figure"))) state.figure = fields.get("figure");
  for (const flag of [...FLAGS, "together"]) state[flag] = fields.get(flag) === "1";
  const camera = (fields.get("camera") ?? "").split(",").map(Number);
  if (camera.length === 3 && camera.every((x) => Math.abs(x) <= FAR)) state.camera = camera;
  if (/^[\w-]{8,64}$/.test(fields.get("capture") ?? "")) state.capture = fields.get("capture");
  if (fields.get("stimulus") === "1") state.stimulus = stimulusFrom(fields);
  state.people = [personFrom(fields, "")];
  if (fields.has("walker2")) state.people.push(personFrom(fields, "2"));
  return state;
}

// Download of motion as files, made by the service.

import { motion, ServiceError } from "../api/requests.js";
import { settingsOf } from "../walkers/in_place.js";
import { fresh } from "../state.js";
import { steering } from "../walkers/recorded.js";
import { titleOf } from "./model_list.js";

const LONGEST = 80; // characters of a file's name before its suffix
const [SLOW, SHORT, LIGHT] = [[1.1, 1.6], [1.55, 1.9], [19, 30]]; // [m/s], [m], [kg/m²] between which nothing is said of it
const MARKED = 1; // standard deviations from which a trait is told

/** The request for what the page shows of one walker; for a tree, the motion from its start. */
export function synthesisRequest(state, one, parameters, { seconds, view }) {
  const picture = { width: 640, height: 480, view, style: state.figure === "points" ? "points" : "body" };
  const body = { model: state.model, seconds, seed: one.seed, picture };
  if (parameters.steerable) return { path: "/v1/tree/synthesis", body: { ...body, start: one.activity, ...steering(one) } };
  const walker = settingsOf(state.model, parameters, one);
  return { path: "/v1/synthesis", body: { ...body, ...walker, fps: 30, variation: 0 } };
}

/** A file's name of words, in what every system takes: the last one is its suffix. */
export function fileName(...words) {
  const suffix = words.pop();
  const plain = words.map((word) => String(word ?? "").toLowerCase().normalize("NFKD").replace(/[^a-z0-9]+/g, "-").replace(/^-+|-+$/g, ""));
  return `${plain.filter(Boolean).join("-").slice(0, LONGEST)}.${suffix}`;
}

/** What was set of a person, in a few words: "woman-heavy-slow". */
export function wordsOf(state, one, { steerable, traits = [], components, arrays }) {
  const model = state.model === fresh().model ? [] : [titleOf(state.model)];
  if (steerable) return [...model, one.activity, one.seed].join(" ");
  const { speed, height, weight, deviations } = one;
  const child = ["child", "girl", "boy"].includes(one.who);
  const known = [
    [weight && height && !child && weight / height ** 2, LIGHT, "light", "heavy"],
    [height && !child && height, SHORT, "short", "tall"],
    [speed, SLOW, "slow", "fast"],
  ];
  const words = known.flatMap(([value, [least, most], low, high]) => (!value ? [] : value < least ? [low] : value > most ? [high] : []));
  const along = traits.map(({ low, high }, i) => [deviations.reduce((sum, d, k) => sum + d * arrays.traits[i * components + k], 0), low, high]);
  const style = along.filter(([value]) => Math.abs(value) >= MARKED).sort(([a], [b]) => Math.abs(b) - Math.abs(a)).slice(0, 2);
  words.push(...style.map(([value, low, high]) => (value < 0 ? low : high)));
  const who = one.who !== "adult" || one.drawn ? one.who : words.length || deviations.length ? "" : "average";
  return [...model, who, ...words].join(" ");
}

/** How the figure is drawn, in a few words. */
const look = ({ figure, inverted, scattered }) =>
  figure === "points" ? ["points", inverted ? "upside-down" : "", scattered ? "scrambled" : ""].join(" ") : "";

/** The name of a download of what the page shows of one walker; a film is seen from a side, of which `facing` may be the name. */
export function nameOf(state, one, parameters, facing, suffix) {
  const film = suffix === "mp4" ? [look(state), facing] : [];
  return fileName("motionenv", wordsOf(state, one, parameters), ...film, suffix);
}

/** Save a blob as a file. */
export function save(blob, name) {
  const address = URL.createObjectURL(blob);
  const anchor = Object.assign(document.createElement("a"), { href: address, download: name });
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

/**
 * Install the download buttons; `wanted()` returns the request, or null if it can't be made, `named(suffix)` the file's name
 * and `say(message, bad)` shows progress.
 */
export function downloads(buttons, wanted, named, say) {
  for (const button of buttons) {
    button.addEventListener("click", async () => {
      const request = wanted();
      if (!request) return;
      const name = named(button.dataset.suffix);
      button.disabled = true;
      say(`Creating the ${button.textContent} …`, false);
      try {
        const blob = await motion(request, button.dataset.type);
        save(blob, name);
        say(`Saved as ${name}: ${(blob.size / 1000).toFixed(0)} kB.`, false);
      } catch (error) {
        say(error instanceof ServiceError ? error.message : `Download failed: ${error.message}`, true);
      }
      button.disabled = false;
    });
  }
}

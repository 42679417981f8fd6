// Motion as files, made by the service with what the sliders say.

import { motion, Trouble } from "./api.js";
import { steering } from "./recorded.js";

/** What the service is asked for, to give what the page shows of one walker: of a tree, the motion from its beginning. */
export function asked(state, one, parameters, { seconds, view }) {
  const picture = { width: 640, height: 480, view, style: state.figure === "points" ? "points" : "body" };
  const request = { model: state.model, seconds, seed: one.seed, picture };
  if (parameters.kind === "tree") return { path: "/v1/tree/synthesis", request: { ...request, start: one.activity, ...steering(one) } };
  const { speed, height } = one;
  const deviations = Array.from({ length: parameters.components }, (_, k) => one.deviations[k] ?? 0);
  return { path: "/v1/synthesis", request: { ...request, fps: 30, speed, height, deviations, variation: 0 } };
}

/** Let the browser save a blob. */
export function save(blob, name) {
  const address = URL.createObjectURL(blob);
  const anchor = Object.assign(document.createElement("a"), { href: address, download: name });
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

/** Make the buttons work; `request()` gives what to ask for, `say(words, bad)` shows how it goes. */
export function downloads(buttons, request, say) {
  for (const button of buttons) {
    button.addEventListener("click", async () => {
      button.disabled = true;
      say(`Making the ${button.textContent} …`, false);
      try {
        const wanted = request();
        const blob = await motion(wanted, button.dataset.type);
        save(blob, `${wanted.request.model.replace("/", "-")}.${button.dataset.suffix}`);
        say(`Saved: ${(blob.size / 1000).toFixed(0)} kB.`, false);
      } catch (error) {
        say(error instanceof Trouble ? error.message : `That went wrong: ${error.message}`, true);
      }
      button.disabled = false;
    });
  }
}

// Motion as files, made by the service with what the sliders say.

import { motion, Trouble } from "./api.js";

/** What the service is asked for, to give what the page shows of one walker. */
export function asked(state, one, parameters, { seconds, view }) {
  const request = { model: state.model, seconds, fps: 30, seed: one.seed, picture: { width: 640, height: 480, view } };
  if (one.speed !== null) request.speed = one.speed;
  if (one.height !== null) request.height = one.height;
  if (parameters.kind !== "tree") {
    request.deviations = Array.from({ length: parameters.components }, (_, k) => one.deviations[k] ?? 0);
    request.variation = 0;
  }
  if (state.figure === "points") request.picture.style = "points";
  return request;
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
        save(blob, `${wanted.model.replace("/", "-")}.${button.dataset.suffix}`);
        say(`Saved: ${(blob.size / 1000).toFixed(0)} kB.`, false);
      } catch (error) {
        say(error instanceof Trouble ? error.message : `That went wrong: ${error.message}`, true);
      }
      button.disabled = false;
    });
  }
}

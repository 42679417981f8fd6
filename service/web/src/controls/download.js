// Download of motion as files, made by the service.

import { motion, ServiceError } from "../api/requests.js";
import { settingsOf } from "../walkers/in_place.js";
import { steering } from "../walkers/recorded.js";

/** The request for what the page shows of one walker; for a tree, the motion from its start. */
export function synthesisRequest(state, one, parameters, { seconds, view }) {
  const picture = { width: 640, height: 480, view, style: state.figure === "points" ? "points" : "body" };
  const body = { model: state.model, seconds, seed: one.seed, picture };
  if (parameters.steerable) return { path: "/v1/tree/synthesis", body: { ...body, start: one.activity, ...steering(one) } };
  const walker = settingsOf(state.model, parameters, one);
  return { path: "/v1/synthesis", body: { ...body, ...walker, fps: 30, variation: 0 } };
}

/** Save a blob as a file. */
export function save(blob, name) {
  const address = URL.createObjectURL(blob);
  const anchor = Object.assign(document.createElement("a"), { href: address, download: name });
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

/** Install the download buttons; `wanted()` returns the request, or null if it can't be made, `say(message, bad)` shows progress. */
export function downloads(buttons, wanted, say) {
  for (const button of buttons) {
    button.addEventListener("click", async () => {
      const request = wanted();
      if (!request) return;
      button.disabled = true;
      say(`Creating the ${button.textContent} …`, false);
      try {
        const blob = await motion(request, button.dataset.type);
        save(blob, `${request.body.model.replace("/", "-")}.${button.dataset.suffix}`);
        say(`Saved: ${(blob.size / 1000).toFixed(0)} kB.`, false);
      } catch (error) {
        say(error instanceof ServiceError ? error.message : `Download failed: ${error.message}`, true);
      }
      button.disabled = false;
    });
  }
}

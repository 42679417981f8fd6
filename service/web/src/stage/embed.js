// A walker in a page of documentation, without a service: its stride stands in the page, as base64.

import { decodeParameters } from "../api/parameters.js";
import { Figure } from "./figure.js";
import { Stage } from "./stage.js";
import { decodeStride } from "../api/strides.js";
import { WalkerInPlace } from "../walkers/in_place.js";

const LOOKS = ["body", "stick", "points"];

/** Show a walker in each such place of the document. */
export function embedAll() {
  for (const place of document.querySelectorAll(".walker")) {
    try {
      embed(place);
    } catch (error) {
      place.textContent = `The walker needs WebGL: enable graphics acceleration, or try another browser. (${error.message})`;
    }
  }
}

/** Show a walker in a place with a canvas, a range to turn it, a list of looks and a button to pause. */
function embed(place) {
  const [canvas, turn, looks, pause] = ["canvas", "input", "select", "button"].map((tag) => place.querySelector(tag));
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  const walker = new WalkerInPlace(decodeParameters(bytes(place.dataset.parameters)));
  walker.take(decodeStride(bytes(place.dataset.stride)));
  const stage = new Stage(canvas);
  const figure = new Figure(walker, false);
  let cycles = 0;
  let before = null;
  let still = matchMedia("(prefers-reduced-motion: reduce)").matches;

  const look = () => {
    const shown = LOOKS.includes(looks.value) ? looks.value : LOOKS[0];
    figure.look({ figure: shown, lines: false, inverted: false, scattered: false, hiding: false, markers: false }, null);
    place.dataset.look = shown;
    stage.changed = true;
  };
  const say = () => (pause.textContent = still ? "Walk" : "Pause");
  const dark = () => stage.theme(document.documentElement.dataset.theme === "dark");
  const frame = (now) => {
    requestAnimationFrame(frame);
    const passed = Math.min(0.1, (now - (before ?? now)) / 1000);
    before = now;
    stage.controls.update();
    if (still && !stage.changed) return;
    if (!still) cycles = walker.after(cycles, passed);
    walker.show(cycles);
    figure.update();
    stage.draw(looks.value === "points");
    place.dataset.walking = cycles.toFixed(3);
  };

  stage.show([figure]);
  stage.aim(walker.body.height);
  stage.controls.enableZoom = false; // the wheel scrolls the page
  turn.addEventListener("input", () => stage.move({ around: Number(turn.value) }));
  stage.controls.addEventListener("change", () => (turn.value = Math.round(stage.view[0])));
  looks.addEventListener("change", look);
  pause.addEventListener("click", () => {
    still = !still;
    say();
  });
  new MutationObserver(dark).observe(document.documentElement, { attributeFilter: ["data-theme"] });
  dark();
  look();
  say();
  requestAnimationFrame(frame);
}

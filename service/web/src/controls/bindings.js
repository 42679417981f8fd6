// Event handlers of buttons, boxes and fields.

import { capturePanel } from "../capture/panel.js";
import { downloads, nameOf, synthesisRequest } from "./download.js";
import { keys } from "./keyboard.js";
import { numberOf } from "./widgets.js";
import { UP } from "../app.js";
import { FLAGS } from "../state.js";

const WELCOMED = "motionenv-welcomed";
const $ = (id) => document.getElementById(id);
const on = (id, event, then) => $(id).addEventListener(event, then);

/** Install the handlers. */
export function bind(app) {
  keys(app);
  bindLooks(app);
  bindWalkers(app);
  bindDownloads(app);
  welcome();
  capturePanel($("capture-panel"), app);
  addEventListener("hashchange", () => app.follow());
}

/** A hint on the first visit, until it is closed; a browser that keeps nothing shows it each time. */
function welcome() {
  const kept = (then) => {
    try {
      return then(localStorage);
    } catch {
      return null;
    }
  };
  $("welcome").hidden = kept((storage) => storage.getItem(WELCOMED)) !== null;
  on("welcomed", "click", () => {
    $("welcome").hidden = true;
    kept((storage) => storage.setItem(WELCOMED, "1"));
    $("randomise").focus();
  });
}

function bindLooks(app) {
  on("figure", "change", ({ target }) => app.look("figure", target.value));
  for (const id of FLAGS) on(id, "change", ({ target }) => app.look(id, target.checked));
  on("pause", "click", () => app.pause());
  on("scrub", "input", ({ target }) => app.scrub(target.valueAsNumber));
  for (const button of document.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => app.view({ around: Number(button.dataset.view), up: UP }));
  }
  app.stage.controls.addEventListener("end", () => app.view({}));
  app.stage.controls.addEventListener("change", () => app.markView());
  app.markView();
  const dark = matchMedia("(prefers-color-scheme: dark)");
  dark.addEventListener("change", () => app.stage.theme(dark.matches));
  app.stage.theme(dark.matches);
}

function bindWalkers(app) {
  on("gait", "click", async ({ target }) => {
    target.disabled = true;
    app.say("");
    await app.analyse().catch((error) => app.say(error.message));
    target.disabled = false;
  });
  on("chosen", "change", ({ target }) => app.look("chosen", Number(target.value)));
  on("randomise", "click", () => app.draw());
  on("seed", "change", ({ target }) => {
    const seed = numberOf(target);
    if (seed !== null) app.draw(seed);
  });
  on("who", "change", () => app.draw());
  on("to-save", "click", () => reach("download", "#downloads button"));
  on("to-capture", "click", () => reach("capture", "#capture input").click());
  on("together", "change", ({ target }) => app.look("together", target.checked));
  on("leave", "click", () => app.leave());
  on("reset", "click", () => app.reset());
  on("compare", "click", () => app.compare());
  on("undo", "click", () => app.turnBack());
  on("redo", "click", () => app.turnBack(false));
  on("link", "click", async ({ target }) => {
    target.textContent = (await app.copyLink()) ? "Copied" : "See the address bar";
    setTimeout(() => (target.textContent = "Copy link"), 2000);
  });
}

/** Scroll to a part of the panel, and put the focus on what is used there. */
function reach(id, selector) {
  $(id).scrollIntoView({ block: "start" });
  const first = document.querySelector(selector);
  first.focus({ preventScroll: true });
  return first;
}

function bindDownloads(app) {
  on("stimulate", "click", () => app.stimulate());
  on("seconds", "input", ({ target }) => numberOf(target));
  const wanted = () => {
    const seconds = numberOf($("seconds"));
    if (seconds === null) $("seconds").focus();
    return seconds && synthesisRequest(app.state, app.one, app.parameters, { seconds, view: app.stage.view[0] });
  };
  const named = (suffix) => nameOf(app.state, app.one, app.parameters, app.facing?.textContent, suffix);
  downloads($("downloads").children, wanted, named, (words, bad) => {
    $("download-note").textContent = words;
    $("download-note").classList.toggle("bad", bad);
  });
}

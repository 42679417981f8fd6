// Entry point: the application on its own page, walkers in pages of documentation.

import { App } from "./app.js";
import { bind } from "./controls/bindings.js";
import { listModels } from "./controls/model_list.js";
import { embedAll } from "./stage/embed.js";

const $ = (id) => document.getElementById(id);

function start() {
  let app;
  try {
    app = new App();
  } catch (error) {
    $("loading").hidden = true;
    $("note").hidden = false;
    $("note").textContent = `This page needs WebGL: enable graphics acceleration, or try another browser. (${error.message})`;
    return;
  }
  bind(app);
  app.listModels = () => listModels($("models"), () => app.state.model, (name) => app.load(name));
  app
    .load(app.state.model)
    .then(app.listModels)
    .finally(() => app.ready());
  requestAnimationFrame((time) => app.frame(time));
  globalThis.motionenv = app; // for the browser's console, and for tests
}

if ($("view")) start();
embedAll();

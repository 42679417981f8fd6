// The page begins here.

import { App } from "./app.js";
import { bind } from "./bindings.js";
import { listModels } from "./models.js";

const $ = (id) => document.getElementById(id);

function begin() {
  let app;
  try {
    app = new App();
  } catch (error) {
    $("note").hidden = false;
    $("note").textContent = `This page needs a browser that can draw in 3D (WebGL): try another one, or switch on its graphics acceleration. (${error.message})`;
    return;
  }
  bind(app);
  app.listModels = () => listModels($("models"), () => app.state.model, (name) => app.load(name));
  app.load(app.state.model).then(app.listModels);
  requestAnimationFrame((time) => app.frame(time));
  globalThis.motionenv = app; // for whoever tries things out in the browser's console, and for the tests
}

begin();

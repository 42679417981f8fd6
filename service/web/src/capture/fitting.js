// Fitting a model to the walks of an upload.

import { resultOf } from "../api/jobs.js";
import { request } from "../api/requests.js";
import { make } from "../controls/widgets.js";
import { groupsForm, personOf } from "./groups.js";

/** The last step of an upload, and the buttons for its model. */
export class Fitting {
  constructor(upload) {
    this.upload = upload;
    this.buttons = make("div", { className: "actions" });
  }

  /** Fit a model to walks, files of the inspection, with an axis between `groups` of people if there are any. */
  async fit(walks, groups = null) {
    const { upload } = this;
    this.buttons.replaceChildren();
    upload.step(3, "Fitting a model …");
    const kind = new Set(walks.map(personOf)).size > 1 ? "eigenwalkers" : "fpca";
    const fields = { ...upload.fields, kind, name: nameFor(walks[0].name), groups: groups && JSON.stringify(groups) };
    const job = await upload.job("/v1/models", upload.sent(walks), fields, (words, progress) => upload.step(3, words, progress));
    this.offer(await (await resultOf(job)).json());
    const form = groupsForm(walks, (chosen) => this.fit(walks, chosen).catch((error) => upload.failed(error)));
    if (form) this.buttons.append(form);
    await upload.app.listModels();
  }

  offer({ model, kind, left_out: left, notes }) {
    const others = Object.entries(left).map(([name, why]) => `${name} was left out: ${why}.`);
    this.upload.done(`Model ${model} (${kind}). ${[...notes, ...others].join(" ")}`);
    const walk = make("button", { type: "button", className: "strong", textContent: "Use model" });
    const forget = make("button", { type: "button", textContent: "Delete model" });
    walk.addEventListener("click", () => this.upload.app.load(model));
    forget.addEventListener("click", () => this.forget(model));
    this.buttons.replaceChildren(walk, forget);
  }

  async forget(model) {
    const { upload } = this;
    try {
      await request(`/v1/models/${model}`, { method: "DELETE" });
      this.buttons.replaceChildren();
      upload.done("Model deleted.");
      if (upload.app.state.model === model) await upload.app.load("walk/fpca");
      await upload.app.listModels();
    } catch (error) {
      upload.failed(error);
    }
  }
}

/** A model name made from a file name. */
function nameFor(file) {
  const stem = file.toLowerCase().replace(/\.[^.]*$/, "").replace(/[^a-z0-9]+/g, "-").replace(/^-+|-+$/g, "").slice(0, 40);
  return `${stem || "walk"}-${Date.now().toString(36).slice(-5)}`;
}

// Fitting a model to the walks of an upload, for who asks for it: the model is the visitor's, and goes with the files.

import { resultOf } from "../api/jobs.js";
import { ServiceError } from "../api/requests.js";
import { make } from "../controls/widgets.js";
import { groupsForm, personOf } from "./groups.js";

/** What can be fitted to an upload, and the buttons for its models; `models` are their names. */
export class Fitting {
  constructor(upload) {
    this.upload = upload;
    this.models = new Set();
    this.buttons = make("div", { className: "actions" });
    this.words = make("p", { className: "hint" });
    this.words.setAttribute("role", "status");
    this.element = make("div", { hidden: true }, this.buttons, this.words);
  }

  /** Offer to fit a model to walks, files of the inspection. */
  offer(walks) {
    this.element.hidden = !walks.length;
    const begin = make("button", { type: "button", textContent: "Make a model of it", title: "Sliders for how this person walks; it is yours, and goes with the files" });
    begin.addEventListener("click", () => this.fit(walks));
    this.say("");
    this.buttons.replaceChildren(begin);
  }

  /** Fit a model, with an axis between `groups` of people if there are any. */
  async fit(walks, groups = null) {
    const { upload } = this;
    this.buttons.replaceChildren();
    const kind = new Set(walks.map(personOf)).size > 1 ? "eigenwalkers" : "fpca";
    const fields = { ...upload.fields, kind, name: nameFor(walks[0].name), groups: groups && JSON.stringify(groups) };
    try {
      const job = await upload.job("/v1/models", upload.sent(walks), fields, (words) => this.say(`Making a model: ${words}`));
      this.fitted(await (await resultOf(job)).json());
      const form = groupsForm(walks, (chosen) => this.fit(walks, chosen));
      if (form) this.buttons.append(form);
    } catch (error) {
      if (upload.state === "forgotten") return;
      this.offer(walks);
      this.say(error instanceof ServiceError ? error.message : `Failed: ${error.message}`, true);
    }
  }

  fitted({ model, kind, left_out: left, notes }) {
    const others = Object.entries(left).map(([name, why]) => `${name} was left out: ${why}.`);
    this.models.add(model);
    this.say(`Model ${model} (${kind}). ${[...notes, ...others].join(" ")}`);
    const walk = make("button", { type: "button", className: "strong", textContent: "Use model" });
    walk.addEventListener("click", async () => {
      await this.upload.app.load(model);
      await this.upload.app.listModels();
    });
    this.buttons.replaceChildren(walk);
  }

  say(words, bad = false) {
    this.words.textContent = words;
    this.words.classList.toggle("bad", bad);
  }
}

/** A model's name from a file's, which nobody can guess. */
function nameFor(file) {
  const stem = file.toLowerCase().replace(/\.[^.]*$/, "").replace(/[^a-z0-9]+/g, "-").replace(/^-+|-+$/g, "").slice(0, 24);
  const secret = Array.from(crypto.getRandomValues(new Uint8Array(12)), (byte) => byte.toString(36).padStart(2, "0")).join("");
  return `${stem || "walk"}-${secret}`;
}

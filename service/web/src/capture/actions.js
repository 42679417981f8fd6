// What can be done with capture that was read: name its points, save it in another format, report on its gait.

import { resultOf } from "../api/jobs.js";
import { ServiceError } from "../api/requests.js";
import { fileName, save } from "../controls/download.js";
import { GaitDialogue } from "../gait/dialogue.js";
import { make } from "../controls/widgets.js";

const FORMATS = {
  BVH: ["model/x-bvh", "bvh", "Skeleton and angles, for animation software"],
  C3D: ["application/x-c3d", "c3d", "Joint positions, for gait software"],
  GLB: ["model/gltf-binary", "glb", "The body, for 3D viewers"],
  CSV: ["text/csv", "csv", "Angles over time, for spreadsheets"],
  TRC: ["text/x-trc", "trc", "Joint positions, for OpenSim"],
  MOT: ["text/x-mot", "mot", "Joint angles, for OpenSim"],
  NPZ: ["application/x-npz", "npz", "NumPy arrays, for Python"],
};
const NUMBERS = { JSON: ["application/json", "json"], CSV: ["text/csv", "csv"] };
const WANDS = { auto: "used unless they can't be right", use: "used as the published model does", ignore: "ignored" };

/** The buttons below an upload. */
export class CaptureActions {
  constructor(upload) {
    this.upload = upload;
    this.element = make("div", { className: "capture-actions", hidden: true });
    this.note = make("p", { className: "hint" });
    this.note.setAttribute("role", "status");
  }

  /** Offer what can be done; `shown`: the file on the stage, or undefined. */
  show(shown) {
    const { upload } = this;
    this.shown = shown;
    this.links = make("p", { className: "hint" });
    const naming = this.button("Name the points", () => upload.name());
    naming.hidden = !upload.nameable;
    naming.classList.toggle("strong", !shown);
    const forgetting = this.button("Forget the files", () => upload.forget());
    forgetting.title = "Remove the files and all that was made of them from the service";
    const parts = [make("div", { className: "actions" }, naming, forgetting)];
    if (shown) {
      const gait = this.button("Gait analysis", () => this.gait());
      gait.classList.add("strong");
      parts[0].prepend(gait, this.button("Gait report", () => this.report()));
      const saving = Object.entries(FORMATS).map(([name, format]) => this.saving(name, format));
      parts.push(...this.statics(), make("p", { className: "hint", textContent: "Save as" }), make("div", { className: "save" }, ...saving));
      parts.push(...this.filling());
    }
    this.say("");
    this.element.replaceChildren(...parts, this.note, this.links);
    this.element.hidden = false;
  }

  /** The choices of a static trial, if there are several files, and of what is done with wands. */
  statics() {
    const names = this.upload.usable.map(({ name }) => name);
    this.static = make("select", {}, make("option", { value: "", textContent: "none" }), ...names.map((value) => make("option", { value, textContent: value })));
    const chosen = names.length > 1 ? [make("label", { className: "field", textContent: "Static trial" }, this.static)] : [];
    this.wands = make("select", {}, ...Object.entries(WANDS).map(([value, textContent]) => make("option", { value, textContent })));
    return [...chosen, make("label", { className: "field", textContent: "Markers on thighs and shanks" }, this.wands)];
  }

  /** Whether a model fills what the capture doesn't show in files, if there is such. */
  filling() {
    this.fill = make("input", { type: "checkbox" });
    const gaps = this.shown.motion.poses.some((pose) => pose.includes(null));
    const title = "BVH and GLB can't hold unknown limbs. A model of gait can fill them.";
    return gaps ? [make("label", { className: "fill", title }, this.fill, "Fill in what wasn't captured")] : [];
  }

  button(textContent, action) {
    const element = make("button", { type: "button", textContent });
    element.addEventListener("click", async () => {
      element.disabled = true;
      try {
        await action();
      } catch (error) {
        this.say(error instanceof ServiceError ? error.message : `Failed: ${error.message}`, true);
      }
      element.disabled = false;
    });
    return element;
  }

  saving(name, [format, suffix, title]) {
    const element = this.button(name, () => this.convert(name, format, suffix));
    return Object.assign(element, { title });
  }

  async convert(name, format, suffix) {
    this.say(`Creating the ${name} …`);
    const { upload, shown } = this;
    const job = await upload.job("/v1/jobs/convert", upload.sent([shown]), { ...upload.fields, format, fill: this.fill.checked }, () => {});
    const blob = await (await resultOf(job)).blob();
    const file = fileName(this.stem, suffix);
    save(blob, file);
    this.say(`Saved as ${file}: ${(blob.size / 1000).toFixed(0)} kB.`);
  }

  /** The name of the file that is shown, without its suffix. */
  get stem() {
    return this.shown.name.replace(/\.[^.]*$/, "");
  }

  /** Show the gait in all files. */
  async gait() {
    const report = await (await resultOf(await this.reported("application/json"))).json();
    this.say("");
    new GaitDialogue(report, report.person || this.shown.name, this.stem).open();
  }

  /** Create the report, open it, and link to it. */
  async report() {
    this.links.replaceChildren();
    const { result } = await this.reported("text/html");
    this.say("The report is ready.");
    const open = make("a", { href: result, target: "_blank", rel: "noopener", textContent: "Open the report" });
    const numbers = Object.entries(NUMBERS).map(([name, [format, suffix]]) => this.button(name, () => this.numbers(format, suffix)));
    this.links.replaceChildren(open, " or save its numbers as ", ...numbers);
    window.open(result, "_blank", "noopener"); // a browser may block it, hence the link
  }

  async numbers(format, suffix) {
    const job = await this.reported(format);
    const name = fileName(this.stem, "gait-report", suffix);
    save(await (await resultOf(job)).blob(), name);
    this.say(`Saved as ${name}.`);
  }

  /** The job of a report that is done. */
  reported(format) {
    const { upload } = this;
    this.say("Creating the report …");
    const fields = { ...upload.fields, format, static: this.static.value, wands: this.wands.value };
    return upload.job("/v1/jobs/report", upload.sent(upload.usable), fields, (words) => this.say(words));
  }

  say(words, bad = false) {
    this.note.textContent = words;
    this.note.classList.toggle("bad", bad);
  }
}

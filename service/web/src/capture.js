// Somebody's own motion capture: uploaded, looked into, cut into cycles and fitted, each step to be watched.

import { ask, Trouble } from "./api.js";
import { parameters } from "./models.js";
import { CaptureWalker } from "./recorded.js";
import { make } from "./sliders.js";

const KINDS = ".bvh,.c3d,.amc,.asf,.trc,.npz";
const WAIT = 20; // [s] that the service holds an answer back until something changes
const STEPS = ["Sent", "Read", "Cut into cycles", "Fitted"];
const UNTOLD = "AMC files don't say their frame rate: fill in frames per second (120 for CMU's), then choose them again.";
const NO_WALK = "No straight walk of at least two strides was found, so there is nothing to fit.";
const NO_BODY = "The points were read, but no whole body was recognised in them, so there is nothing to fit.";
const UNREAD = "That couldn't be read. Why is said below; what the file doesn't say can be filled in above. Then choose it again.";
const UNITS = ["", "m", "dm", "cm", "mm", "inch", "cmu"];

/** The panel in an element; `app` shows what is found. */
export function capturePanel(element, app) {
  const input = make("input", { type: "file", multiple: true, accept: KINDS });
  input.setAttribute("aria-label", "Motion-capture files");
  const drop = make("label", { className: "drop" }, input, "Drop BVH, C3D, AMC with its ASF, TRC or NPZ here, or click to choose");
  const { fps, unit, fields } = details();
  const report = make("div", {});
  report.setAttribute("role", "status");
  element.append(drop, fields, report);

  const take = async (files) => {
    if (!files.length || input.disabled) return;
    if (!fps.value && [...files].some(({ name }) => /\.amc$/i.test(name))) {
      fields.open = true;
      fps.focus();
      report.replaceChildren(make("p", { className: "hint bad", textContent: UNTOLD }));
      input.value = "";
      return;
    }
    input.disabled = true;
    const run = new Run(report, app, { fps: fps.value, unit: unit.value });
    fields.open = !(await run.all([...files])) || fields.open;
    input.disabled = false;
    input.value = "";
  };
  input.addEventListener("change", () => take(input.files));
  for (const event of ["dragover", "dragleave", "drop"]) {
    // Anywhere on the page: a browser that is handed a file elsewhere leaves the page for it.
    addEventListener(event, (happened) => {
      happened.preventDefault();
      drop.classList.toggle("over", event === "dragover");
      if (event !== "dragleave") drop.scrollIntoView({ block: "nearest" });
      if (event === "drop") take(happened.dataTransfer.files);
    });
  }
}

/** What some files don't say of themselves. */
function details() {
  const fps = make("input", { type: "number", min: 1, max: 10000, step: "any", placeholder: "as in the file" });
  const unit = make("select", {}, ...UNITS.map((value) => make("option", { value, textContent: value || "as in the file" })));
  const fields = make(
    "details",
    { className: "inner" },
    make("summary", { textContent: "If the file doesn't say" }),
    make("label", { className: "field", textContent: "Frames per second" }, fps),
    make("label", { className: "field", textContent: "Unit of length" }, unit),
  );
  return { fps, unit, fields };
}

/** One upload, from the files to a model. */
class Run {
  constructor(element, app, options) {
    this.app = app;
    this.options = options;
    this.rows = STEPS.map((name) => make("li", { textContent: name }));
    this.bar = make("progress", { max: 1, value: 0 });
    this.bar.setAttribute("aria-label", "Progress");
    this.words = make("p", { className: "hint" });
    this.words.setAttribute("role", "status");
    this.found = make("ul", { className: "found" });
    this.buttons = make("div", { className: "actions" });
    element.replaceChildren(make("ol", { className: "steps" }, ...this.rows), this.bar, this.words, this.found, this.buttons);
  }

  /** All steps; what goes wrong ends them and is said. Whether the files could be read. */
  async all(files) {
    let read = true;
    try {
      this.step(0, "Sending …");
      const inspection = await this.job("/v1/jobs/inspect", files, {}, 1);
      const walks = this.inspected(inspection);
      const some = (part) => inspection.files.some((file) => file[part]);
      read = some("points");
      if (!walks.length) throw new Trouble(some("motion") ? NO_WALK : read ? NO_BODY : UNREAD);
      const names = new Set(walks.map((file) => file.name));
      const used = files.filter(({ name }) => /\.asf$/i.test(name) || names.has(name) || names.size === files.length);
      this.step(3, "Fitting a model to the cycles …");
      const kind = people(walks) > 1 ? "eigenwalkers" : "fpca";
      const fitted = await this.job("/v1/models", used, { kind, name: nameFor(files[0].name) }, 3);
      this.done(fitted);
    } catch (error) {
      this.failed(error);
    }
    return read;
  }

  /** Let a job run; its result. */
  async job(path, files, fields, step) {
    const form = new FormData();
    for (const [name, value] of Object.entries({ ...this.options, ...fields })) if (value) form.append(name, value);
    for (const file of files) form.append("files", file, file.name);
    const answer = await ask(path, { method: "POST", body: form });
    let status = await answer.json();
    while (status.status === "queued" || status.status === "running") {
      const words = status.status === "queued" ? "Waiting for its turn …" : status.message || "Working …";
      this.step(step, words, status.progress);
      status = await (await ask(`/v1/jobs/${status.id}?wait=${WAIT}`)).json();
    }
    if (status.status !== "done") throw new Trouble(status.error?.detail ?? "It was cancelled.");
    return (await ask(status.result)).json();
  }

  /** Say and show what was found; the files that are walks. */
  inspected({ files }) {
    this.step(files.some((file) => file.points) ? 2 : 1, "");
    this.found.replaceChildren(...files.map((file) => make("li", { textContent: said(file) })));
    const shown = files.find((file) => file.walk) ?? files.find((file) => file.motion);
    if (shown) this.show(shown);
    return files.filter((file) => file.walk);
  }

  async show(file) {
    this.app.invite(new CaptureWalker(await parameters("walk/fpca"), file.motion, file.walk));
  }

  async done({ model, kind, left_out: left }) {
    this.rows.forEach((row) => (row.className = "done"));
    this.bar.hidden = true;
    const others = Object.entries(left).map(([name, why]) => `${name} was left out: ${why}.`);
    this.words.textContent = `The model is called ${model} (${kind}). ${others.join(" ")}`;
    const walk = make("button", { type: "button", className: "strong", textContent: "Walk with it" });
    const forget = make("button", { type: "button", textContent: "Forget it" });
    walk.addEventListener("click", () => this.app.load(model));
    forget.addEventListener("click", () => this.forget(model));
    this.buttons.replaceChildren(walk, forget);
    await this.app.listModels();
  }

  async forget(model) {
    try {
      await ask(`/v1/models/${model}`, { method: "DELETE" });
      this.buttons.replaceChildren();
      this.words.textContent = "It is forgotten.";
      if (this.app.state.model === model) await this.app.load("walk/fpca");
      await this.app.listModels();
    } catch (error) {
      this.failed(error);
    }
  }

  step(number, words, progress = null) {
    this.rows.forEach((row, i) => (row.className = i < number ? "done" : i === number ? "doing" : ""));
    if (progress === null) this.bar.removeAttribute("value");
    else this.bar.value = progress;
    this.words.textContent = words;
  }

  failed(error) {
    this.bar.hidden = true;
    this.words.classList.add("bad");
    this.words.textContent = error instanceof Trouble ? error.message : `That went wrong: ${error.message}`;
  }
}

/** What is in a file, in a sentence. */
function said({ name, problem, points, frames, fps, motion, walk }) {
  if (!points) return problem.startsWith(name) ? problem : `${name}: ${problem}`;
  const body = motion ? `, a body of ${motion.height.toFixed(2)} m` : "";
  const read = `${name}: ${points.length} points, ${frames} frames at ${Math.round(fps)}/s${body}`;
  if (!walk) return `${read}. ${problem ?? ""}`;
  return `${read}; ${walk.starts.length} strides of ${walk.stride.toFixed(2)} s at ${walk.speed.toFixed(2)} m/s.`;
}

/** How many people the files are of: what is before the first _ says who. */
const people = (files) => new Set(files.map(({ name }) => name.split("_")[0])).size;

/** A name for a model, after the file that it comes from. */
function nameFor(file) {
  const stem = file.toLowerCase().replace(/\.[^.]*$/, "").replace(/[^a-z0-9]+/g, "-").replace(/^-+|-+$/g, "").slice(0, 40);
  return `${stem || "walk"}-${Date.now().toString(36).slice(-5)}`;
}

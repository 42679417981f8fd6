// Upload of motion capture: inspect it, cut it into gait cycles and fit a model, with progress.

import { request, ServiceError } from "../api/requests.js";
import { parameters } from "./model_list.js";
import { CaptureWalker } from "../walkers/recorded.js";
import { make } from "./widgets.js";

const KINDS = ".bvh,.c3d,.amc,.asf,.trc,.npz";
const WAIT = 20; // [s] for long polling
const STEPS = ["Upload", "Read", "Find gait cycles", "Fit"];
const UNTOLD = "AMC files don't contain their frame rate: enter the frames per second (120 for CMU), then choose the files again.";
const NO_WALK = "Nothing to fit: the files contain no straight walk of at least two strides.";
const NO_BODY = "Nothing to fit: the points were read, but they don't contain a whole body.";
const UNREAD = "The file couldn't be read, for the reason below. Missing information can be entered above; then choose it again.";
const UNITS = ["", "m", "dm", "cm", "mm", "inch", "cmu"];

/** Build the panel in an element; `app` shows the result. */
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
    // On the whole page: a browser leaves the page for a file that is dropped elsewhere.
    addEventListener(event, (happened) => {
      happened.preventDefault();
      drop.classList.toggle("over", event === "dragover");
      if (event !== "dragleave") drop.scrollIntoView({ block: "nearest" });
      if (event === "drop") take(happened.dataTransfer.files);
    });
  }
}

/** Fields for what some files don't contain. */
function details() {
  const fps = make("input", { type: "number", min: 1, max: 10000, step: "any", placeholder: "as in the file" });
  const unit = make("select", {}, ...UNITS.map((value) => make("option", { value, textContent: value || "as in the file" })));
  const fields = make(
    "details",
    { className: "inner" },
    make("summary", { textContent: "Missing information" }),
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

  /** Run all steps; returns whether the files could be read. */
  async all(files) {
    let read = true;
    try {
      this.step(0, "Uploading …");
      const inspection = await this.job("/v1/jobs/inspect", files, {}, 1);
      const walks = this.inspected(inspection);
      const some = (part) => inspection.files.some((file) => file[part]);
      read = some("points");
      if (!walks.length) throw new ServiceError(some("motion") ? NO_WALK : read ? NO_BODY : UNREAD);
      const names = new Set(walks.map((file) => file.name));
      const used = files.filter(({ name }) => /\.asf$/i.test(name) || names.has(name) || names.size === files.length);
      this.step(3, "Fitting a model …");
      const kind = people(walks) > 1 ? "eigenwalkers" : "fpca";
      const fitted = await this.job("/v1/models", used, { kind, name: nameFor(files[0].name) }, 3);
      this.done(fitted);
    } catch (error) {
      this.failed(error);
    }
    return read;
  }

  /** Run a job and return its result. */
  async job(path, files, fields, step) {
    const form = new FormData();
    for (const [name, value] of Object.entries({ ...this.options, ...fields })) if (value) form.append(name, value);
    for (const file of files) form.append("files", file, file.name);
    const answer = await request(path, { method: "POST", body: form });
    let status = await answer.json();
    while (status.status === "queued" || status.status === "running") {
      const words = status.status === "queued" ? "Queued …" : status.message || "Working …";
      this.step(step, words, status.progress);
      status = await (await request(`/v1/jobs/${status.id}?wait=${WAIT}`)).json();
    }
    if (status.status !== "done") throw new ServiceError(status.error?.detail ?? "The job was cancelled.");
    return (await request(status.result)).json();
  }

  /** Show the inspection; returns the files that are walks. */
  inspected({ files }) {
    this.step(files.some((file) => file.points) ? 2 : 1, "");
    this.found.replaceChildren(...files.map((file) => make("li", { textContent: describe(file) })));
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
    this.words.textContent = `Model ${model} (${kind}). ${others.join(" ")}`;
    const walk = make("button", { type: "button", className: "strong", textContent: "Use model" });
    const forget = make("button", { type: "button", textContent: "Delete model" });
    walk.addEventListener("click", () => this.app.load(model));
    forget.addEventListener("click", () => this.forget(model));
    this.buttons.replaceChildren(walk, forget);
    await this.app.listModels();
  }

  async forget(model) {
    try {
      await request(`/v1/models/${model}`, { method: "DELETE" });
      this.buttons.replaceChildren();
      this.words.textContent = "Model deleted.";
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
    this.words.textContent = error instanceof ServiceError ? error.message : `Failed: ${error.message}`;
  }
}

/** The content of a file as a sentence. */
function describe({ name, problem, points, frames, fps, motion, walk }) {
  if (!points) return problem.startsWith(name) ? problem : `${name}: ${problem}`;
  const body = motion ? `, a body of ${motion.height.toFixed(2)} m` : "";
  const read = `${name}: ${points.length} points, ${frames} frames at ${Math.round(fps)}/s${body}`;
  if (!walk) return `${read}. ${problem ?? ""}`;
  return `${read}; ${walk.starts.length} strides of ${walk.stride.toFixed(2)} s at ${walk.speed.toFixed(2)} m/s.`;
}

/** Number of people: the part of a file name before the first _ identifies one. */
const people = (files) => new Set(files.map(({ name }) => name.split("_")[0])).size;

/** A model name made from a file name. */
function nameFor(file) {
  const stem = file.toLowerCase().replace(/\.[^.]*$/, "").replace(/[^a-z0-9]+/g, "-").replace(/^-+|-+$/g, "").slice(0, 40);
  return `${stem || "walk"}-${Date.now().toString(36).slice(-5)}`;
}

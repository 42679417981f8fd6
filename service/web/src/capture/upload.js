// One upload of motion capture: read, shown, cut into gait cycles, handed on as files and as a report, and, if asked, fitted.

import { request, ServiceError } from "../api/requests.js";
import { finished, resultOf } from "../api/jobs.js";
import { parameters } from "../controls/model_list.js";
import { make } from "../controls/widgets.js";
import { sided } from "../gait/dialogue.js";
import { CaptureWalker } from "../walkers/recorded.js";
import { CaptureActions } from "./actions.js";
import { Dialogue } from "./dialogue.js";
import { Fitting } from "./fitting.js";
import { hashOf, remember, remembered } from "./marker_map.js";

const STEPS = ["Upload", "Read", "Find gait cycles"];
const NO_WALK = "The files contain no stride of a walk.";
const NO_BODY = "The points were read, but their names are those of no known marker set: say which point is which.";
const UNREAD = "The file couldn't be read, for the reason below. Say above how to read it, then read it again.";

/**
 * An upload. `files`: of the browser; `options`: frame rate, unit, axis and person, where the user gave them. `told()` is
 * called when its `state` changes: "waiting", "reading", "read", "failed", "forgotten".
 *
 * What the service makes of it is unlisted: only who has the address knows of it.
 */
export class Upload {
  constructor(app, files, options, told) {
    this.element = make("div", {});
    Object.assign(this, { app, files, told, options: { ...options, listed: "false" }, state: "waiting" });
    this.label = files.length > 1 ? `${files[0].name} and ${files.length - 1} more` : files[0].name;
    this.jobs = []; // ids of all jobs of this upload
    this.shown = null; // id of the inspection of what is shown
    this.mapped = null; // { map, names }: the marker map in use, and the points of the files that it is for
    this.rows = STEPS.map((name) => make("li", { textContent: name }));
    this.bar = make("progress", { max: 1, value: 0 });
    this.bar.setAttribute("aria-label", "Progress");
    this.words = make("p", { className: "hint" });
    this.words.setAttribute("role", "status");
    this.found = make("ul", { className: "found" });
    this.actions = new CaptureActions(this);
    this.fitting = new Fitting(this);
    const steps = make("ol", { className: "steps" }, ...this.rows);
    this.element.replaceChildren(steps, this.bar, this.words, this.found, this.actions.element, this.fitting.element);
  }

  /** Go into another `state`. */
  enter(state) {
    this.state = state;
    this.told();
  }

  /** Take all steps; returns whether the files could be read. */
  async run() {
    let read = true;
    this.enter("reading");
    try {
      this.step(0, "Uploading …");
      this.inspection = await this.inspect();
      const known = this.inspection.files.find(({ points }) => points && remembered(points));
      if (known) await this.apply(remembered(known.points), known.points);
      read = this.inspection.files.some(({ points }) => points);
      if (this.state === "forgotten") return true;
      await this.evaluate();
    } catch (error) {
      if (this.state === "forgotten") return true;
      this.failed(error);
    }
    return read;
  }

  /** The state of a job on files that is done; arguments as of `finished`. */
  job(path, files, fields, told) {
    return finished(path, files, fields, told, (id) => this.jobs.push(id));
  }

  /** Have the service remove the files and all that was made of them, models too, and return to the models. */
  async forget() {
    await Promise.all(this.jobs.splice(0).map(removed));
    if (this.fitting.models.has(this.app.state.model)) await this.app.load("walk/fpca");
    if (this.guest && this.app.guest === this.guest) this.app.invite(null);
    this.app.forget();
    await this.app.listModels();
    this.element.replaceChildren(make("p", { className: "hint", textContent: "Forgotten: the service has removed the files and all that was made of them." }));
    this.enter("forgotten");
  }

  /** Bring its walker onto the stage again. */
  show() {
    if (this.guest && this.app.guest !== this.guest) this.app.invite(this.guest, this.shown);
  }

  /** The service's `Inspection` of all files. */
  async inspect() {
    const job = await this.job("/v1/jobs/inspect", this.files, this.options, (words, progress) => this.step(1, words, progress));
    this.shown = job.id;
    this.named = new Map(job.files.map((name, i) => [name, this.files[i]])); // names as the service keeps them
    return (await resultOf(job)).json();
  }

  /** Read the files with these points by a marker map, and keep it if one becomes a motion. Returns the problem if none does, or null. */
  async apply(map, points) {
    const hash = hashOf(points);
    const alike = this.inspection.files.filter((file) => file.points && hashOf(file.points) === hash);
    const job = await this.job("/v1/jobs/inspect", this.sent(alike), { ...this.options, map }, () => {});
    const { files } = await (await resultOf(job)).json();
    if (!files.some((file) => file.motion)) return files[0].problem;
    this.shown = job.id;
    const fresh = new Map(files.map((file) => [file.name, file]));
    this.inspection.files = this.inspection.files.map((file) => fresh.get(file.name) ?? file);
    this.mapped = { map, hash };
    remember(points, map);
    return null;
  }

  /** Show what was read. */
  async evaluate() {
    const { files } = this.inspection;
    const some = (part) => files.some((file) => file[part]);
    this.bar.hidden = false;
    this.words.classList.remove("bad");
    this.step(some("points") ? 2 : 1, "");
    this.found.replaceChildren(...files.map((file) => make("li", { textContent: describe(file) })));
    const shown = this.usable.find((file) => file.walk) ?? this.usable[0];
    this.guest = shown ? new CaptureWalker(await parameters("walk/fpca"), shown) : null;
    if (shown) this.app.invite(this.guest, this.shown);
    this.actions.show(shown);
    const walks = this.usable.filter((file) => file.walk);
    this.fitting.offer(walks);
    if (!walks.length) throw new ServiceError(some("motion") ? NO_WALK : some("points") ? NO_BODY : UNREAD);
    this.done("");
    this.enter("read");
  }

  /** The files that are motion; with a marker map, only those that it is for. */
  get usable() {
    return this.inspection.files.filter(({ motion, points }) => motion && (!this.mapped || hashOf(points) === this.mapped.hash));
  }

  /** The fields that every job on `usable` files needs. */
  get fields() {
    return { ...this.options, ...(this.mapped && { map: this.mapped.map }) };
  }

  /** The files of the browser behind those of an inspection, and all skeletons. */
  sent(inspected) {
    const skeletons = this.files.filter(({ name }) => /\.asf$/i.test(name));
    return [...skeletons, ...inspected.map(({ name }) => this.named.get(name))];
  }

  /** The file that can be told which point is which, or undefined: the one that isn't a motion yet, or the one that is shown. */
  get nameable() {
    const { files, pose } = this.inspection;
    const named = files.filter(({ points }) => points && points.join() !== pose.join());
    return named.find(({ motion }) => !motion) ?? named[0];
  }

  /** Let the user say which point is which. */
  async name() {
    const file = this.nameable;
    const check = async (map) => {
      const fields = { ...this.options, ...(map && { map }) };
      const job = await this.job("/v1/jobs/points", this.sent([file]), fields, () => {});
      return (await resultOf(job)).json();
    };
    const use = async (map) => {
      const problem = await this.apply(map, file.points);
      if (problem === null) this.evaluate().catch((error) => this.failed(error));
      return problem;
    };
    this.app.naming = new Dialogue(await check(remembered(file.points)), { check, use });
    this.app.naming.open();
  }

  step(number, words, progress = null) {
    this.rows.forEach((row, i) => (row.className = i < number ? "done" : i === number ? "doing" : ""));
    if (progress === null) this.bar.removeAttribute("value");
    else this.bar.value = progress;
    this.words.textContent = words;
  }

  /** All steps are taken. */
  done(words) {
    this.rows.forEach((row) => (row.className = "done"));
    this.bar.hidden = true;
    this.words.textContent = words;
  }

  failed(error) {
    this.enter(this.guest ? "read" : "failed");
    this.bar.hidden = true;
    this.words.classList.add("bad");
    this.words.textContent = error instanceof ServiceError ? error.message : `Failed: ${error.message}`;
  }
}

/** Remove a job: if it is still going on, it is cancelled first. */
async function removed(id) {
  const answer = await request(`/v1/jobs/${id}`, { method: "DELETE" });
  if (answer.status === 200) await request(`/v1/jobs/${id}`, { method: "DELETE" });
}

/** The content of a file as a sentence. */
function describe({ name, problem, points, frames, fps, notes, doubts, motion, walk, strides }) {
  if (!points) return problem.startsWith(name) ? problem : `${name}: ${problem}`;
  const body = motion ? `, a body of ${motion.height.toFixed(2)} m` : "";
  const said = [...(doubts ?? []).map((doubt) => `not plausible: ${doubt}`), ...(notes ?? [])];
  const noted = said.length ? ` (${said.join("; ")})` : "";
  const read = `${name}: ${points.length} points, ${frames} frames at ${Math.round(fps)}/s${body}${noted}`;
  if (!walk) return `${read}. ${problem ?? ""}`;
  const many = strides ? sided(strides) : `strides (${problem})`;
  return `${read}; ${many} of ${walk.stride.toFixed(2)} s at ${walk.speed.toFixed(2)} m/s.`;
}

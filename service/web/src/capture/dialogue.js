// The dialogue in which the user says which point of a capture file is which landmark of the body.

import { save } from "../controls/download.js";
import { make } from "../controls/widgets.js";
import { Dots } from "./dots.js";
import { BONES, grouped, needed, sideOf, titleOf, wordsOf as words } from "./landmarks.js";
import { alone, MapEditor, toToml } from "./marker_map.js";

const HINT = "Choose a landmark, then click its dot or pick its name. Leave out what the file doesn't have.";
const button = (textContent, properties = {}) => make("button", { type: "button", textContent, ...properties });

/**
 * The dialogue, about the points of one file.
 *
 * `found`: `CapturePoints` of the service. `check(map)` resolves to those with another map (TOML), and `use(map)` uses
 * the map and resolves to why it can't be used, or to null; both throw errors with messages for the user.
 */
export class Dialogue {
  constructor(found, { check, use }) {
    Object.assign(this, { found, check, use });
    this.groups = grouped(Object.keys(found.landmarks));
    this.landmarks = Object.values(this.groups).flat();
    this.editor = new MapEditor(new Map(Object.entries(found.assigned)));
    this.selected = this.landmarks.find((landmark) => !this.editor.entries.has(landmark)) ?? this.landmarks[0];
    this.build();
  }

  /** Show it. */
  open() {
    document.body.append(this.dialog);
    this.dialog.showModal();
    const { positions, points: names, heading, assigned } = this.found;
    const body = Object.values(assigned).flatMap(Object.keys);
    this.dots = new Dots(this.canvas, { positions, names, heading, body }, {
      chosen: (point) => this.click(point),
      look: (point) => this.look(point),
      bones: () => this.bones(),
    });
    this.update();
    this.rows.get(this.selected).input.focus();
  }

  build() {
    this.canvas = make("canvas", { tabIndex: 0 });
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "The points of the file in 3D. Drag or press the arrow keys to look from another side; plus and minus zoom.");
    this.status = make("p", { className: "status" });
    this.status.setAttribute("role", "status");
    const all = make("input", { type: "checkbox" });
    all.addEventListener("change", () => {
      this.dots.labels = all.checked;
      this.dots.draw();
    });
    const names = make("label", { className: "tick" }, all, make("span", { textContent: "All names" }));
    const view = make("div", { className: "naming-view" }, this.canvas, names);
    const side = make("div", { className: "naming-side" }, this.chooser(), this.list());
    const title = make("h2", { id: "naming-title", textContent: `Which point is which? ${this.found.name}` });
    const header = make("header", {}, title, make("p", { className: "hint", textContent: HINT }));
    this.dialog = make("dialog", { className: "naming" }, header, view, side, this.footer());
    this.dialog.setAttribute("aria-labelledby", title.id);
    this.listen();
  }

  listen() {
    const { dialog } = this;
    for (const event of ["keydown", "dragover", "drop"]) {
      dialog.addEventListener(event, (happened) => happened.stopPropagation()); // the page's keys and files are its own
    }
    dialog.addEventListener("dragover", (event) => event.preventDefault());
    dialog.addEventListener("drop", (event) => {
      event.preventDefault();
      this.load(event.dataTransfer.files[0]);
    });
    dialog.addEventListener("keydown", (event) => {
      if (event.key !== "z" || !(event.ctrlKey || event.metaKey)) return;
      event.preventDefault();
      this.undo();
    });
    dialog.addEventListener("close", () => {
      this.dots.close();
      dialog.remove();
    });
  }

  /** The selected landmark: what it is, and a list of points to choose from. */
  chooser() {
    this.title = make("h3", {});
    this.description = make("p", { className: "hint" });
    const options = this.found.points.map((name) => make("option", { value: name, textContent: name }));
    this.select = make("select", {}, make("option", { value: "", textContent: "none" }), ...options);
    this.select.setAttribute("aria-label", "Point");
    this.select.addEventListener("change", () => {
      if (this.select.value) this.assign(this.selected, this.select.value);
      else this.clear();
    });
    this.clearing = button("Clear", { onclick: () => this.clear() });
    return make("div", { className: "chooser" }, this.title, this.description, make("div", { className: "pick" }, this.select, this.clearing));
  }

  /** All landmarks in groups. */
  list() {
    this.rows = new Map();
    this.counts = new Map();
    const groups = Object.entries(this.groups);
    this.needs = make("p", { className: "needs hint" });
    return make(
      "div",
      { className: "landmarks" },
      this.needs,
      ...groups.map(([group, landmarks]) => {
        const count = make("span", { className: "hint" });
        this.counts.set(count, landmarks);
        const rows = landmarks.map((landmark) => this.row(landmark));
        return make("fieldset", {}, make("legend", {}, group, " ", count), ...rows);
      }),
    );
  }

  row(landmark) {
    const input = make("input", { type: "radio", name: "landmark", value: landmark, className: "quiet" });
    const point = make("span", { className: "point" });
    input.addEventListener("change", () => this.choose(landmark));
    this.rows.set(landmark, { input, point });
    const swatch = make("span", { className: `swatch ${sideOf(landmark)}` });
    return make("label", {}, input, swatch, make("span", { textContent: titleOf(landmark, true) }), point);
  }

  footer() {
    this.undoing = button("Undo", { onclick: () => this.undo(), title: "Take back the last change (Ctrl+Z)" });
    const empty = button("Clear all", { onclick: () => this.replace(new Map(), "All cleared.") });
    const file = make("input", { type: "file", accept: ".toml" });
    file.setAttribute("aria-label", "Load a marker map");
    file.addEventListener("change", () => this.load(file.files[0]).then(() => (file.value = "")));
    const loading = make("label", { className: "loading" }, file, make("span", { textContent: "Load map" }));
    const saving = button("Save map", { onclick: () => this.save(), title: "As TOML, for motionenv's --map and for colleagues" });
    const cancelling = button("Cancel", { onclick: () => this.dialog.close() });
    this.using = button("Use these points", { className: "strong", onclick: () => this.done() });
    const [editing, ending] = [
      [this.undoing, empty, loading, saving],
      [cancelling, this.using],
    ].map((buttons) => make("div", { className: "actions" }, ...buttons));
    return make("footer", {}, this.status, editing, ending);
  }

  /** Select a landmark. */
  choose(landmark) {
    this.selected = landmark;
    this.update();
  }

  /** A dot was clicked: it is the selected landmark, and the next landmark without a point is selected. */
  click(point) {
    const landmark = this.selected;
    if (alone(this.editor.entries.get(landmark)) === point) {
      this.say(`${point} is the ${words(landmark)} already.`);
      return;
    }
    const after = this.landmarks.slice(this.landmarks.indexOf(landmark) + 1);
    const before = this.assign(landmark, point);
    this.selected = after.find((other) => other !== before && !this.editor.entries.has(other)) ?? landmark;
    this.update();
    this.rows.get(this.selected).input.closest("label").scrollIntoView({ block: "nearest" });
  }

  /** Let a point mark a landmark; returns the landmark that loses it, or undefined. */
  assign(landmark, point) {
    const before = this.editor.assign(landmark, point);
    const lost = before ? ` It was the ${words(before)}, which has no point now.` : "";
    this.say(`${point} is the ${words(landmark)}.${lost}`);
    this.update();
    return before;
  }

  clear() {
    this.editor.clear(this.selected);
    this.say(`The ${words(this.selected)} has no point.`);
    this.update();
  }

  undo() {
    this.editor.undo();
    this.say("Undone.");
    this.update();
  }

  replace(entries, said) {
    this.editor.replace(entries);
    this.say(said);
    this.update();
  }

  /** Load a map from a file. */
  async load(file) {
    if (!file) return;
    this.say(`Loading ${file.name} …`);
    try {
      const { assigned, unfound } = await this.check(await file.text());
      const note = unfound.length ? ` The file has no points for: ${unfound.map(words).join(", ")}.` : "";
      this.replace(new Map(Object.entries(assigned)), `Loaded ${file.name}.${note}`);
    } catch (error) {
      this.say(`${file.name}: ${error.message}`, true);
    }
  }

  save() {
    save(new Blob([this.map], { type: "application/toml" }), `${stem(this.found.name)}.toml`);
  }

  /** The map as TOML. */
  get map() {
    return toToml(stem(this.found.name), this.editor.entries);
  }

  async done() {
    const lacking = this.lacking();
    if (lacking) {
      this.say(lacking, true);
      return;
    }
    this.using.disabled = true;
    this.say("Fitting the body …");
    try {
      const problem = await this.use(this.map);
      if (problem === null) this.dialog.close();
      else this.say(problem, true);
    } catch (error) {
      this.say(error.message, true);
    }
    this.using.disabled = false;
  }

  say(text, bad = false) {
    this.status.textContent = text;
    this.status.classList.toggle("bad", bad);
  }

  /** What is still needed, as a sentence; empty if nothing is. */
  lacking() {
    const parts = needed((landmark) => this.editor.entries.has(landmark));
    return parts.length ? `Still needed: ${parts.join("; ")}.` : "";
  }

  /** The points that mark a landmark. */
  pointsOf(landmark) {
    return Object.keys(this.editor.entries.get(landmark) ?? {});
  }

  /** How a point is drawn. */
  look(point) {
    const landmark = this.marks.get(point);
    return { side: landmark && sideOf(landmark), selected: this.pointsOf(this.selected).includes(point), label: landmark && titleOf(landmark) };
  }

  bones() {
    const end = (landmarks) => landmarks.map((landmark) => this.pointsOf(landmark)[0]).find(Boolean);
    return BONES.map(([from, to]) => [end(from), end(to)]);
  }

  /** Show the map as it is now. */
  update() {
    const { entries } = this.editor;
    this.marks = new Map([...entries].flatMap(([landmark, weights]) => Object.keys(weights).map((point) => [point, landmark])));
    for (const [landmark, { input, point }] of this.rows) {
      input.checked = landmark === this.selected;
      point.textContent = this.pointsOf(landmark).join(" + ");
    }
    for (const [count, landmarks] of this.counts) {
      count.textContent = `${landmarks.filter((landmark) => entries.has(landmark)).length} named`;
    }
    this.needs.textContent = this.lacking() || "Enough for a motion. More landmarks show more of the body.";
    this.title.textContent = titleOf(this.selected);
    this.description.textContent = this.found.landmarks[this.selected];
    this.select.value = alone(entries.get(this.selected)) ?? "";
    this.clearing.disabled = !entries.has(this.selected);
    this.undoing.disabled = !this.editor.past.length;
    this.dots.draw();
  }
}

const stem = (name) => name.replace(/\.[^.]*$/, "");

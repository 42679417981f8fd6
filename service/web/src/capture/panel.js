// Upload of motion capture: where files are dropped, and what can be told of them beforehand.

import { make, numberOf } from "../controls/widgets.js";
import { Upload } from "./upload.js";

const KINDS = ".amc,.asf,.bvh,.c3d,.csv,.npz,.trc,.tsv"; // those of the service's uploads, as a test checks
const UNTOLD = "AMC files don't contain their frame rate: enter the frames per second (120 for CMU), then read the files again.";
const STATES = { waiting: "waiting", reading: "being read …", read: "read", failed: "not readable", forgotten: "forgotten" };
const UNITS = ["", "m", "dm", "cm", "mm", "inch", "cmu"];

/** Build the panel in an element; `app` shows the result. */
export function capturePanel(element, app) {
  const input = make("input", { type: "file", multiple: true, accept: KINDS });
  input.setAttribute("aria-label", "Motion-capture files");
  const drop = make("label", { className: "drop" }, input, "Drop BVH, C3D, AMC with its ASF, TRC, NPZ, TSV or CSV here, or click to choose");
  const { fps, unit, up, person, fields } = details();
  const queue = make("ul", { className: "queue" });
  const report = make("div", {});
  element.append(drop, fields, queue, report);

  const uploads = [];
  let kept = []; // the files that were chosen last
  let busy = false;
  const again = make("button", { type: "button", textContent: "Read the files again", hidden: true, onclick: () => take(kept) });
  fields.append(again);

  /** Put an upload's report into the panel, and its walker onto the stage. */
  const show = (upload) => {
    report.replaceChildren(upload.element);
    upload.show();
    list();
  };

  /** All uploads and what has become of them, where there are several. */
  const list = () => {
    queue.hidden = uploads.length < 2;
    const rows = uploads.map((upload) => {
      const button = make("button", { type: "button", textContent: `${upload.label}: ${STATES[upload.state]}`, onclick: () => show(upload) });
      button.setAttribute("aria-pressed", String(report.contains(upload.element)));
      return make("li", {}, button);
    });
    queue.replaceChildren(...rows);
  };

  /** Work on what waits, one upload after the other. */
  const work = async () => {
    if (busy) return;
    busy = true;
    for (let next; (next = uploads.find(({ state }) => state === "waiting")); ) {
      show(next);
      fields.open = !(await next.run()) || fields.open;
    }
    busy = false;
  };

  const take = (files) => {
    if (!files.length || (fps.value && numberOf(fps) === null)) return;
    kept = [...files];
    input.value = "";
    again.hidden = false;
    if (!fps.value && kept.some(({ name }) => /\.amc$/i.test(name))) {
      fields.open = true;
      fps.focus();
      report.replaceChildren(make("p", { className: "hint bad", textContent: UNTOLD }));
      return;
    }
    uploads.push(new Upload(app, kept, { fps: fps.value, unit: unit.value, up: up.value, person: person.value.trim() }, list));
    list();
    work();
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
  const fps = make("input", { type: "number", id: "fps", min: 1, max: 10000, step: "any", placeholder: "as in the file" });
  const unit = make("select", {}, ...UNITS.map((value) => make("option", { value, textContent: value || "as in the file" })));
  const up = make("select", {}, ...["", "x", "y", "z"].map((value) => make("option", { value, textContent: value || "as in the file" })));
  const person = make("input", { type: "text", maxLength: 64, placeholder: "the one with most landmarks" });
  const fields = make(
    "details",
    { className: "inner" },
    make("summary", { textContent: "How to read the files" }),
    make("label", { className: "field", textContent: "Frames per second, from 1 to 10000" }, fps),
    make("label", { className: "field", textContent: "Unit of length" }, unit),
    make("label", { className: "field", textContent: "Vertical axis" }, up),
    make("label", { className: "field", textContent: "Which of several people" }, person),
  );
  return { fps, unit, up, person, fields };
}

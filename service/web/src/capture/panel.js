// Upload of motion capture: where files are dropped, and what can be told of them beforehand.

import { make } from "../controls/widgets.js";
import { Upload } from "./upload.js";

const KINDS = ".amc,.asf,.bvh,.c3d,.csv,.npz,.trc,.tsv"; // those of the service's uploads, as a test checks
const UNTOLD = "AMC files don't contain their frame rate: enter the frames per second (120 for CMU), then read the files again.";
const UNITS = ["", "m", "dm", "cm", "mm", "inch", "cmu"];

/** Build the panel in an element; `app` shows the result. */
export function capturePanel(element, app) {
  const input = make("input", { type: "file", multiple: true, accept: KINDS });
  input.setAttribute("aria-label", "Motion-capture files");
  const drop = make("label", { className: "drop" }, input, "Drop BVH, C3D, AMC with its ASF, TRC, NPZ, TSV or CSV here, or click to choose");
  const { fps, unit, up, person, fields } = details();
  const report = make("div", {});
  element.append(drop, fields, report);

  let kept = []; // the files that were chosen last
  const again = make("button", { type: "button", textContent: "Read the files again", hidden: true, onclick: () => take(kept) });
  fields.append(again);

  const take = async (files) => {
    if (!files.length || input.disabled) return;
    kept = [...files];
    again.hidden = false;
    if (!fps.value && [...files].some(({ name }) => /\.amc$/i.test(name))) {
      fields.open = true;
      fps.focus();
      report.replaceChildren(make("p", { className: "hint bad", textContent: UNTOLD }));
      input.value = "";
      return;
    }
    input.disabled = true;
    const upload = new Upload(report, app, kept, { fps: fps.value, unit: unit.value, up: up.value, person: person.value.trim() });
    fields.open = !(await upload.run()) || fields.open;
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
  const up = make("select", {}, ...["", "x", "y", "z"].map((value) => make("option", { value, textContent: value || "as in the file" })));
  const person = make("input", { type: "text", maxLength: 64, placeholder: "the one with most landmarks" });
  const fields = make(
    "details",
    { className: "inner" },
    make("summary", { textContent: "How to read the files" }),
    make("label", { className: "field", textContent: "Frames per second" }, fps),
    make("label", { className: "field", textContent: "Unit of length" }, unit),
    make("label", { className: "field", textContent: "Vertical axis" }, up),
    make("label", { className: "field", textContent: "Which of several people" }, person),
  );
  return { fps, unit, up, person, fields };
}

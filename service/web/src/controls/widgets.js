// Form widgets: slider and choice.

const part = (tag, properties, ...inside) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...inside);
  return element;
};

export const capital = (word) => word[0].toUpperCase() + word.slice(1);

/** Create an element with properties and children. */
export const make = part;

/** The number in a field, or null, told below it, if that is none which the field takes. */
export function numberOf(input) {
  const { min, max, step, validity, valueAsNumber } = input;
  const good = validity.valid && Number.isFinite(valueAsNumber);
  const field = input.closest("label");
  const told = field.nextElementSibling?.matches(".wrong") ? field.nextElementSibling : part("p", { className: "hint bad wrong", id: `wrong-${input.id}` });
  told.setAttribute("role", "alert");
  told.textContent = `Enter a ${step === "1" ? "whole " : ""}number from ${min} to ${max}.`;
  if (good) told.remove();
  else if (!told.isConnected) field.after(told);
  input.setAttribute("aria-invalid", String(!good));
  if (good) input.removeAttribute("aria-describedby");
  else input.setAttribute("aria-describedby", told.id);
  return good ? valueAsNumber : null;
}

/** Colour the track between a slider's default and its value. */
function fill(input, home) {
  const share = (value) => (100 * (value - input.min)) / (input.max - input.min);
  const ends = [share(home), share(input.value)].sort((a, b) => a - b);
  input.style.setProperty("--from", `${ends[0]}%`);
  input.style.setProperty("--to", `${ends[1]}%`);
}

/**
 * A slider.
 *
 * `label`: accessible name; `low` and `high`: words at its ends, or `named`: a name in front; `text`: formats a value;
 * `home`: default, restored by a double click; `own`: label of a button that restores the walker's own value.
 * `changed(value)` is called on each change, with null from that button. `held(on)`: called by a button that holds the
 * value while other sliders move. `id`: what the value is of, for who shows it.
 */
export class Slider {
  constructor({ id, label, low, high, named, min, max, step, home = 0, text, own, changed, held }) {
    this.id = id;
    this.home = home;
    this.text = text;
    this.input = part("input", { type: "range", min, max, step, value: home });
    this.input.setAttribute("aria-label", label);
    this.output = part("output", {});
    const words = named
      ? [part("span", { className: "named", textContent: named })]
      : [part("span", { className: "low", textContent: low })];
    this.row = part("div", { className: "slider" }, ...words, this.output);
    if (!named) this.row.append(part("span", { className: "high", textContent: high }));
    this.row.append(this.input);
    if (own) {
      this.own = part("button", { type: "button", className: "own", textContent: "↺", title: capital(own), hidden: true });
      this.own.setAttribute("aria-label", `${named}: ${own}`);
      this.own.addEventListener("click", () => changed(null));
      this.row.append(this.own);
    }
    if (held) {
      this.lock = part("button", { type: "button", className: "lock" });
      this.lock.setAttribute("aria-label", `Hold ${label.split(/[:,]/)[0]}`);
      this.lock.addEventListener("click", () => held(this.lock.getAttribute("aria-pressed") !== "true"));
      this.row.append(this.lock);
    }
    this.input.addEventListener("input", () => changed(this.input.valueAsNumber));
    this.input.addEventListener("dblclick", () => changed(own ? null : this.home));
    this.show(home);
  }

  /** Show `value`; `given`: whether the user chose it; `free`: text if not. */
  show(value, given = false, free = null) {
    this.input.value = value;
    const words = given || free === null ? this.text(value) : free;
    this.output.textContent = words;
    this.input.setAttribute("aria-valuetext", words);
    if (this.own) this.own.hidden = !given;
    fill(this.input, this.own && !given ? value : this.home);
    return this;
  }

  /** Show whether the value is held. */
  hold(on) {
    this.lock.setAttribute("aria-pressed", String(on));
    this.lock.title = on ? "Held: other sliders leave this value as it is. Click to let it move along" : "Moves along with other sliders. Click to hold it";
  }
}

/** A drop-down list; its first option `none` is null. */
export class Choice {
  constructor({ label, choices, none, changed }) {
    const options = [none, ...choices].map((textContent, i) => part("option", { textContent, value: i ? textContent : "" }));
    this.select = part("select", {}, ...options);
    this.select.addEventListener("change", () => changed(this.select.value || null));
    this.row = part("label", { className: "field" }, label, this.select);
  }

  show(value) {
    this.select.value = value ?? "";
  }
}

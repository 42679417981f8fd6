// Two groups of people, for an axis between them.

import { make } from "../controls/widgets.js";

const FEWEST = 2; // people of a group

/** The person in a file: the part of its name before the first _. */
export const personOf = ({ name }) => name.replace(/\.[^.]*$/, "").split("_")[0];

/** A form that puts people into groups; `fit(groups)` is called with people's names by group. Null with too few people. */
export function groupsForm(walks, fit) {
  const people = [...new Set(walks.map(personOf))];
  if (people.length < 2 * FEWEST) return null;
  const names = ["first", "second"].map((which) => {
    const input = make("input", { type: "text", maxLength: 40, placeholder: `${which} group` });
    input.setAttribute("aria-label", `Name of the ${which} group`);
    return input;
  });
  const rows = people.map((person, i) => {
    const options = ["neither", "first", "second"].map((value) => make("option", { value, textContent: value }));
    const select = make("select", {}, ...options);
    select.value = 2 * i < people.length ? "first" : "second";
    return { person, select, row: make("label", { className: "field", textContent: person }, select) };
  });
  const said = make("p", { className: "hint" });
  said.setAttribute("role", "status");
  const button = make("button", { type: "button", textContent: "Fit with this axis" });
  button.addEventListener("click", () => {
    const groups = {};
    names.forEach((input, i) => {
      const which = ["first", "second"][i];
      groups[input.value.trim() || `${which} group`] = rows.filter(({ select }) => select.value === which).map(({ person }) => person);
    });
    const few = Object.values(groups).some((group) => group.length < FEWEST) || Object.keys(groups).length < 2;
    said.textContent = few ? "Each group needs a name of its own and at least two people." : "";
    if (!few) fit(groups);
  });
  const summary = make("summary", { textContent: "An axis between two groups of people" });
  return make("details", { className: "inner" }, summary, ...names, ...rows.map(({ row }) => row), button, said);
}

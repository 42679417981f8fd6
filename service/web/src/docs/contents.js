// Contents of the API's reference at its side: Swagger UI has none.

const made = (tag, properties, ...inside) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...inside);
  return element;
};

/** A link to one operation, which unfolds it. */
function entry(operation) {
  const [method, summary] = ["method", "description"].map((part) => operation.querySelector(`.opblock-summary-${part}`)?.textContent ?? "");
  const link = made("a", { href: `#${operation.id}`, title: operation.querySelector(".opblock-summary-path")?.textContent ?? "" });
  link.append(made("b", { textContent: method }), ` ${summary}`);
  link.addEventListener("click", (event) => {
    event.preventDefault();
    if (!operation.classList.contains("is-open")) operation.querySelector(".opblock-summary-control").click();
    operation.scrollIntoView({ block: "start" });
    contents.open = wide.matches;
  });
  return made("li", {}, link);
}

/** The list of all operations by their tags, once Swagger UI shows them. */
function build() {
  const sections = [...document.querySelectorAll(".opblock-tag-section")];
  if (!sections.some((section) => section.querySelector(".opblock"))) return false;
  const parts = sections.map((section) => {
    const operations = made("ul", {}, ...[...section.querySelectorAll(".opblock")].map(entry));
    return made("li", {}, section.querySelector(".opblock-tag").dataset.tag, operations);
  });
  contents.append(made("ul", {}, ...parts));
  return true;
}

const wide = matchMedia("(min-width: 60rem)");
const contents = made("details", { className: "contents", open: wide.matches }, made("summary", { textContent: "Contents" }));
document.body.prepend(made("nav", { ariaLabel: "Operations" }, contents));
new MutationObserver((_, observer) => build() && observer.disconnect()).observe(document.getElementById("swagger-ui"), { childList: true, subtree: true });

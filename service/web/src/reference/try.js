// The forms of /docs: each sends a request of its own service and shows the answer.

const MOST = 20_000; // characters of an answer that are shown

/** The request that a form describes. */
function requestOf(form, method) {
  const field = (name) => form.elements[name]?.value ?? "";
  const headers = {};
  if (field("key")) headers.Authorization = `Bearer ${field("key")}`;
  if (form.elements.body) {
    headers["Content-Type"] = "application/json";
    headers.Accept = field("accept");
    return { method, headers, body: field("body") };
  }
  if (!form.elements.files) return { method, headers };
  const body = new FormData();
  for (const pair of field("fields").split(" ").filter(Boolean)) {
    const [name, ...value] = pair.split("=");
    body.append(name, value.join("="));
  }
  for (const file of form.elements.files.files) body.append("files", file);
  return { method, headers, body };
}

/** What an answer's body is shown as. */
async function shown(answer) {
  const blob = await answer.blob();
  const kind = answer.headers.get("content-type") ?? "";
  const address = () => URL.createObjectURL(blob);
  if (kind.startsWith("image/")) return Object.assign(new Image(), { src: address(), alt: "The picture of the answer" });
  if (kind.startsWith("video/")) return Object.assign(document.createElement("video"), { src: address(), controls: true, loop: true });
  if (/json|text|bvh/.test(kind)) {
    const text = await blob.text();
    const block = document.createElement("pre");
    block.tabIndex = 0; // it scrolls
    block.textContent = text.length > MOST ? `${text.slice(0, MOST)} …` : text;
    return block;
  }
  const name = kind.split(/[/;]/)[1] ?? "answer";
  return Object.assign(document.createElement("a"), { href: address(), download: name, textContent: `Save ${blob.size} bytes of ${kind || "nothing"}` });
}

async function send(form, { method }, place) {
  place.textContent = "Waiting …";
  const begun = performance.now();
  try {
    const answer = await fetch(form.elements.path.value, requestOf(form, method));
    const line = document.createElement("p");
    const seconds = ((performance.now() - begun) / 1000).toFixed(2);
    line.textContent = `${answer.status} ${answer.statusText} after ${seconds} s`;
    place.replaceChildren(line, await shown(answer));
  } catch (error) {
    place.textContent = `No answer: ${error.message}`;
  }
}

for (const part of document.querySelectorAll("details.try")) {
  part.querySelector("form").addEventListener("submit", (event) => {
    event.preventDefault();
    send(event.target, part.dataset, part.querySelector(".answer"));
  });
}

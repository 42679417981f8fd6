// Asking the service, and what to say when it can't.

import { unpacked } from "./pack.js";

/** Something went wrong; `message` says what, and what to do, in plain words; `again`: in how many seconds to ask again. */
export class Trouble extends Error {
  constructor(words, again = 0) {
    super(words);
    this.again = again;
  }
}

/** A response of the service. Throws Trouble with the service's own words, or what its silence means. */
export async function ask(path, options = {}) {
  let answer;
  try {
    answer = await fetch(path, options);
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Trouble("The service doesn't answer. Is it still running, and are you connected? Then try again.");
  }
  if (answer.ok) return answer;
  const again = answer.status === 503 ? Number(answer.headers.get("retry-after") ?? 2) : 0;
  throw new Trouble(await reason(answer), again);
}

async function reason(answer) {
  const problem = await answer.json().catch(() => ({}));
  const first = problem.errors?.[0];
  const detail = first ? `${first.problem} (${first.field.replace(/^\//, "")})` : (problem.detail ?? "");
  const known = {
    401: "The service asks for a key. Load the page again and give the key as the password.",
    429: `Too many requests. Try again in ${answer.headers.get("retry-after") ?? "a few"} seconds.`,
    503: `The service is busy. Try again in ${answer.headers.get("retry-after") ?? "a few"} seconds. ${detail}`,
    507: "The service's disk is full. Tell whoever runs it.",
  };
  return known[answer.status] ?? `The service said no (${answer.status}): ${detail || answer.statusText}`;
}

const path = (name) => `/v1/models/${name.split("/").map(encodeURIComponent).join("/")}`;

/** A model's numbers. */
export async function parametersOf(name) {
  const answer = await ask(`${path(name)}/parameters`);
  return unpacked(await answer.arrayBuffer());
}

/** Names of all models that walk; those that ship where the service doesn't list them. */
export async function modelNames() {
  const answer = await ask("/v1/models");
  const { models } = await answer.json();
  return models;
}

/** A motion as a file. */
export async function motion({ path, request }, mediaType) {
  const answer = await ask(path, {
    method: "POST",
    headers: { "Content-Type": "application/json", Accept: mediaType },
    body: JSON.stringify(request),
  });
  return answer.blob();
}

// Requests to the service, and messages for its errors.

import { decodeParameters } from "./parameters.js";

/** An error with a message for the user; `retryAfter` [s] is 0 where retrying is useless, `status` 0 without an answer. */
export class ServiceError extends Error {
  constructor(message, { retryAfter = 0, status = 0 } = {}) {
    super(message);
    this.retryAfter = retryAfter;
    this.status = status;
  }
}

/** A successful response. Throws ServiceError with the service's message, or if there is no response. */
export async function request(path, options = {}) {
  let answer;
  try {
    answer = await fetch(path, options);
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new ServiceError("The service doesn't answer. Check that it is running and that you are connected, then try again.");
  }
  if (answer.ok) return answer;
  const retryAfter = answer.status === 503 ? Number(answer.headers.get("retry-after") ?? 2) : 0;
  throw new ServiceError(await reason(answer), { retryAfter, status: answer.status });
}

async function reason(answer) {
  const problem = await answer.json().catch(() => ({}));
  const first = problem.errors?.[0];
  const detail = first ? `${first.problem} (${first.field.replace(/^\//, "")})` : (problem.detail ?? "");
  const known = {
    401: "The service requires a key. Reload the page and enter the key as the password.",
    429: `Too many requests. Try again in ${answer.headers.get("retry-after") ?? "a few"} seconds.`,
    503: `The service is busy. Try again in ${answer.headers.get("retry-after") ?? "a few"} seconds. ${detail}`,
    507: "The service's disk is full. Please tell its operator.",
  };
  return known[answer.status] ?? `The request failed (${answer.status}): ${detail || answer.statusText}`;
}

const path = (name) => `/v1/models/${name.split("/").map(encodeURIComponent).join("/")}`;

/** A model's parameters. */
export async function parametersOf(name) {
  const answer = await request(`${path(name)}/parameters`);
  return decodeParameters(await answer.arrayBuffer());
}

/** The models of the service. */
export async function models() {
  const answer = await request("/v1/models");
  const { models } = await answer.json();
  return models;
}

/** The gait of a walk that a model makes. */
export async function gaitOf(body) {
  const headers = { "Content-Type": "application/json" };
  return (await request("/v1/gait", { method: "POST", headers, body: JSON.stringify(body) })).json();
}

/** A motion as a file. */
export async function motion({ path, body }, mediaType) {
  const answer = await request(path, {
    method: "POST",
    headers: { "Content-Type": "application/json", Accept: mediaType },
    body: JSON.stringify(body),
  });
  return answer.blob();
}

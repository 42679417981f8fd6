// Jobs of the service: long-running work on uploaded files.

import { request, ServiceError } from "./requests.js";

const WAIT = 20; // [s] for long polling

/**
 * The state of a job that is done, started with `files` and the `fields` that aren't empty.
 *
 * `told(words, progress)` is called with each step, and `begun(id)` when there is a job. Throws ServiceError if the job fails.
 */
export async function finished(path, files, fields, told, begun = () => {}) {
  const form = new FormData();
  for (const [name, value] of Object.entries(fields)) if (value) form.append(name, value);
  for (const file of files) form.append("files", file, file.name);
  let job = await (await request(path, { method: "POST", body: form })).json();
  begun(job.id);
  while (job.status === "queued" || job.status === "running") {
    told(job.status === "queued" ? "Queued …" : job.message || "Working …", job.progress);
    job = await (await request(`/v1/jobs/${job.id}?wait=${WAIT}`)).json();
  }
  if (job.status !== "done") throw new ServiceError(job.error?.detail ?? "The job was cancelled.");
  return job;
}

/** The response with the result of a job that is done. */
export const resultOf = (job) => request(job.result);

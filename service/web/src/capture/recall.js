// A capture that was inspected before, from a link.

import { request, ServiceError } from "../api/requests.js";
import { parameters } from "../controls/model_list.js";
import { CaptureWalker } from "../walkers/recorded.js";

const GONE = "The service doesn't keep this capture any more: drop the file again.";

/** The walker of an inspection, a job of the service; throws ServiceError with words for the user. */
export async function captureOf(id) {
  try {
    const { files } = await (await request(`/v1/jobs/${id}/result`)).json();
    const shown = files.find((file) => file.walk) ?? files.find((file) => file.motion);
    if (shown) return new CaptureWalker(await parameters("walk/fpca"), shown);
  } catch (error) {
    if (error.status !== 404) throw error;
  }
  throw new ServiceError(GONE);
}

/** The worker of the page: its first message says what it is for. */

import { serveFields } from "./fields/field_worker.js";
import { serveFrames } from "./frames/frame_worker.js";

const TASKS = { fields: serveFields, frames: serveFrames };
let serve = null;

self.onmessage = ({ data }) => {
  if (serve) serve(data);
  else serve = TASKS[data.task](data);
};

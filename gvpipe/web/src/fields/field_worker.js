/** The other end of `FieldHost`: decodes in a worker. Messages are segments, or positions that were asked for. */

import { FieldDecoder } from "./field_decoder.js";
import { known } from "./field_host.js";

/** @returns {(message: object) => void} what takes the messages after the first, which is the mesh */
export function serveFields(mesh) {
  const decoder = new FieldDecoder(mesh);
  const waiting = new Map(); // "number frame" -> what to call with its positions
  return ({ number, job, frame, positions }) => {
    if (job) {
      decode(decoder, waiting, number, job);
    } else {
      waiting.get(`${number} ${frame}`)(positions);
      waiting.delete(`${number} ${frame}`);
    }
  };
}

async function decode(decoder, waiting, number, job) {
  const positionsOf = (frame) =>
    new Promise((resolve) => {
      waiting.set(`${number} ${frame}`, resolve);
      self.postMessage({ number, frame });
    });
  try {
    const values = await decoder.decode(job, positionsOf);
    self.postMessage({ number, values }, values.buffer ? [values.buffer] : []);
  } catch (error) {
    const { kind = "unsupported", message } = known(error, job.name);
    self.postMessage({ number, error: { kind, message } });
  }
}

/** The other end of `FieldHost`: decodes in a worker. The first message is the mesh; others are segments, or positions that were asked for. */

import { FieldDecoder } from "./field_decoder.js";
import { known } from "./field_host.js";

let decoder = null;
const waiting = new Map(); // "number frame" -> what to call with its positions

self.onmessage = ({ data: { code, faces, vertexCount, number, job, frame, positions } }) => {
  if (code) {
    decoder = new FieldDecoder(code, faces, vertexCount);
  } else if (job) {
    decode(number, job);
  } else {
    waiting.get(`${number} ${frame}`)(positions);
    waiting.delete(`${number} ${frame}`);
  }
};

async function decode(number, job) {
  const positionsOf = (frame) =>
    new Promise((resolve) => {
      waiting.set(`${number} ${frame}`, resolve);
      self.postMessage({ number, frame });
    });
  try {
    const values = await decoder.decode(job, positionsOf);
    self.postMessage({ number, values }, [values.buffer]);
  } catch (error) {
    const { kind = "unsupported", message } = known(error, job.name);
    self.postMessage({ number, error: { kind, message } });
  }
}

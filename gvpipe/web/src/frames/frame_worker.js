/** The other end of `DecodingWorker`: decodes files in a worker. */

import { useDraco } from "../format/draco.js";
import { known } from "../fields/field_host.js";
import { FrameDecoder } from "./frame_decoder.js";
import { RemotePayload } from "./remote_payload.js";

/** @returns {(message: object) => void} what takes the messages after the first */
export function serveFrames({ code, draco }) {
  useDraco(draco);
  const files = new Map(); // number -> what takes its messages
  return ({ file, open, isClosed, ...message }) => {
    if (open) files.set(file, serveFile(file, open, code));
    else if (isClosed) files.delete(file);
    else files.get(file)?.(message);
  };
}

function serveFile(file, { header, isWhole, names, bytes }, code) {
  const post = (message, transfer = []) => self.postMessage({ file, ...message }, transfer);
  const payload = new RemotePayload({ header, isWhole, names, bytes }, (wanted) => post({ wanted }));
  const decoder = FrameDecoder.open(payload, code);
  decoder.catch(() => {}); // reported by what is asked
  return async ({ number, method, given, grown, ...answer }) => {
    if (grown) {
      payload.grow(grown);
      return;
    }
    if (number === undefined) {
      payload.take(answer);
      return;
    }
    try {
      const result = await (await decoder)[method](...given);
      post({ number, result }, result?.positions ? [result.positions.buffer] : []);
    } catch (error) {
      const { kind = "unsupported", message } = known(error, "mesh");
      post({ number, error: { kind, message } });
    }
  };
}

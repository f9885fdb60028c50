/** The other end of `FrameHost`: decodes in a worker. */

import { useDraco } from "../format/draco.js";
import { known } from "../fields/field_host.js";
import { FrameDecoder } from "./frame_decoder.js";
import { RemotePayload } from "./remote_payload.js";

/** @returns {(message: object) => void} what takes the messages after the first */
export function serveFrames({ header, isWhole, names, bytes, code, draco }) {
  useDraco(draco);
  const payload = new RemotePayload(header, isWhole, names, bytes);
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
      self.postMessage({ number, result }, result.positions ? [result.positions.buffer] : []);
    } catch (error) {
      const { kind = "unsupported", message } = known(error, "mesh");
      self.postMessage({ number, error: { kind, message } });
    }
  };
}

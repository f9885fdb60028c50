/** Values that are not there. Mirrors `gvpipe.fields.holes`. */

import { corrupt } from "../format/errors.js";
import { decodeResiduals } from "./residual_coding.js";

/** @returns {Uint8Array|null} (n, R, C) flags; null: there are none */
export function decodeHoles(data, [frames, rows, components], { kernels, causal, name }) {
  if (!data.length) return null;
  const columns = decodeResiduals(kernels, causal, data, [components * frames, frames], name);
  const words = kernels.words(columns); // two of each, the lower one first
  const flags = new Uint8Array(frames * rows * components);
  for (let row = 0, i = 0; row < rows; row++) {
    for (let c = 0; c < components; c++) {
      let flag = 0;
      for (let frame = 0; frame < frames; frame++, i++) {
        if (words[2 * i] >>> 0 > 1 || words[2 * i + 1] !== 0) throw corrupt(name, "a flag of its holes is neither 0 nor 1");
        flag ^= words[2 * i];
        flags[(frame * rows + row) * components + c] = flag;
      }
    }
  }
  for (let i = 0; i < flags.length; i += components) for (let c = 1; c < components; c++) flags[i + c] ^= flags[i];
  kernels.free(columns);
  return flags;
}

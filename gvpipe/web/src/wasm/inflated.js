/** WebAssembly as bundles hold it: deflated by `build.mjs`, since a page holds its bundle as text, which hardly deflates any more. */

import { GeometryVideoError } from "../format/errors.js";
import { inflate } from "../format/inflate.js";
import packed from "./kernels.wasm";

const MOST = 1 << 24; // bytes of a module

let kernels = null; // a promise

/** The bytes of `kernels.wasm`, the same array each time. @returns {Promise<Uint8Array>} */
export function kernelCode() {
  return (kernels ??= inflated(packed));
}

/** @param {Uint8Array} data deflated @returns {Promise<Uint8Array>} */
export function inflated(data) {
  return inflate(data, MOST, (what) => new GeometryVideoError("load", `the player is damaged: ${what}; load the page again`));
}

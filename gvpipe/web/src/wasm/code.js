/** Kernels as bytes. The build deflates WebAssembly: bundles then hold two thirds of it (`build.mjs`). */

import packed from "./kernels.wasm";

let code = null;

/** What `Kernels.open` takes: the same array each time. @returns {Promise<Uint8Array>} */
export function kernelCode() {
  return (code ??= unpack(packed));
}

/** Mirror of the build's `deflated`. @param {Uint8Array} bytes @returns {Promise<Uint8Array>} */
export async function unpack(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Prints how often kernels asked for memory, and whether they got some, if the first so many times there is none.
import { readFile } from "node:fs/promises";
import { Kernels } from "../../gvpipe/web/src/wasm/kernels.js";

const failures = Number(process.argv[2]);
const code = new Uint8Array(await readFile(new URL("../../gvpipe/web/src/wasm/kernels.wasm", import.meta.url)));
const { Instance } = WebAssembly;
let asked = 0;
globalThis.setTimeout = (go) => setImmediate(go);
WebAssembly.Instance = function (...given) {
  asked++;
  if (asked <= failures) throw new RangeError("no memory");
  return new Instance(...given);
};
const found = await Kernels.open(code).catch((error) => error);
console.log(JSON.stringify([asked, found instanceof Kernels ? "open" : found.constructor.name]));

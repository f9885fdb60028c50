// Runs recorded calls of kernels: node run_kernels.mjs FOLDER, which has calls.json and calls.bin; writes results.json and results.bin.
// A call is {"name", "given": [argument]}, an argument a number or {"type", "shape", "at"}: bytes of calls.bin, as are results'.
import { readFileSync, writeFileSync } from "node:fs";
import { Kernels } from "../../gvpipe/web/src/wasm/kernels.js";

const folder = process.argv[2];
const code = readFileSync(new URL("../../gvpipe/web/src/wasm/kernels.wasm", import.meta.url));
const data = readFileSync(`${folder}/calls.bin`);
const [results, parts] = [[], []];
let end = 0;
const keep = (array, kernels) => {
  const view = kernels.view(array);
  parts.push(Buffer.from(new Uint8Array(view.buffer, view.byteOffset, view.byteLength))); // a copy
  const kept = { type: array.type, shape: array.shape, at: end };
  end += view.byteLength;
  return kept;
};
for (const { name, given } of JSON.parse(readFileSync(`${folder}/calls.json`, "utf8"))) {
  const kernels = await Kernels.open(code);
  const values = given.map((value) => {
    if (typeof value === "number") return value;
    const array = kernels.array(value.type, value.shape);
    const { buffer, byteOffset, byteLength } = kernels.view(array);
    data.copy(new Uint8Array(buffer, byteOffset, byteLength), 0, value.at, value.at + byteLength);
    return array;
  });
  const started = performance.now();
  const returned = kernels.call(name, ...values);
  const milliseconds = performance.now() - started;
  const kept = (list) => list.map((value) => (value.shape ? keep(value, kernels) : value));
  results.push({ name, milliseconds, given: kept(values), returned: kept(returned) });
}
writeFileSync(`${folder}/results.json`, JSON.stringify(results));
writeFileSync(`${folder}/results.bin`, Buffer.concat(parts));

// What meshopt's own decoder makes of streams: node run_meshopt.mjs FOLDER_OF_THREE < JSON
// Input: [{data: base64, count, size, mode, filter}]; prints a list of the decoded bytes in base64.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [folder] = process.argv.slice(2);
const { MeshoptDecoder } = await import(pathToFileURL(`${folder}/examples/jsm/libs/meshopt_decoder.module.js`).href);
await MeshoptDecoder.ready;
const decoded = JSON.parse(readFileSync(0, "utf8")).map(({ data, count, size, mode, filter }) => {
  const target = new Uint8Array(count * size);
  MeshoptDecoder.decodeGltfBuffer(target, count, size, new Uint8Array(Buffer.from(data, "base64")), mode, filter);
  return Buffer.from(target).toString("base64");
});
process.stdout.write(JSON.stringify(decoded));

// Decodes what lies inside of a file's surface, as the player does: node run_volume.mjs BUNDLE FILE FOLDER; writes grid.json, and what
// numbers there are in values.bin: of each frame, the inner points' coordinates and then each number asked for in "wanted.json".
import { readFileSync, writeFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const { process } = globalThis;
delete globalThis.process; // Draco's wrapper then takes this for a page
globalThis.window = globalThis;
globalThis.location = new URL("http://localhost/");
const [bundle, file, folder] = process.argv.slice(2);
const { GeometryVideo } = await import(pathToFileURL(bundle));
const wanted = JSON.parse(readFileSync(`${folder}/wanted.json`, "utf8"));
const video = await GeometryVideo.load(new Uint8Array(readFileSync(file)));
const { volume } = video;
const started = performance.now();
const grid = await volume.open();
const opened = performance.now();
const parts = [];
for (let k = 0; k < video.frameCount; k++) {
  if (volume.points) parts.push(await volume.points.frame(k));
  for (const [domain, name] of wanted) {
    const { field } = volume.number(domain, name);
    if (field) parts.push(await field.frame(Math.min(k, field.frameCount - 1)));
  }
}
console.error(`open ${Math.round(opened - started)} ms, numbers ${Math.round(performance.now() - opened)} ms`);
const listed = Object.fromEntries(Object.entries(grid).map(([name, values]) => [name, [...values]]));
writeFileSync(`${folder}/grid.json`, JSON.stringify({ ...listed, faces: [...video.indices] }));
writeFileSync(`${folder}/values.bin`, Buffer.concat(parts.map((part) => Buffer.from(part.buffer, part.byteOffset, part.byteLength))));
video.close();
process.exit(0);

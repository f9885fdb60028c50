// Decodes fields as the player does, without a browser: node run_fields.mjs FOLDER, which has job.json and data.bin; writes values.bin.
// job.json: {"faces", "positions": [frame], "vertexCount", "frameCount", "polygons", "fields": [{"entry", "isOctahedral", "reduced", "data", "rows", "frames"}]};
// an array is [first, last] of data.bin's bytes. Values of all frames asked for follow each other, or the error is printed.
import { readFileSync, writeFileSync } from "node:fs";
import { CodedField } from "../../gvpipe/web/src/fields/coded_field.js";
import { AssetEntry } from "../../gvpipe/web/src/asset/asset_entry.js";
import { readReduction } from "../../gvpipe/web/src/fields/reduction.js";
import { FieldHost } from "../../gvpipe/web/src/fields/field_host.js";

const folder = process.argv[2];
const code = readFileSync(new URL("../../gvpipe/web/src/wasm/kernels.wasm", import.meta.url));
const data = readFileSync(`${folder}/data.bin`);
const bytes = ([first, last]) => new Uint8Array(data.subarray(first, last)); // a copy
const { faces, positions, vertexCount, frameCount, polygons: counts, fields } = JSON.parse(readFileSync(`${folder}/job.json`, "utf8"));
const positionsOf = async (frame) => new Float32Array(bytes(positions[frame]).buffer);
const polygons = counts && Int32Array.from(counts);
const host = new FieldHost(new Uint8Array(code), new Int32Array(bytes(faces).buffer), vertexCount, polygons, positionsOf);
const parts = [];
const started = performance.now();
for (const { entry, isOctahedral, reduced, data: section, rows, frames, probe } of fields) {
  try {
    const payload = { late: new Map(), section: () => bytes(section) };
    const reduction = readReduction(reduced && new AssetEntry(reduced, entry.name), entry.components || 1, entry.domain, polygons);
    const field = new CodedField(entry, { frameCount, rowCount: rows, isOctahedral, reduction }, host, payload);
    for (const frame of frames) {
      const values = await field.frame(frame);
      parts.push(Buffer.from(values.buffer));
    }
    if (probe !== undefined) await field.frame(probe); // whose values are not kept
  } catch (error) {
    console.log(`${entry.section}: ${error.name}, ${error.kind}: ${error.message}`);
  }
}
console.error(`${Math.round(performance.now() - started)} ms`);
writeFileSync(`${folder}/values.bin`, Buffer.concat(parts));

// What Khronos's validator says of .glb files: node validate_gltf.mjs VALIDATOR FILE... prints a JSON list of reports.
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";

const [validator, ...files] = process.argv.slice(2);
const { validateBytes } = createRequire(import.meta.url)(validator);
const reports = [];
for (const file of files) reports.push(await validateBytes(new Uint8Array(await readFile(file)), { uri: file, maxIssues: 100 }));
process.stdout.write(JSON.stringify(reports));

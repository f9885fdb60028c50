// Builds the bundles in bundle/, or in the folder given: node build.mjs [FOLDER]
import { build } from "esbuild";
import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";

const here = (path) => fileURLToPath(new URL(path, import.meta.url));
const notice = readFileSync(here("LICENSES/NOTICE.txt"), "utf8").trim();

const common = {
  absWorkingDir: here("."),
  bundle: true,
  minify: true,
  target: "es2022",
  charset: "utf8",
  legalComments: "none", // the notice holds them
};
const worker = await build({
  ...common,
  entryPoints: ["src/worker.js"],
  format: "iife",
  write: false,
  define: { WORKER_SOURCE: '""' },
  loader: { ".wasm": "empty" }, // the page sends it
  external: ["node:fs", "fs", "path"],
});

await build({
  ...common,
  entryPoints: { "geometry-video": "src/geometry_video.js", player: "src/player.js" },
  outdir: process.argv[2] ?? "bundle",
  format: "esm",
  define: { WORKER_SOURCE: JSON.stringify(worker.outputFiles[0].text) }, // pages from a disk may load no second file
  banner: { js: `/*!\n${notice}\n*/` },
  loader: { ".wasm": "binary", ".css": "text" },
  external: ["node:fs", "fs", "path"], // asked for by Draco's wrapper in Node alone
});

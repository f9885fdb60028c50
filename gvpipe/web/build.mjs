// Builds the bundles in bundle/, or in the folder given: node build.mjs [FOLDER]
import { build } from "esbuild";
import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";

const here = (path) => fileURLToPath(new URL(path, import.meta.url));
const notice = readFileSync(here("LICENSES/NOTICE.txt"), "utf8").trim();

await build({
  absWorkingDir: here("."),
  entryPoints: { "geometry-video": "src/geometry_video.js", player: "src/player.js" },
  outdir: process.argv[2] ?? "bundle",
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  charset: "utf8",
  legalComments: "none", // the notice holds them
  banner: { js: `/*!\n${notice}\n*/` },
  loader: { ".wasm": "binary", ".css": "text" },
  external: ["node:fs", "fs", "path"], // asked for by Draco's wrapper in Node alone
});

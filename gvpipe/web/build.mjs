// Builds the bundles in bundle/, or in the folder given: node build.mjs [FOLDER]
// Builds the modules of the package, which leave three.js outside, in dist/: node build.mjs --package
import { build } from "esbuild";
import { zlibSync } from "fflate"; // in place of Node's, whose bytes depend on the processor
import { copyFileSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { fileURLToPath } from "node:url";

const here = (path) => fileURLToPath(new URL(path, import.meta.url));
const notice = readFileSync(here("LICENSES/NOTICE.txt"), "utf8").trim();

const deflated = {
  name: "deflated",
  setup({ onLoad }) {
    onLoad({ filter: /\.wasm$/ }, ({ path }) => ({ contents: zlibSync(readFileSync(path), { level: 9 }), loader: "binary" }));
  },
};
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

const pages = {
  ...common,
  format: "esm",
  define: { WORKER_SOURCE: JSON.stringify(worker.outputFiles[0].text) }, // pages from a disk may load no second file
  banner: { js: `/*!\n${notice}\n*/` },
  loader: { ".css": "text" },
  plugins: [deflated],
};
const outside = ["node:fs", "fs", "path"]; // asked for by Draco's wrapper in Node alone

const buildBundles = (outdir) =>
  build({ ...pages, entryPoints: { "geometry-video": "src/geometry_video.js", player: "src/player.js" }, outdir, external: outside });

async function buildPackage() {
  rmSync(here("dist"), { recursive: true, force: true });
  await buildBundles("dist");
  await build({
    ...pages,
    entryPoints: { "geometry-video": "src/geometry_video.js", three: "src/three.js", element: "src/player.js" },
    outdir: "dist",
    splitting: true, // what entries share is there once
    chunkNames: "shared-[hash]",
    minify: false, // by those who bundle it
    external: [...outside, "three", "three/*"],
  });
  for (const name of readdirSync(here("types"))) copyFileSync(here(`types/${name}`), here(`dist/${name}`));
  copyFileSync(here("../../LICENSE"), here("LICENSE"));
}

await (process.argv[2] === "--package" ? buildPackage() : buildBundles(process.argv[2] ?? "bundle"));

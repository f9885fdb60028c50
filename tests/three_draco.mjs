// three.js's loader of Draco without a page: its worker is a thread of node, and its decoder comes from the package.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";
import { Worker } from "node:worker_threads";

const FOLDER = "examples/jsm/libs/draco/gltf";
const PAGE = `const { parentPort } = require("node:worker_threads");
globalThis.self = globalThis;
self.postMessage = (data, owned) => parentPort.postMessage(data, owned);
parentPort.on("message", (data) => onmessage({ data }));
`; // what a worker of a page has

/** Draco's decoder, of the package `three` in a folder. */
export const dracoBytes = (three) => new Uint8Array(readFileSync(`${three}/${FOLDER}/draco_decoder.wasm`)).buffer;

const source = (three) => readFileSync(`${three}/${FOLDER}/draco_wasm_wrapper.js`, "utf8");

/** What makes a decoder of those bytes. */
export const dracoModule = (three) => {
  const make = new Function("require", "__dirname", `${source(three)}\nreturn DracoDecoderModule;`);
  return make(createRequire(import.meta.url), three); // it sees node
};

class PageWorker {
  constructor(blob) {
    this.thread = blob.text().then((text) => {
      const thread = new Worker(PAGE + text, { eval: true });
      thread.on("message", (data) => this.onmessage({ data }));
      return thread;
    });
  }
  postMessage(data, owned) {
    this.thread.then((thread) => thread.postMessage(data, owned));
  }
  terminate() {
    this.thread.then((thread) => thread.terminate());
  }
}

/** A `DRACOLoader` of the package `three` in a folder. */
export async function dracoLoader(three) {
  globalThis.Worker = PageWorker;
  URL.createObjectURL = (blob) => blob;
  URL.revokeObjectURL = () => {};
  const { DRACOLoader } = await import(pathToFileURL(`${three}/examples/jsm/loaders/DRACOLoader.js`).href);
  const loader = new DRACOLoader().setWorkerLimit(1);
  loader._loadLibrary = async (name) => (name.endsWith(".wasm") ? dracoBytes(three) : source(three));
  return loader;
}

/** A worker that decodes frames of files: of one, or of several whose kernels are compiled once. */

import { dracoBinary } from "../format/draco.js";
import { workerAddress } from "./worker_address.js";

export class DecodingWorker {
  #worker = null; // null where a page may have none
  #files = new Map(); // number -> who hears of it
  #count = 0;
  #isShared;

  /** @param {Uint8Array} code of kernels @param {boolean} [isShared] whether it stays, until it is closed, when no file is left */
  constructor(code, isShared = false) {
    this.#isShared = isShared;
    try {
      this.#worker = new Worker(workerAddress());
      this.#worker.onmessage = ({ data }) => this.#files.get(data.file)?.take(data);
      this.#worker.onerror = () => this.#lose();
      this.#worker.postMessage({ task: "frames", code, draco: dracoBinary });
    } catch {
      this.#lose();
    }
  }

  /**
   * Open a file.
   *
   * @param {{take: (message: object) => void, lost: () => void}} host is given what comes from the worker, and told if there is none any longer
   * @param {object} open what `frame_worker.js` needs for it
   * @returns {number|null} its number; null where there is no worker
   */
  add(host, open) {
    if (!this.#worker) return null;
    const file = this.#count++;
    this.#files.set(file, host);
    this.#worker.postMessage({ file, open });
    return file;
  }

  post(file, message, transfer = []) {
    this.#worker?.postMessage({ file, ...message }, transfer);
  }

  /** Close a file. */
  remove(file) {
    this.#files.delete(file);
    this.post(file, { isClosed: true });
    if (!this.#isShared && !this.#files.size) this.close();
  }

  close() {
    this.#worker?.terminate();
    this.#worker = null;
  }

  #lose() {
    this.close();
    for (const host of this.#files.values()) host.lost();
    this.#files.clear();
  }
}

/** Where fields are decoded: in a worker, so that the page goes on; on the page itself where it may have none (as in Node). */

import { GeometryVideoError } from "../format/errors.js";
import { closed } from "../format/request.js";
import { workerAddress } from "../frames/worker_address.js";
import { FieldDecoder } from "./field_decoder.js";

export class FieldHost {
  #worker = null;
  #decoder = null; // in place of a worker
  #jobs = new Map(); // number -> what is not answered yet
  #count = 0;

  /**
   * @param {Uint8Array} code of kernels @param {Int32Array} faces (3T) @param {number} vertexCount
   * @param {Int32Array|null} polygons corners of each, if not all are triangles
   * @param {(frame: number) => Promise<Float32Array>} positions (V, 3) decoded
   * @param {object|null} volume what `openGrid` takes, of fields whose rows lie inside
   */
  constructor(code, faces, vertexCount, polygons, positions, volume = null) {
    this.mesh = { task: "fields", code, faces, vertexCount, polygons, volume };
    this.positions = positions;
  }

  /** Decode a segment; `FieldDecoder.decode` says how. @param {object} job @returns {Promise<Float32Array|Int32Array>} (n, R, C) */
  decode(job) {
    if (!this.#worker && !this.#decoder) this.#open();
    if (this.#decoder) return this.#decoder.decode(job, this.positions).catch((error) => Promise.reject(known(error, job.name)));
    return new Promise((resolve, reject) => {
      const number = this.#count++;
      this.#jobs.set(number, { job, resolve, reject });
      this.#worker.postMessage({ number, job });
    });
  }

  close() {
    this.#worker?.terminate();
    for (const { reject } of this.#jobs.values()) reject(closed());
    this.#jobs.clear();
  }

  #open() {
    try {
      this.#worker = new Worker(workerAddress());
      this.#worker.onmessage = ({ data }) => this.#take(data);
      this.#worker.onerror = () => this.#goOnHere(); // pages may forbid workers
      this.#worker.postMessage(this.mesh);
    } catch {
      this.#goOnHere();
    }
  }

  #goOnHere() {
    this.#worker?.terminate();
    this.#worker = null;
    this.#decoder = new FieldDecoder(this.mesh);
    for (const { job, resolve, reject } of this.#jobs.values()) this.decode(job).then(resolve, reject);
    this.#jobs.clear();
  }

  /** An answer, or a request for the positions of a frame. */
  #take({ number, frame, values, error }) {
    const job = this.#jobs.get(number);
    if (!job) return;
    if (frame !== undefined) {
      const send = (positions) => this.#worker?.postMessage({ number, frame, positions });
      this.positions(frame).then(send, (failure) => this.#end(number, () => job.reject(failure)));
    } else {
      this.#end(number, () => (error ? job.reject(new GeometryVideoError(error.kind, error.message)) : job.resolve(values)));
    }
  }

  #end(number, settle) {
    this.#jobs.delete(number);
    settle();
  }
}

/** An error as one of the player's own. */
export function known(error, name) {
  if (!(error instanceof RangeError)) return error; // an array that the browser cannot give
  return new GeometryVideoError("unsupported", `section '${name}' needs more memory than this browser has for a page`);
}

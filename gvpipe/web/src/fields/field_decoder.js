/** Segments of a mesh's fields, decoded by kernels: in a worker, or on the page where there is none. */

import { corrupt } from "../format/errors.js";
import { placed } from "../trajectory/causal_order.js";
import { openGrid } from "../volume/grid.js";
import { Kernels } from "../wasm/kernels.js";
import { rowOrder } from "./mesh.js";
import { decodeSegment } from "./segment.js";

export class FieldDecoder {
  #orders = {}; // by domain, promises
  #opening = null; // a promise of the grid

  /**
   * @param {{code: Uint8Array, faces: Int32Array, vertexCount: number, polygons: Int32Array|null, volume: object|null}} mesh the code of
   *   kernels, (3T) triangles, corners of each polygon, and what `openGrid` takes, for rows that lie inside
   */
  constructor({ code, faces, vertexCount, polygons, volume = null }) {
    this.code = code;
    this.volume = volume;
    this.faces = faces;
    this.vertexCount = vertexCount;
    this.polygons = polygons;
  }

  /**
   * @param {{data: Uint8Array, start: number, stop: number, frameCount: number, components: number, type: string, domain: string,
   *   name: string}} job a segment: frames `start` to `stop` of `frameCount`
   * @param {(frame: number) => Promise<Float32Array>} positions of a frame, asked for if values follow from them
   * @returns {Promise<Float32Array|Int32Array>} (n, R, C); of domain "grid" the grid
   * @throws {GeometryVideoError} it is not as gvpipe writes it @throws {RangeError} it needs more memory than there is
   */
  async decode({ data, start, stop, frameCount, components, type, domain, name }, positions) {
    try {
      if (domain === "grid") return (await this.#openGrid()).grid;
      const order = await (this.#orders[domain] ??= this.#findOrder(domain));
      const kernels = await Kernels.open(this.code);
      const [faces, polygons] = [domain === "vertex" || this.volume ? null : this.faces, domain === "polygon" ? this.polygons : null];
      const span = { start, frameCount, faces, polygons, positions };
      const shape = [stop - start, order.order.length, components];
      return await decodeSegment(data, shape, type, { kernels, causal: placed(kernels, order), name, span });
    } catch (error) {
      if (!(error instanceof WebAssembly.RuntimeError)) throw error;
      throw corrupt(name, `it does not decode: ${error.message}`);
    }
  }

  #openGrid() {
    const open = async () => openGrid(await Kernels.open(this.code), this, this.volume);
    return (this.#opening ??= open());
  }

  async #findOrder(domain) {
    if (this.volume) return (await this.#openGrid()).orders[domain]();
    return rowOrder(await Kernels.open(this.code), this.faces, this.vertexCount, domain, this.polygons);
  }
}

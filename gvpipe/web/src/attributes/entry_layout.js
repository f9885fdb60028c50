/** The entries of an attribute: what they belong to, and where they lie. Mirrors `gvpipe.attributes.entry_layout`. */

import { oppositeCorners } from "./corners.js";

export class EntryLayout {
  /**
   * @param {string} domain of the entries
   * @param {import("./surface.js").Surface} surface
   * @param {Uint32Array|null} corners (3T) the entry of each corner, of domain corner alone
   */
  constructor(domain, surface, corners) {
    this.domain = domain;
    this.surface = surface;
    this.corners = corners;
    const { nVertices, nParts, faces } = surface;
    if (corners) this.nEntries = corners.reduce((most, entry) => Math.max(most, entry + 1), 0);
    else this.nEntries = { vertex: nVertices, triangle: faces.length / 3, part: nParts }[domain];
  }

  /** (3T) the entry that each corner uses; 0 on the domain part. */
  get owners() {
    const { corners, domain, surface } = this;
    if (corners) return corners;
    if (domain === "vertex") return surface.faces;
    return Uint32Array.from(surface.faces, (_, c) => (domain === "triangle" ? Math.floor(c / 3) : 0));
  }

  /**
   * A number for each entry, equal at one place (N), and their order, the members of Python's `EntryOrder` in the memory of `kernels`.
   *
   * @returns {{places: Uint32Array, order: import("../wasm/kernels.js").KernelArray[]}}
   */
  entries(kernels) {
    const { domain, surface, corners, nEntries } = this;
    const places = Uint32Array.from({ length: nEntries }, (_, i) => i);
    if (domain === "part") {
      return { places, order: [kernels.whole(places), kernels.array("int64", [nEntries + 1]), kernels.array("int64", [0, 4])] };
    }
    if (domain === "triangle") return { places, order: kernels.call("order_by_edges", kernels.whole(surface.opposite)) };
    const flat = corners ?? surface.faces;
    const opposite = kernels.whole(corners ? oppositeCorners(corners) : surface.opposite);
    const order = kernels.call("order_by_corners", kernels.array("int32", [flat.length / 3, 3], flat), opposite, nEntries);
    if (!corners) return { places: surface.places, order };
    corners.forEach((entry, c) => (places[entry] = surface.places[surface.faces[c]]));
    return { places, order };
  }
}

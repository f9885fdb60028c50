/** The entries of an attribute: what they belong to, and where they lie. Mirrors `gvpipe.attributes.entry_layout`. */

import { oppositeCorners } from "./corners.js";
import { orderByCorners, orderByEdges } from "./entry_order.js";

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

  /** Their `EntryOrder`, and `places` (N): a number for each, equal at one place. */
  entries() {
    const { domain, surface, corners, nEntries } = this;
    const places = Uint32Array.from({ length: nEntries }, (_, i) => i);
    if (domain === "part") return { order: places, starts: new Int32Array(nEntries + 1), gates: new Int32Array(0), places };
    if (domain === "triangle") return { ...orderByEdges(surface.opposite), places };
    if (domain === "vertex") return { ...orderByCorners(surface.faces, surface.opposite, nEntries), places: surface.places };
    corners.forEach((entry, c) => (places[entry] = surface.places[surface.faces[c]]));
    return { ...orderByCorners(corners, oppositeCorners(corners), nEntries), places };
  }
}

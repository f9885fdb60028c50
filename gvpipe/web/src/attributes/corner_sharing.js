/**
 * Which corners of a vertex share a value of an attribute. Mirrors `gvpipe.attributes.corner_sharing` and its kernels: corners
 * come vertex after vertex, along the fans of triangles around it.
 */

import { SerialDecoder } from "../format/serial_decoder.js";
import { linkCorners, nextCorner, numberByFirst, previousCorner, thirdCorner } from "./corners.js";

const [WHOLE, , SHARED, CODED, GUIDED] = [0, 1, 2, 3, 4]; // modes; 1: one entry per corner
const [SAME, NEW, OLDER] = [0, 1, 2]; // symbols; an older entry's number is added to the last
const [UNLINKED, UNKNOWN, JOINED, CUT] = [0, 1, 2, 3]; // what is known of the edge between two corners of a fan
const N_CONTEXTS = 12;

/**
 * @param {import("../format/cursor.js").Cursor} cursor read to its end
 * @param {import("./surface.js").Surface} surface
 * @param {Uint32Array[]} references entries of corner attributes before this one
 * @returns {Uint32Array} (3T) entries, numbered by their first corners
 */
export function decodeSharing(cursor, surface, references) {
  const { faces, nVertices } = surface;
  const mode = cursor.u8();
  if (mode > GUIDED) throw cursor.corrupt(`the corners are shared in an unknown mode ${mode}`);
  let reference = null;
  if (mode === SHARED || mode === GUIDED) {
    if (!references.length) throw cursor.corrupt("the corners refer to those of an attribute that does not exist");
    reference = references[cursor.varint(references.length - 1, "the number of a reference")];
  }
  if (mode === CODED || mode === GUIDED) {
    const coder = new SerialDecoder(cursor.rest(), N_CONTEXTS, cursor.name);
    const entries = new Fans(coder, surface, reference).decode();
    coder.end();
    return numberByFirst(entries, faces.length);
  }
  cursor.end();
  if (mode === WHOLE) return numberByFirst(faces, nVertices);
  return reference ?? Uint32Array.from({ length: faces.length }, (_, c) => c);
}

/** The walk around every vertex. */
class Fans {
  constructor(coder, { faces, opposite, nVertices }, reference) {
    this.coder = coder;
    this.flat = faces;
    this.opposite = opposite;
    this.nVertices = nVertices;
    this.reference = reference;
    this.entries = new Uint32Array(faces.length);
    this.count = 0; // entries so far
    this.corners = []; // of the present fan
    this.edges = []; // before each of them
  }

  decode() {
    const { head, after } = linkCorners(this.flat, this.nVertices);
    const isVisited = new Uint8Array(this.flat.length);
    for (let v = 0; v < this.nVertices; v++) {
      const first = this.count;
      for (let c = head[v]; c >= 0; c = after[c]) {
        if (isVisited[c]) continue;
        const cuts = this.#findFan(v, c);
        for (const corner of this.corners) isVisited[corner] = 1;
        this.#decodeFan(first, cuts);
      }
    }
    return this.entries;
  }

  #decodeFan(first, cuts) {
    const { corners, edges, entries, coder } = this;
    for (let i = 0; i < corners.length; i++) {
      const corner = corners[i];
      if (this.count === first) {
        entries[corner] = this.count++; // the vertex' first corner
        continue;
      }
      const last = i > 0 ? entries[corners[i - 1]] : this.count - 1;
      const edge = i > 0 ? edges[i] : UNLINKED;
      const symbol = coder.folded(this.#context(i, edge, cuts));
      if (symbol === SAME) {
        entries[corner] = last;
      } else if (symbol === NEW) {
        entries[corner] = this.count++;
      } else {
        let known = this.count - 1 - (symbol - OLDER);
        if (known <= last) known--;
        if (known < first || known >= this.count) throw coder.corrupt("a corner shares a value that is not its vertex's");
        entries[corner] = known;
      }
      if (edge === UNKNOWN && entries[corner] !== last) cuts++;
    }
  }

  #context(i, edge, cuts) {
    const { reference, corners } = this;
    if (!reference) return edge * 3 + Math.min(cuts, 2);
    if (i === 0) return edge * 3;
    return edge * 3 + (reference[corners[i]] !== reference[corners[i - 1]] ? 1 : 2);
  }

  /** Fill `corners` and `edges` with the fan of a corner; return how many cuts are known in it. */
  #findFan(v, seed) {
    const { flat, opposite, entries } = this;
    this.corners = [];
    this.edges = [];
    const [start, first] = this.#findStart(v, seed);
    let [at, leave, edge, cuts, cutAt] = [start, first, UNLINKED, 0, 0];
    do {
      this.corners.push(at);
      this.edges.push(edge);
      if (this.corners.length > flat.length) throw this.coder.corrupt("a fan has no end");
      const other = opposite[leave];
      if (other < 0) return cuts;
      const here = thirdCorner(at, leave);
      at = this.#cornerAt(other, v);
      leave = thirdCorner(at, other);
      edge = UNKNOWN;
      if (flat[here] < v) edge = entries[here] === entries[leave] ? JOINED : CUT;
      if (edge === CUT) {
        cuts++;
        cutAt = this.corners.length;
      }
    } while (at !== start);
    this.#turn(cutAt % this.corners.length, edge);
    return cuts;
  }

  /** Where a fan starts: at its open end, or at the seed; and the corner opposite to the edge by which it goes on. */
  #findStart(v, seed) {
    const { flat, opposite } = this;
    let [at, back] = [seed, previousCorner(seed)];
    for (let steps = 0; steps <= flat.length; steps++) {
      const other = opposite[back];
      if (other < 0) return [at, thirdCorner(at, back)];
      at = this.#cornerAt(other, v);
      back = thirdCorner(at, other);
      if (at === seed) return [seed, nextCorner(seed)];
    }
    throw this.coder.corrupt("a fan has no end");
  }

  /** Let a closed fan start at a known cut. */
  #turn(by, lastEdge) {
    const { corners, edges } = this;
    const places = corners.map((_, i) => (by + i) % corners.length);
    this.corners = places.map((k) => corners[k]);
    this.edges = places.map((k) => (k > 0 ? edges[k] : lastEdge));
  }

  /** The other corner of this one's triangle that lies at vertex v. */
  #cornerAt(corner, v) {
    const next = nextCorner(corner);
    return this.flat[next] === v ? next : previousCorner(corner);
  }
}

/**
 * The order in which an attribute's entries are coded, and the *gates* of each: the earlier entries that predict it. Mirrors
 * `gvpipe.mesh.entry_kernels`.
 */

import { linkCorners, nextCorner, previousCorner } from "./corners.js";

const LEVELS = 4; // entries that complete this many triangles less one, or more, are alike

/**
 * @typedef {object} EntryOrder
 * @property {Int32Array} order (N) entries
 * @property {Int32Array} starts (N + 1) bounds of each one's gates, in that order
 * @property {Int32Array} gates (M, 4) entries a, b of a triangle with the entry, the entry across their edge, and the entry's corner;
 *   -1: none
 */

/** Entries still to come, by how many triangles they complete. */
class Stacks {
  constructor(capacity, isDone, nEntries) {
    this.heads = new Int32Array(LEVELS).fill(-1);
    this.below = new Int32Array(capacity);
    this.items = new Int32Array(capacity);
    this.size = 0;
    this.isDone = isDone;
    this.completes = new Int32Array(nEntries);
  }

  push(entry, level) {
    this.items[this.size] = entry;
    this.below[this.size] = this.heads[level];
    this.heads[level] = this.size++;
  }

  /** Push an entry that completes one triangle more. */
  raise(entry) {
    this.completes[entry]++;
    this.push(entry, Math.min(this.completes[entry], LEVELS - 1));
  }

  /** Push what a triangle still needs beside the entry just done: the last one, or both. */
  pushNeighbours(a, b) {
    const { isDone } = this;
    if (isDone[a] && isDone[b]) return;
    if (isDone[a] || isDone[b]) {
      this.raise(isDone[a] ? b : a);
    } else {
      this.push(b, 0);
      this.push(a, 0);
    }
  }

  /** The entry to be coded next; -1 at the end of a component. */
  pop() {
    for (let level = LEVELS - 1; level >= 0; level--) {
      while (this.heads[level] >= 0) {
        const place = this.heads[level];
        this.heads[level] = this.below[place];
        if (!this.isDone[this.items[place]]) return this.items[place];
      }
    }
    return -1;
  }
}

/** Gates that are found one after the other. */
class Gates {
  constructor(capacity) {
    this.rows = new Int32Array(4 * capacity).fill(-1);
    this.count = 0;
  }

  add(a, b, o, corner) {
    const at = 4 * this.count++;
    this.rows[at] = a;
    this.rows[at + 1] = b;
    this.rows[at + 2] = o;
    this.rows[at + 3] = corner;
  }
}

/** Order the entries of corners. @returns {EntryOrder} */
export function orderByCorners(flat, opposite, nEntries) {
  const { head, after } = linkCorners(flat, nEntries);
  const order = new Int32Array(nEntries);
  const starts = new Int32Array(nEntries + 1);
  const gates = new Gates(flat.length);
  const isDone = new Uint8Array(nEntries);
  const stacks = new Stacks(2 * flat.length, isDone, nEntries);
  let n = 0;
  for (let seed = 0; seed < nEntries; seed++) {
    for (let entry = isDone[seed] ? -1 : seed; entry >= 0; entry = stacks.pop()) {
      addGates(gates, entry, { flat, opposite, head, after, isDone });
      order[n++] = entry;
      isDone[entry] = 1;
      starts[n] = gates.count;
      for (let c = head[entry]; c >= 0; c = after[c]) stacks.pushNeighbours(flat[nextCorner(c)], flat[previousCorner(c)]);
    }
  }
  return { order, starts, gates: gates.rows };
}

/** The gates of an entry: triangles that it completes, or else whatever shares a triangle. */
function addGates(gates, entry, { flat, opposite, head, after, isDone }) {
  const first = gates.count;
  for (let c = head[entry]; c >= 0; c = after[c]) {
    const a = flat[nextCorner(c)];
    const b = flat[previousCorner(c)];
    if (!isDone[a] || !isDone[b]) continue;
    const o = opposite[c] >= 0 ? flat[opposite[c]] : -1;
    gates.add(a, b, o >= 0 && isDone[o] ? o : -1, c);
  }
  if (gates.count > first) return;
  for (let c = head[entry]; c >= 0; c = after[c]) {
    const a = flat[nextCorner(c)];
    const b = flat[previousCorner(c)];
    if (isDone[a] || isDone[b]) gates.add(isDone[a] ? a : b, -1, -1, c);
  }
}

/** Order triangles, by their neighbours. @returns {EntryOrder} */
export function orderByEdges(opposite) {
  const nEntries = opposite.length / 3;
  const order = new Int32Array(nEntries);
  const starts = new Int32Array(nEntries + 1);
  const gates = new Gates(opposite.length);
  const isDone = new Uint8Array(nEntries);
  const stacks = new Stacks(opposite.length, isDone, nEntries);
  let n = 0;
  for (let seed = 0; seed < nEntries; seed++) {
    for (let entry = isDone[seed] ? -1 : seed; entry >= 0; entry = stacks.pop()) {
      order[n++] = entry;
      isDone[entry] = 1;
      for (let c = 3 * entry; c < 3 * entry + 3; c++) {
        const other = opposite[c] >= 0 ? Math.floor(opposite[c] / 3) : -1;
        if (other < 0) continue;
        if (!isDone[other]) stacks.raise(other);
        else if (other !== entry) gates.add(other, -1, -1, -1);
      }
      starts[n] = gates.count;
    }
  }
  return { order, starts, gates: gates.rows };
}

/**
 * Numbers coded by binary decisions with mixed adaptive contexts. Mirrors `gvpipe.entropy.decision_kernels`, `number_kernels` and
 * `logistic_tables`; `docs/format.md`, section 5.9. All numbers are integers that doubles hold exactly.
 */

import {
  DECISION_KERNELS_AHEAD as AHEAD,
  DECISION_KERNELS_ONE_BITS as ONE_BITS,
  DECISION_KERNELS_RATE as RATE,
  DECISION_KERNELS_RATE_BITS as RATE_BITS,
  LOGISTIC_TABLES_KNOTS as KNOTS,
  LOGISTIC_TABLES_LIMIT as LIMIT,
  LOGISTIC_TABLES_SPACING as SPACING,
  NUMBER_KERNELS_FACTOR as FACTOR,
  NUMBER_KERNELS_MAX_LENGTH as MAX_LENGTH,
  NUMBER_KERNELS_MIXERS as MIXERS,
  NUMBER_KERNELS_MODELLED as MODELLED,
  NUMBER_KERNELS_NODES as NODES,
  NUMBER_KERNELS_SIGN as SIGN,
  NUMBER_KERNELS_SLOT_BITS as SLOT_BITS,
} from "../constants.js";

const ONE = 2 ** ONE_BITS;
const TOP = 2 ** 24; // range below which a byte is read
const MOST_SEEN = 250; // uses of a slot that count

let tables = null; // made when first needed

/** A hash below 2^32 of one, and of any integer. */
export function mixHash(value, other) {
  const mixed = Math.imul(value ^ other, FACTOR) >>> 0;
  return (mixed ^ (mixed >>> 15)) >>> 0;
}

export class NumberDecoder {
  #data;
  #position = 4;
  #low = 0;
  #extent = 2 ** 32 - 1;
  #slots;
  #chances;
  #seen;
  #weights;
  #inputs;

  /** @param {Uint8Array} data to its end @param {number} nContexts @param {number} nGroups of mixers */
  constructor(data, nContexts, nGroups) {
    tables ??= makeTables();
    this.#data = data;
    for (let i = 0; i < 4; i++) this.#low = this.#low * 256 + (data[i] ?? 0);
    this.#slots = new Int32Array(nContexts);
    this.#chances = new Int32Array(nContexts << SLOT_BITS).fill(ONE / 2);
    this.#seen = new Uint8Array(nContexts << SLOT_BITS);
    this.#weights = new Float64Array(MIXERS * nGroups * (nContexts + 1)).fill(Math.floor((65536 * 4) / (3 * nContexts)));
    for (let m = 0; m < MIXERS * nGroups; m++) this.#weights[m * (nContexts + 1) + nContexts] = 0;
    this.#inputs = new Int32Array(nContexts + 1);
  }

  /** Whether every byte was used, and no more. */
  get isAtEnd() {
    return this.#position === this.#data.length + AHEAD;
  }

  /** The next number; `contexts` are hashes. NaN: it is too large. */
  number(contexts, group, signed) {
    let length = 0;
    while (this.#node(contexts, length, MIXERS * group + Math.min(length, 1))) {
      if (++length >= MAX_LENGTH) return NaN;
    }
    if (length === 0) return 0;
    let value = 1;
    for (let below = 0; below < length - 1; below++) {
      const bit = below < MODELLED ? this.#node(contexts, ((length << 4) | value) + NODES, MIXERS * group + 2) : this.decide(32768);
      value = 2 * value + bit;
    }
    return signed && this.#node(contexts, SIGN, MIXERS * group + 3) ? -value : value;
  }

  /** An index below n, all alike. */
  index(n) {
    let [low, high] = [0, n];
    while (high - low > 1) {
      const middle = Math.floor((low + high) / 2);
      if (this.decide(Math.floor(((high - middle) * 65536) / (high - low)))) low = middle;
      else high = middle;
    }
    return low;
  }

  /** A decision whose 1 has probability `chance / 65536`. */
  decide(chance) {
    const bound = Math.floor(this.#extent / 65536) * chance;
    const bit = this.#low < bound ? 1 : 0;
    if (bit) {
      this.#extent = bound;
    } else {
      this.#low -= bound;
      this.#extent -= bound;
    }
    while (this.#extent < TOP) {
      this.#low = this.#low * 256 + (this.#data[this.#position++] ?? 0);
      this.#extent *= 256;
    }
    return bit;
  }

  /** A decision at a place of a number's, by all contexts. */
  #node(contexts, node, mixer) {
    const n = this.#slots.length;
    const weights = this.#weights;
    const inputs = this.#inputs;
    const first = mixer * (n + 1);
    let total = 0;
    for (let k = 0; k < n; k++) {
      const slot = (k << SLOT_BITS) + (mixHash(contexts[k], node) >>> (32 - SLOT_BITS));
      this.#slots[k] = slot;
      inputs[k] = tables.stretch[this.#chances[slot] >> (ONE_BITS - 12)];
      total += inputs[k] * weights[first + k];
    }
    inputs[n] = 256;
    total += 256 * weights[first + n];
    const logit = Math.min(Math.max(Math.floor(total / 65536), -LIMIT), LIMIT);
    const chance = tables.squash[logit + LIMIT];
    const bit = this.decide(chance);
    const error = (bit ? 65535 : 0) - chance;
    for (let k = 0; k <= n; k++) weights[first + k] += Math.floor((inputs[k] * error * RATE) / 2 ** RATE_BITS);
    for (let k = 0; k < n; k++) {
      const slot = this.#slots[k];
      const used = this.#seen[slot];
      const missing = (bit ? ONE - 1 : 0) - this.#chances[slot];
      this.#chances[slot] += Math.floor((missing * tables.rates[used]) / 65536);
      if (used < MOST_SEEN) this.#seen[slot]++;
    }
    return bit;
  }
}

function makeTables() {
  const exact = [...KNOTS, 0];
  const lower = Array.from({ length: LIMIT + 1 }, (_, i) => {
    const place = Math.floor((i + 1) / SPACING);
    const part = (i + 1) % SPACING;
    const below = Math.floor((exact[place] * (SPACING - part) + exact[place + 1] * part) / SPACING);
    return Math.max(1, (below + 128) >> 8);
  });
  const squash = Int32Array.from([...lower, ...lower.slice(0, -1).reverse().map((chance) => 65536 - chance)]);
  const stretch = new Int32Array(4096);
  for (let i = 0, logit = 0; i < 4096; i++) {
    while (squash[logit] < 16 * i + 8) logit++;
    stretch[i] = logit - LIMIT;
  }
  const rates = Int32Array.from({ length: MOST_SEEN + 1 }, (_, used) => Math.floor((2 * 65536) / (2 * used + 3)));
  return { squash, stretch, rates };
}

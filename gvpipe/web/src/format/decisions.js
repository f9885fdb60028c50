/**
 * What kernels of adaptive binary decisions start from. Mirrors `new_mixing` and `start_decoder` of `gvpipe.entropy.decision_kernels`, and
 * the tables of `logistic_tables`; `docs/format.md`, section 5.9.
 */

import {
  DECISION_KERNELS_AHEAD as AHEAD,
  DECISION_KERNELS_ONE_BITS as ONE_BITS,
  DECISION_KERNELS_PLACE as PLACE,
  DECISION_KERNELS_RANGE as RANGE,
  DECISION_KERNELS_SEEN_BITS as SEEN_BITS,
  FORECAST_KERNELS_N_FORECASTS as N_FORECASTS,
  LOGISTIC_TABLES_KNOTS as KNOTS,
  LOGISTIC_TABLES_LIMIT as LIMIT,
  LOGISTIC_TABLES_SPACING as SPACING,
  NUMBER_KERNELS_MIXERS as MIXERS,
  NUMBER_KERNELS_SLOT_BITS as SLOT_BITS,
} from "../constants.js";

const MOST_SEEN = 250; // uses of a slot that count

let tables = null; // made when first needed

/**
 * Memory in which nothing is learnt: the members of Python's `Mixing`.
 *
 * @param {import("../wasm/kernels.js").Kernels} kernels @param {number} nContexts @param {number} nSlots of each @param {number} nMixers
 * @param {number} nOthers inputs beside those of contexts
 */
export function newMixing(kernels, nContexts, nSlots, nMixers, nOthers = 0) {
  tables ??= makeTables();
  const chances = kernels.array("uint32", [nContexts, nSlots]);
  kernels.view(chances).fill(1 << (ONE_BITS - 1 + SEEN_BITS));
  const nInputs = nContexts + nOthers;
  const own = Math.floor((65536 * 4) / (3 * nInputs));
  const weights = Int32Array.from({ length: nMixers * (nInputs + 1) }, (_, i) => ((i + 1) % (nInputs + 1) ? own : 0));
  return [
    chances,
    kernels.whole(weights, [nMixers, nInputs + 1]),
    kernels.array("int64", [nInputs + 1]),
    ...[tables.rates, tables.squash, tables.stretch].map((table) => kernels.array("int64", [table.length], table)),
  ];
}

/** The same for numbers (`gvpipe.entropy.number_kernels`). @param {number} nGroups of mixers */
export function newNumberMixing(kernels, nContexts, nGroups) {
  return newMixing(kernels, nContexts, 2 ** SLOT_BITS, MIXERS * nGroups);
}

/** The same for numbers with a forecast (`gvpipe.entropy.forecast_kernels`). @param {number} nGroups of mixers */
export function newForecastMixing(kernels, nContexts, nGroups) {
  return newMixing(kernels, nContexts, 2 ** SLOT_BITS, MIXERS * nGroups, N_FORECASTS);
}

/** A decoder at the start of `data`. */
export class DecisionStream {
  #kernels;
  #state;

  /** @param {import("../wasm/kernels.js").Kernels} kernels @param {Uint8Array} data */
  constructor(kernels, data) {
    const code = [0, 1, 2, 3].reduce((sum, i) => sum * 256 + (data[i] ?? 0), 0);
    this.#kernels = kernels;
    this.#state = kernels.array("int64", [3], [code, RANGE, 4].map(BigInt));
    this.length = data.length;
    /** State and bytes, as kernels take them. */
    this.arrays = [this.#state, kernels.array("uint8", [data.length], data)];
  }

  /** Bytes read, those asked for ahead among them. */
  get place() {
    return Number(this.#kernels.view(this.#state)[PLACE]);
  }

  /** Whether every byte was used, and no more. */
  get isAtEnd() {
    return this.place === this.length + AHEAD;
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
  const squash = [...lower, ...lower.slice(0, -1).reverse().map((chance) => 65536 - chance)];
  let logit = 0;
  const stretch = Array.from({ length: 4096 }, (_, i) => {
    while (squash[logit] < 16 * i + 8) logit++;
    return logit - LIMIT;
  });
  const rates = Array.from({ length: MOST_SEEN + 1 }, (_, used) => Math.floor((2 * 65536) / (2 * used + 3)));
  const [asLongs] = [(values) => BigInt64Array.from(values, BigInt)];
  return { squash: asLongs(squash), stretch: asLongs(stretch), rates: asLongs(rates) };
}

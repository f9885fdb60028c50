/**
 * What linear and octahedral prediction share: equal values nearby, and the context of a residual. Mirrors
 * `gvpipe.attributes.match_kernels`.
 */

const [TWINS, NEIGHBOURS] = [1, 2]; // flags: which entries are candidates
const MAX_CANDIDATES = 6;
const MAX_LOOKED = 12; // entries at one place that are compared
const N_CLASSES = 8; // of magnitudes
const N_RESIDUAL_CONTEXTS = N_CLASSES * 2;
const N_MATCH_CONTEXTS = 9;

/** How many contexts a stream has. */
export function countContexts(flags) {
  return N_RESIDUAL_CONTEXTS + (flags ? N_MATCH_CONTEXTS : 0);
}

/** The context of a residual of which `magnitude`, an integer, is expected, and of which the class is `least` at least. */
export function residualContext(component, magnitude, least) {
  let bits = 0;
  while (magnitude > 0 && bits < N_CLASSES - 1) {
    magnitude = Math.floor(magnitude / 2);
    bits++;
  }
  return Math.max(bits, least) + (component > 0 ? N_CLASSES : 0);
}

/** Entries in order, and what is remembered of those that are done. */
export class History {
  /**
   * @param {import("../format/serial_decoder.js").SerialDecoder} coder
   * @param {object} entries of `prepareEntries`
   * @param {{flags: number, shift: number}} contexts which entries are candidates; low bits of magnitudes that contexts ignore
   * @param {Float64Array} codes (N, width), filled by the caller
   * @param {number} width
   * @param {number} nMagnitudes of the residuals of an entry
   */
  constructor(coder, entries, { flags, shift }, codes, width, nMagnitudes) {
    this.coder = coder;
    Object.assign(this, entries); // order, starts, gates, places
    this.flags = flags;
    this.scale = 2 ** shift;
    this.codes = codes;
    this.width = width;
    this.nMagnitudes = nMagnitudes;
    const n = this.order.length;
    this.latest = new Int32Array(this.places.reduce((most, place) => Math.max(most, place + 1), 0)).fill(-1);
    this.before = new Int32Array(n).fill(-1);
    this.matched = new Uint8Array(n);
    this.magnitudes = new Float64Array(n * nMagnitudes);
    this.candidates = new Int32Array(MAX_CANDIDATES);
    this.nCandidates = 0;
  }

  /** Which candidate entry i of the order equals; -1: none. */
  match(i) {
    if (!this.flags) return -1;
    const hasTwin = this.#findCandidates(i);
    const n = this.nCandidates;
    if (n === 0) return -1;
    const { before, matched, candidates, starts, gates } = this;
    let outcome = 2;
    if (hasTwin && before[candidates[0]] >= 0) outcome = matched[candidates[0]];
    if (starts[i] < starts[i + 1]) outcome = matched[gates[4 * starts[i]]];
    const number = this.coder.folded(N_RESIDUAL_CONTEXTS + Math.min(n, 3) * 3 - 3 + outcome);
    if (number > n) throw this.coder.corrupt("a value equals one that is not there");
    return number > 0 ? candidates[number - 1] : -1;
  }

  /** Note that an entry is done. */
  remember(entry, isMatch) {
    const place = this.places[entry];
    this.before[entry] = this.latest[place];
    this.latest[place] = entry;
    this.matched[entry] = isMatch ? 1 : 0;
  }

  /** Four times the mean magnitude of the residuals of the entries that predict entry i of the order. */
  nearMagnitude(i, component) {
    const { starts, gates, magnitudes, nMagnitudes } = this;
    let [total, n] = [0, 0];
    for (let g = starts[i]; g < starts[i + 1]; g++) {
      for (let k = 0; k < 2; k++) {
        const other = gates[4 * g + k];
        if (other < 0) continue;
        total += magnitudes[other * nMagnitudes + component];
        n++;
      }
    }
    if (n === 0 && i > 0) [total, n] = [magnitudes[this.order[i - 1] * nMagnitudes + component], 1];
    return n ? Math.floor((4 * total) / n) : 0;
  }

  /** The context of a component's residual; `previous` is the magnitude of that of the component before. */
  context(i, component, previous, least) {
    return residualContext(component, Math.floor((this.nearMagnitude(i, component) + 2 * previous) / this.scale), least);
  }

  /** The class that residuals of entry i of the order have at least: without a triangle they are large. */
  leastClass(i) {
    const { starts, gates } = this;
    if (starts[i] === starts[i + 1]) return N_CLASSES - 1;
    return gates[4 * starts[i] + 1] < 0 ? N_CLASSES - 2 : 0;
  }

  copy(entry, from) {
    const { codes, width } = this;
    for (let c = 0; c < width; c++) codes[entry * width + c] = codes[from * width + c];
  }

  /** Find the candidates of entry i of the order; return whether the first is at its place. */
  #findCandidates(i) {
    const { order, starts, gates } = this;
    this.nCandidates = 0;
    if (this.flags & TWINS) {
      let other = this.latest[this.places[order[i]]];
      for (let looked = 0; other >= 0 && this.nCandidates < MAX_CANDIDATES && looked < MAX_LOOKED; looked++) {
        this.#add(other);
        other = this.before[other];
      }
    }
    const hasTwin = this.nCandidates > 0;
    if (!(this.flags & NEIGHBOURS)) return hasTwin;
    for (let g = starts[i]; g < Math.min(starts[i + 1], starts[i] + MAX_LOOKED); g++) {
      for (let k = 0; k < 3; k++) {
        if (gates[4 * g + k] >= 0 && this.nCandidates < MAX_CANDIDATES) this.#add(gates[4 * g + k]);
      }
    }
    if (starts[i] === starts[i + 1] && i > 0 && this.nCandidates < MAX_CANDIDATES) this.#add(order[i - 1]);
    return hasTwin;
  }

  #add(entry) {
    for (let k = 0; k < this.nCandidates; k++) if (this.#areEqual(this.candidates[k], entry)) return;
    this.candidates[this.nCandidates++] = entry;
  }

  #areEqual(a, b) {
    const { codes, width } = this;
    for (let c = 0; c < width; c++) if (codes[a * width + c] !== codes[b * width + c]) return false;
    return true;
  }
}

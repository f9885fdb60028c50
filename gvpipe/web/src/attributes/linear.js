/** Numbers predicted along the surface: texture coordinates, colours, scalars, vectors. Mirrors `gvpipe.attributes.linear_kernels`. */

import { nextCorner, previousCorner } from "./corners.js";
import { History } from "./history.js";

export const [LAST, PARALLELOGRAM, CONFORMAL, AFFINE] = [0, 2, 3, 4]; // methods; 1 is the mean
const LEAST_HEIGHT = 0.25; // of a triangle whose map is trusted, in heights of the triangle that is predicted by it
const MAX_CODE = 2 ** 38;

/** Codes of float32: their bits, ordered as the values are. */
const word = new Float32Array(1);
const bits = new Int32Array(word.buffer);

/** The float32 of an ordered code; NaN and infinities where the bits are theirs. */
export function floatOf(code) {
  bits[0] = code >= 0 ? code : -(code + 1) - 2 ** 31;
  return word[0];
}

function orderedCode(value) {
  word[0] = value;
  return bits[0] >= 0 ? bits[0] : -(bits[0] + 2 ** 31) - 1;
}

export class LinearDecoder {
  /**
   * @param {import("../format/serial_decoder.js").SerialDecoder} coder
   * @param {object} entries of `prepareEntries`
   * @param {{method: number, flags: number, shift: number}} how
   * @param {{isFloat: boolean, components: number}} values
   * @param {import("./surface.js").Surface} surface
   * @param {Int32Array|null} opposite (3T) corners over entries, for method AFFINE
   */
  constructor(coder, entries, how, { isFloat, components }, surface, opposite) {
    const n = entries.order.length;
    this.coder = coder;
    this.method = how.method;
    this.isFloat = isFloat;
    this.components = components;
    this.faces = surface.faces;
    this.positions = surface.positions;
    this.opposite = opposite;
    this.codes = new Float64Array(n * components);
    this.numbers = isFloat ? new Float64Array(n * components) : this.codes; // what is predicted
    this.history = new History(coder, entries, how, this.codes, components, components);
    this.gates = entries.gates;
    this.guess = new Float64Array(components);
    this.side = 1; // on which the last texture triangle lay
    this.shape = [0, 0, 0]; // of `#measure`
    this.across = [0, 0]; // of `#findAcross`
  }

  /** @returns {Float64Array} (N, C) codes */
  decode() {
    const { history, codes, numbers, components } = this;
    const { order, starts } = history;
    for (let i = 0; i < order.length; i++) {
      const entry = order[i];
      const match = history.match(i);
      if (match >= 0) {
        for (let c = 0; c < components; c++) {
          codes[entry * components + c] = codes[match * components + c];
          numbers[entry * components + c] = numbers[match * components + c];
        }
      } else {
        this.#predict(i);
        this.#decodeResiduals(i, entry);
      }
      if (this.method >= CONFORMAL) this.#noteSide(starts[i], starts[i + 1], entry);
      history.remember(entry, match >= 0);
    }
    return codes;
  }

  #decodeResiduals(i, entry) {
    const { history, codes, numbers, components, isFloat } = this;
    const least = history.leastClass(i);
    let previous = 0;
    for (let c = 0; c < components; c++) {
      const residual = this.coder.value(history.context(i, c, previous, least));
      const code = this.#round(this.guess[c]) + residual;
      const isCode = isFloat ? code >= -(2 ** 31) && code < 2 ** 31 : Math.abs(code) < MAX_CODE;
      if (!isCode) throw this.coder.corrupt("a value is out of range");
      codes[entry * components + c] = code;
      if (isFloat) {
        const value = floatOf(code);
        numbers[entry * components + c] = Math.abs(value) < Infinity ? value : 0;
      }
      previous = Math.abs(residual);
      history.magnitudes[entry * components + c] = previous;
    }
  }

  /** The code nearest to a predicted value; 0 for one that is none. */
  #round(guess) {
    if (this.isFloat) return orderedCode(guess);
    return Math.abs(guess) < MAX_CODE ? Math.floor(guess + 0.5) : 0;
  }

  /** Fill `guess` for entry i of the order. */
  #predict(i) {
    const { guess, numbers, components, gates, method, history } = this;
    const { order, starts } = history;
    const [begin, end] = [starts[i], starts[i + 1]];
    if (begin === end || method === LAST) {
      const from = begin === end ? (i > 0 ? order[i - 1] : -1) : gates[4 * begin];
      for (let c = 0; c < components; c++) guess[c] = from >= 0 ? numbers[from * components + c] : 0;
      return;
    }
    const isComplete = gates[4 * begin + 1] >= 0;
    if (isComplete && method >= CONFORMAL && this.#predictByShape(begin, end)) return;
    guess.fill(0);
    let n = isComplete && method >= PARALLELOGRAM ? this.#addParallelograms(begin, end) : 0;
    if (n === 0) {
      for (let g = begin; g < end; g++) {
        for (let k = 0; k < (isComplete ? 2 : 1); k++) {
          n++;
          for (let c = 0; c < components; c++) guess[c] += numbers[gates[4 * g + k] * components + c];
        }
      }
    }
    for (let c = 0; c < components; c++) guess[c] /= n;
  }

  #addParallelograms(begin, end) {
    const { guess, numbers, components, gates } = this;
    let n = 0;
    for (let g = begin; g < end; g++) {
      const [a, b, o] = [gates[4 * g] * components, gates[4 * g + 1] * components, gates[4 * g + 2] * components];
      if (o < 0) continue;
      n++;
      for (let c = 0; c < components; c++) guess[c] += numbers[a + c] + numbers[b + c] - numbers[o + c];
    }
    return n;
  }

  /** Fill `guess` with the average over the gates whose triangles have an edge of some length; false without one. */
  #predictByShape(begin, end) {
    const { guess, numbers, gates, faces, shape, across } = this;
    let n = 0;
    guess[0] = guess[1] = 0;
    for (let g = begin; g < end; g++) {
      const [a, b, corner] = [2 * gates[4 * g], 2 * gates[4 * g + 1], gates[4 * g + 3]];
      this.#measure(faces[corner], faces[nextCorner(corner)], faces[previousCorner(corner)]);
      const [along, above, squared] = shape;
      if (!(squared > 0)) continue;
      const du = numbers[b] - numbers[a];
      const dv = numbers[b + 1] - numbers[a + 1];
      this.#findAcross(g, du, dv, above);
      guess[0] += numbers[a] + along * du + above * across[0];
      guess[1] += numbers[a + 1] + along * dv + above * across[1];
      n++;
    }
    if (n) {
      guess[0] /= n;
      guess[1] /= n;
    }
    return n > 0;
  }

  /** Fill `across` with what changes in the plane with a step in space across the edge of gate g, as long as the edge. */
  #findAcross(g, du, dv, above) {
    const { numbers, gates, faces, shape, across } = this;
    const [a, o, corner] = [2 * gates[4 * g], 2 * gates[4 * g + 2], gates[4 * g + 3]];
    let turn = this.side;
    if (o >= 0) {
      const ou = numbers[o] - numbers[a];
      const ov = numbers[o + 1] - numbers[a + 1];
      if (this.method === AFFINE) {
        this.#measure(faces[this.opposite[corner]], faces[nextCorner(corner)], faces[previousCorner(corner)]);
        const [along, height] = shape;
        if (height > LEAST_HEIGHT * above) {
          across[0] = (along * du - ou) / height;
          across[1] = (along * dv - ov) / height;
          return;
        }
      }
      const cross = du * ov - dv * ou;
      if (cross !== 0) turn = cross > 0 ? -1 : 1;
    }
    across[0] = -turn * dv;
    across[1] = turn * du;
  }

  /** Of vertex x over the edge from a to b: place along it, height over it, both in units of its length, whose square is last. */
  #measure(x, a, b) {
    const { positions, shape } = this;
    let [squared, dot, height] = [0, 0, 0];
    for (let axis = 0; axis < 3; axis++) {
      const origin = positions[3 * a + axis];
      const edge = positions[3 * b + axis] - origin;
      const own = positions[3 * x + axis] - origin;
      squared += edge * edge;
      dot += edge * own;
      height += own * own;
    }
    if (!(squared > 0 && height < Infinity)) {
      shape.fill(0);
      return;
    }
    const along = dot / squared;
    shape[0] = along;
    shape[1] = Math.sqrt(Math.max(0, height / squared - along * along));
    shape[2] = squared;
  }

  /** Note on which side of an edge a texture triangle lies. */
  #noteSide(begin, end, entry) {
    const { numbers, gates } = this;
    if (begin === end || gates[4 * begin + 1] < 0) return;
    const [a, b] = [2 * gates[4 * begin], 2 * gates[4 * begin + 1]];
    const du = numbers[b] - numbers[a];
    const dv = numbers[b + 1] - numbers[a + 1];
    const cross = du * (numbers[2 * entry + 1] - numbers[a + 1]) - dv * (numbers[2 * entry] - numbers[a]);
    if (cross !== 0) this.side = cross > 0 ? 1 : -1;
  }
}

/** Directions on the octahedral lattice, predicted: normals and tangents. Mirrors `gvpipe.attributes.octahedral_kernels`. */

import { History, residualContext } from "./history.js";

export const [MEAN, SURFACE, PLACE, SURFACE_CORRECTED, PLACE_CORRECTED] = [1, 2, 3, 4, 5]; // methods; 0 is the last one

export class OctahedralDecoder {
  /**
   * @param {import("../format/serial_decoder.js").SerialDecoder} coder
   * @param {object} entries of `prepareEntries`
   * @param {{method: number, flags: number, shift: number}} how
   * @param {{n: number, width: number}} lattice sum of the magnitudes of a point's coordinates; 4 for tangents, else 3
   * @param {Float64Array|null} normals (N, 3) of the surface at each entry
   */
  constructor(coder, entries, how, { n, width }, normals) {
    this.coder = coder;
    this.method = how.method;
    this.n = n;
    this.width = width;
    this.normals = normals;
    this.codes = new Float64Array(entries.order.length * width);
    this.history = new History(coder, entries, how, this.codes, width, 3);
    this.guess = [0, 0, 0, 0];
  }

  /** @returns {Float64Array} (N, width) lattice points, and signs of tangents */
  decode() {
    const { history } = this;
    for (let i = 0; i < history.order.length; i++) {
      const entry = history.order[i];
      const match = history.match(i);
      if (match >= 0) {
        history.copy(entry, match);
      } else {
        this.#predict(i, entry);
        this.#decodePoint(i, entry);
        if (this.width === 4) this.#decodeSign(i, entry);
      }
      history.remember(entry, match >= 0);
    }
    return this.codes;
  }

  #decodePoint(i, entry) {
    const { history, guess, n } = this;
    const axis = mainAxis(guess);
    const flip = guess[axis] >= 0 ? 1 : -1;
    const chart = [0, 0];
    let previous = 0;
    for (let c = 0; c < 2; c++) {
      const residual = this.coder.value(history.context(i, c, previous, 0));
      chart[c] = guess[(axis + 1 + c) % 3] + residual;
      previous = Math.abs(residual);
      history.magnitudes[3 * entry + c] = previous;
    }
    if (!(Math.abs(chart[0]) <= n && Math.abs(chart[1]) <= n)) throw this.coder.corrupt("a direction is out of range");
    this.#unfold(chart, axis, flip, this.width * entry);
  }

  /** From coordinates around an axis to a lattice point: on its side, or folded from the far side. */
  #unfold([u, v], axis, flip, at) {
    const { codes, n } = this;
    const height = n - Math.abs(u) - Math.abs(v);
    if (height < 0) [u, v] = [(n - Math.abs(v)) * (u >= 0 ? 1 : -1), (n - Math.abs(u)) * (v >= 0 ? 1 : -1)];
    codes[at + ((axis + 1) % 3)] = u;
    codes[at + ((axis + 2) % 3)] = v;
    codes[at + axis] = height * flip;
  }

  #decodeSign(i, entry) {
    const { history, guess } = this;
    const near = i > 0 ? 2 * history.magnitudes[3 * history.order[i - 1] + 2] : 0;
    const differs = this.coder.value(residualContext(1, Math.floor(near / history.scale), 0));
    this.codes[4 * entry + 3] = differs === 0 ? guess[3] : -guess[3];
    history.magnitudes[3 * entry + 2] = Math.min(Math.abs(differs), 1);
  }

  /** Fill `guess` for entry i of the order: a lattice point and a sign. */
  #predict(i, entry) {
    const { codes, width, normals, method, guess, history } = this;
    const { order, starts, gates } = history;
    const [begin, end] = [starts[i], starts[i + 1]];
    const nearest = begin < end ? gates[4 * begin] : i > 0 ? order[i - 1] : -1;
    guess[3] = nearest >= 0 && width === 4 ? codes[4 * nearest + 3] : 1;
    let [x, y, z] = [0, 0, 0];
    if (method >= SURFACE) {
      [x, y, z] = [normals[3 * entry], normals[3 * entry + 1], normals[3 * entry + 2]];
      if (method >= SURFACE_CORRECTED) [x, y, z] = this.#correct(begin, end, unit(x, y, z));
    } else if (method === MEAN) {
      for (let g = begin; g < end; g++) {
        for (let k = 0; k < 2; k++) {
          const other = width * gates[4 * g + k];
          if (other < 0) continue;
          x += codes[other];
          y += codes[other + 1];
          z += codes[other + 2];
        }
      }
    }
    if (Math.abs(x) + Math.abs(y) + Math.abs(z) === 0 && nearest >= 0) {
      const at = width * nearest;
      [x, y, z] = [codes[at], codes[at + 1], codes[at + 2]];
    }
    this.#toLattice(x, y, z);
  }

  /** A unit normal, moved by half the mean by which earlier normals differ from those of the surface. */
  #correct(begin, end, [x, y, z]) {
    const { codes, width, normals } = this;
    const { gates } = this.history;
    let [dx, dy, dz, n] = [0, 0, 0, 0];
    for (let g = begin; g < end; g++) {
      for (let k = 0; k < 2; k++) {
        const other = gates[4 * g + k];
        if (other < 0) continue;
        const [ux, uy, uz] = unit(codes[width * other], codes[width * other + 1], codes[width * other + 2]);
        const [vx, vy, vz] = unit(normals[3 * other], normals[3 * other + 1], normals[3 * other + 2]);
        dx += ux - vx;
        dy += uy - vy;
        dz += uz - vz;
        n++;
      }
    }
    return n ? [x + (0.5 * dx) / n, y + (0.5 * dy) / n, z + (0.5 * dz) / n] : [x, y, z];
  }

  /** Fill `guess` with a lattice point close to a direction; (0, 0, n) without one. */
  #toLattice(x, y, z) {
    const { n, guess } = this;
    const length = Math.abs(x) + Math.abs(y) + Math.abs(z);
    if (!(length > 0 && length < Infinity)) {
      [guess[0], guess[1], guess[2]] = [0, 0, n];
      return;
    }
    let i = Math.floor((Math.abs(x) / length) * n + 0.5);
    let j = Math.floor((Math.abs(y) / length) * n + 0.5);
    if (i + j > n) {
      if (i >= j) i--;
      else j--;
    }
    const k = n - i - j;
    guess[0] = x < 0 ? -i : i;
    guess[1] = y < 0 ? -j : j;
    guess[2] = z < 0 ? -k : k;
  }
}

/**
 * (nPlaces, 3) for each place of corners the sum of its triangles' normals, each as long as twice the triangle's area.
 *
 * @param {Uint32Array} faces (3T) @param {Float32Array} positions (V, 3) @param {(corner: number) => number} placeOf
 */
export function cornerNormals(faces, positions, placeOf, nPlaces) {
  const sums = new Float64Array(3 * nPlaces);
  for (let t = 0; t < faces.length; t += 3) {
    const [a, b, c] = [3 * faces[t], 3 * faces[t + 1], 3 * faces[t + 2]];
    const [ux, uy, uz] = [positions[b] - positions[a], positions[b + 1] - positions[a + 1], positions[b + 2] - positions[a + 2]];
    const [vx, vy, vz] = [positions[c] - positions[a], positions[c + 1] - positions[a + 1], positions[c + 2] - positions[a + 2]];
    for (let corner = t; corner < t + 3; corner++) {
      const at = 3 * placeOf(corner);
      sums[at] += uy * vz - uz * vy;
      sums[at + 1] += uz * vx - ux * vz;
      sums[at + 2] += ux * vy - uy * vx;
    }
  }
  return sums;
}

/** The axis along which a point lies farthest out, the first of equals. */
function mainAxis(point) {
  let axis = 0;
  for (let k = 1; k < 3; k++) if (Math.abs(point[k]) > Math.abs(point[axis])) axis = k;
  return axis;
}

/** A direction with length 1; zero stays zero. */
function unit(x, y, z) {
  const length = Math.sqrt(x * x + y * y + z * z);
  return length > 0 && length < Infinity ? [x / length, y / length, z / length] : [0, 0, 0];
}

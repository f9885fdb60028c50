/** A blend's transforms over a segment. Mirrors `gvcodecs.mcgv.motion.skinning_coding`; `docs/format.md`, section 5. */

import { SKINNING_CODING_PREDICTED as PREDICTED } from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { decodeBasis } from "../trajectory/basis.js";
import { independentOrder, placed } from "../trajectory/causal_order.js";
import { decodeVectors } from "../trajectory/coefficient_coding.js";
import { rowOrder } from "./row_neighbours.js";

export class Trajectories {
  /**
   * @param {import("../wasm/kernels.js").Kernels} kernels whose memory is for this alone
   * @param {Uint8Array} data section `transforms.s`
   * @param {import("./skinning.js").Blend} blend whose weights give the rows' causal neighbours
   * @param {number} clusters K @param {number} frames of the segment
   * @param {number} step quantisation step, model units
   * @param {string} name of the section, for messages
   * @param {import("../format/budget.js").Budget} budget of the file
   */
  constructor(kernels, data, blend, clusters, frames, step, name, budget) {
    const isPredicted = data[0] === PREDICTED;
    const cursor = new Cursor(isPredicted ? data.subarray(1) : data, name);
    this.basis = decodeBasis(kernels, cursor.block(), frames, 4 * clusters, step, name, 3, budget);
    /** (4K, R) flat. */
    const order = placed(kernels, isPredicted ? (blend.rowOrder ??= rowOrder(blend, clusters)) : independentOrder(4 * clusters));
    this.coefficients = kernels.view(decodeVectors(kernels, order, cursor.rest(), this.basis.components, step, name)).slice();
    this.n = 4 * clusters;
  }

  /** Rows of equal weight (4K, 3), flat, of one frame of the segment: `mean + coefficients @ vectors`. */
  rows(frame) {
    const { coefficients, n } = this;
    const { columns, components } = this.basis;
    const rows = new Float64Array(3 * n);
    const width = components + 1;
    const at = 3 * frame * width;
    for (let i = 0, row = 0; i < n; i++) {
      let x = columns[at];
      let y = columns[at + width];
      let z = columns[at + 2 * width];
      for (let c = at + 1; c < at + width; c++) {
        const coefficient = coefficients[row++];
        x += coefficient * columns[c];
        y += coefficient * columns[c + width];
        z += coefficient * columns[c + 2 * width];
      }
      rows[3 * i] = x;
      rows[3 * i + 1] = y;
      rows[3 * i + 2] = z;
    }
    return rows;
  }
}

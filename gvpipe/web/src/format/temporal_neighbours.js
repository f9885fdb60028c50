/** Rows of a trajectory basis, one per frame and axis, in an order that interpolates. Mirrors `gvpipe.trajectory.temporal_neighbours`. */

import {
  TEMPORAL_NEIGHBOURS_CUBIC as CUBIC,
  TEMPORAL_NEIGHBOURS_LINEAR as LINEAR,
  TEMPORAL_NEIGHBOURS_MAX_NEIGHBOURS as MAX_NEIGHBOURS,
  TEMPORAL_NEIGHBOURS_MIN_BLOCK as MIN_BLOCK,
  TEMPORAL_NEIGHBOURS_OFFSETS as OFFSETS,
  TEMPORAL_NEIGHBOURS_VARIANCE as VARIANCE,
} from "../constants.js";

const BEFORE = new Map([[-1, 1]]);

/** @param {number} frames @returns {import("./prediction.js").Rows} 3 F rows; row 3 f + a is axis a of frame f */
export function frameRows(frames) {
  const rows = { order: [], starts: [0], near: [], weights: [], variances: [], rings: [], blocks: [0] };
  const isKnown = new Uint8Array(frames);
  const add = (frame, step) => {
    const near = OFFSETS.filter((o) => isKnown[frame + o * step]).slice(0, MAX_NEIGHBOURS);
    const prior = [CUBIC, LINEAR, BEFORE].find((p) => [...p.keys()].every((o) => near.includes(o)));
    for (let axis = 0; axis < 3; axis++) {
      rows.order.push(3 * frame + axis);
      for (const o of near) {
        rows.near.push(3 * (frame + o * step) + axis);
        rows.weights.push(prior?.get(o) ?? 0);
        rows.variances.push(VARIANCE);
      }
      rows.starts.push(rows.near.length);
      rows.rings.push(Math.min(near.length, 2));
    }
    isKnown[frame] = 1;
  };
  const endBlock = (isLast) => {
    const last = rows.blocks[rows.blocks.length - 1];
    if (rows.order.length - last >= MIN_BLOCK || isLast) rows.blocks.push(rows.order.length);
  };
  let step = 1;
  while (step < frames) step *= 2; // the first power of two that is no frame
  add(0, step);
  step = Math.max(1, step / 2);
  for (let frame = step; frame < frames; frame += step) add(frame, step);
  endBlock(step === 1);
  while (step > 1) {
    step /= 2;
    for (let frame = step; frame < frames; frame += 2 * step) add(frame, step);
    endBlock(step === 1);
  }
  return rows;
}

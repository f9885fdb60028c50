/**
 * The causal order of a trajectory basis' vectors, one per frame and axis, that interpolates them in time. Mirrors
 * `gvpipe.trajectory.temporal_neighbours`.
 */

import {
  TEMPORAL_NEIGHBOURS_CUBIC as CUBIC,
  TEMPORAL_NEIGHBOURS_LINEAR as LINEAR,
  TEMPORAL_NEIGHBOURS_MAX_NEIGHBOURS as MAX_NEIGHBOURS,
  TEMPORAL_NEIGHBOURS_MIN_BLOCK as MIN_BLOCK,
  TEMPORAL_NEIGHBOURS_MORE_NEIGHBOURS as MORE_NEIGHBOURS,
  TEMPORAL_NEIGHBOURS_MORE_VARIANCE as MORE_VARIANCE,
  TEMPORAL_NEIGHBOURS_OFFSETS as OFFSETS,
  TEMPORAL_NEIGHBOURS_VARIANCE as VARIANCE,
} from "../constants.js";

const BEFORE = new Map([[-1, 1]]);

/**
 * @param {number} frames F @param {number} axes A: three of positions
 * @param {boolean} findsNoises weights start less sure, and there are more of them
 * @returns {import("./causal_order.js").CausalOrder} of A F vectors; vector A f + a is axis a of frame f
 */
export function temporalOrder(frames, axes, findsNoises = false) {
  const [most, variance] = findsNoises ? [MORE_NEIGHBOURS, MORE_VARIANCE] : [MAX_NEIGHBOURS, VARIANCE];
  const causal = { order: [], starts: [0], neighbours: [], weights: [], variances: [], ringSizes: [], blocks: [0], affine: false };
  const isDone = new Uint8Array(frames);
  const add = (frame, step) => {
    const offsets = OFFSETS.filter((o) => isDone[frame + o * step]).slice(0, most);
    const prior = [CUBIC, LINEAR, BEFORE].find((p) => [...p.keys()].every((o) => offsets.includes(o)));
    for (let axis = 0; axis < axes; axis++) {
      causal.order.push(axes * frame + axis);
      for (const o of offsets) {
        causal.neighbours.push(axes * (frame + o * step) + axis);
        causal.weights.push(prior?.get(o) ?? 0);
        causal.variances.push(variance);
      }
      causal.starts.push(causal.neighbours.length);
      causal.ringSizes.push(Math.min(offsets.length, 2));
    }
    isDone[frame] = 1;
  };
  const endBlock = (isLast) => {
    const last = causal.blocks[causal.blocks.length - 1];
    if (causal.order.length - last >= MIN_BLOCK || isLast) causal.blocks.push(causal.order.length);
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
  return causal;
}

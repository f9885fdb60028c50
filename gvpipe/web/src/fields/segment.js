/** One segment of a field, from bytes to values. Mirrors `gvpipe.fields.segment`. */

import {
  PREDICTION_TUNINGS as TUNINGS,
  PREDICTION_KERNELS_FLOATS as FLOATS,
  PREDICTION_KERNELS_N_FILTERS as N_FILTERS,
  PREDICTION_KERNELS_N_SHARED as N_SHARED,
  PREDICTION_KERNELS_STEPS as STEPS,
  PREDICTION_KERNELS_WHOLE as WHOLE,
  SEGMENTS_LARGEST_STEP as LARGEST_STEP,
  SEGMENT_DERIVED as DERIVED,
  SEGMENT_EXACT as EXACT,
  SEGMENT_TRAJECTORIES as TRAJECTORIES,
  SEGMENT_TUNED as TUNED,
} from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { decodeIntegers } from "../format/integers.js";
import { derivedValues, takeDerivation } from "./derived.js";
import { decodeHoles } from "./holes.js";
import { inBlocks } from "../trajectory/coefficient_coding.js";
import { decodeResiduals } from "./residual_coding.js";
import { decodeTrajectories } from "./trajectories.js";
import { bytesOf, newValues, rounding, valuesOf } from "./values.js";

/**
 * @typedef {object} Place where a segment belongs
 * @property {import("../wasm/kernels.js").Kernels} kernels whose memory is the segment's alone
 * @property {import("../wasm/kernels.js").KernelArray[]} causal the order of R rows, as kernels take it
 * @property {string} name of the section, for messages
 * @property {import("./derived.js").Span} span
 *
 * @param {Uint8Array} data @param {[number, number, number]} shape n, R, C @param {string} type of the values @param {Place} place
 * @returns {Promise<Float32Array|Int32Array>} (n, R, C), an array of the type; NaN for holes
 * @throws {GeometryVideoError} it is not as gvpipe writes it
 */
export async function decodeSegment(data, shape, type, place) {
  const [frames, rows, components] = shape;
  const cursor = new Cursor(data, place.name);
  const holes = decodeHoles(cursor.block(), shape, place);
  if (holes && type !== "float32") throw cursor.corrupt("integers have holes");
  const shown = decodeHolds(cursor.block(), frames, place.name);
  const mode = cursor.u8();
  const flags = cursor.take(components);
  if (mode > TUNED || flags.some((flag) => flag > 1)) throw cursor.corrupt(`its mode is ${mode}, its flags ${flags}`);
  const distinct = frames ? shown[frames - 1] + 1 : 0;
  const found = newValues(type, distinct * rows * components);
  if (rows) {
    takeConstants(cursor, flags, type, found);
    if (flags.includes(0)) await fillOthers(cursor, { mode, type, flags, shown }, found, place);
  }
  cursor.end();
  const result = distinct === frames ? found : newValues(type, frames * rows * components);
  if (result !== found) shown.forEach((d, k) => result.set(found.subarray(d * rows * components, (d + 1) * rows * components), k * rows * components));
  holes?.forEach((isHole, i) => isHole && (result[i] = NaN));
  return result;
}

/** The distinct frame of each frame, (n). */
function decodeHolds(data, frames, name) {
  if (!data.length) return Int32Array.from({ length: frames }, (_, k) => k);
  const cursor = new Cursor(data, name);
  const distinct = cursor.varint(frames, "the number of distinct frames");
  const repeats = decodeIntegers(cursor.rest(), distinct, null, name); // lengths less 1
  const total = repeats.reduce((sum, more) => sum + more + 1, 0);
  if (!distinct || total !== frames || repeats.some((more) => more < 0)) throw cursor.corrupt("its repeated frames do not fit");
  const shown = new Int32Array(frames);
  for (let d = 0, k = 0; d < distinct; d++) for (const end = k + repeats[d] + 1; k < end; k++) shown[k] = d;
  return shown;
}

function takeConstants(cursor, flags, type, found) {
  const constants = [...flags.keys()].filter((c) => flags[c]);
  const values = valuesOf(type, cursor.take(bytesOf(type, constants.length)));
  if (!values.every(Number.isFinite)) throw cursor.corrupt("a value is not finite");
  for (let i = 0; i < found.length; i += flags.length) constants.forEach((c, k) => (found[i + c] = values[k]));
}

/** Fill the components that are not constant. */
async function fillOthers(cursor, { mode, type, flags, shown }, found, place) {
  const { kernels, causal, name } = place;
  const changing = [...flags.keys()].filter((c) => !flags[c]);
  const [rows, frames, width] = [causal[0].shape[0], shown.at(-1) + 1, changing.length];
  const isWhole = type !== "float32";
  const step = cursor.f64();
  if (!(step > 0 && step <= LARGEST_STEP)) throw cursor.corrupt(`its step is ${step}`);
  if (mode === EXACT && (isWhole ? step !== 1 : !isPowerOfTwo(step))) throw cursor.corrupt(`its unit is ${step}`);
  const still = decodeStill(cursor.block(), place);
  let [value, base] = [null, null];
  if (mode === TRAJECTORIES) {
    value = decodeTrajectories(cursor.rest(), [frames, width], place);
  } else {
    if (mode === DERIVED) {
      const derivation = takeDerivation(cursor, width, place.span.frameCount);
      const firsts = [...shown.keys()].filter((k) => !k || shown[k] !== shown[k - 1]);
      base = await derivedValues(derivation, firsts, place.span);
    }
    const tuning = mode === TUNED ? cursor.u8() : 0;
    if (tuning >= TUNINGS.length) throw cursor.corrupt(`its filters have constants of number ${tuning}`);
    const residuals = decodeResiduals(kernels, causal, cursor.rest(), [width * frames, frames], name, still);
    const decoded = kernels.array("float64", [rows, width * frames]);
    const kind = mode !== EXACT ? STEPS : isWhole ? WHOLE : FLOATS;
    const unit = kind === FLOATS ? step : 0;
    const [target, learnt] = [kernels.array("float64", [0, 0]), kernels.array("float64", [rows, N_FILTERS, N_SHARED + 2])];
    const constants = kernels.array("float64", [N_FILTERS, TUNINGS[0][0].length], TUNINGS[tuning].flat());
    const given = [...causal, frames, still, kind, unit, constants, residuals, decoded, target, learnt];
    inBlocks(rows, (first, end) => kernels.call("predict_rows", ...given, first, end));
    const view = kernels.view(decoded);
    value = (row, k, frame) => view[(row * width + k) * frames + frame];
  }
  const round = rounding(type, mode === EXACT);
  for (let row = 0; row < rows; row++) {
    for (let k = 0; k < width; k++) {
      for (let frame = 0; frame < frames; frame++) {
        const own = value(row, k, frame) * step;
        const number = round(base ? base[(frame * rows + row) * width + k] + own : own);
        if (number !== number) throw cursor.corrupt("a value is out of its type's range");
        found[(frame * rows + row) * flags.length + changing[k]] = number;
      }
    }
  }
}

/** (R) flags of rows that keep their values, as kernels take them. */
function decodeStill(data, { kernels, causal, name }) {
  const still = kernels.array("bool", causal[0].shape);
  if (!data.length) return still;
  const residuals = decodeResiduals(kernels, causal, data, [1, 1], name);
  const [words, flags] = [kernels.words(residuals), kernels.view(still)];
  for (let row = 0; row < flags.length; row++) flags[row] = words[2 * row] || words[2 * row + 1] ? 1 : 0;
  kernels.free(residuals);
  return still;
}

function isPowerOfTwo(value) {
  const exponent = Math.round(Math.log2(value));
  return value === 2 ** exponent;
}

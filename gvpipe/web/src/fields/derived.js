/** Values that follow from decoded positions. Mirrors `gvpipe.fields.derived`. */

import { DERIVED_MAGNITUDE as MAGNITUDE, DERIVED_SIGNALS as SIGNALS } from "../constants.js";

/**
 * @typedef {object} Span the motion of a segment's frames
 * @property {number} start the segment's first frame @property {number} frameCount F of the sequence
 * @property {Int32Array|null} faces (3T) of rows that are triangles or polygons; null: rows are vertices
 * @property {Int32Array|null} polygons corners of each, of rows that are polygons
 * @property {(frame: number) => Promise<Float32Array>} positions (V, 3) decoded
 *
 * @param {import("../format/cursor.js").Cursor} cursor @param {number} components @param {number} frameCount F
 * @returns {{kind: number, reference: number, coefficients: Float32Array}} coefficients (C, S)
 */
export function takeDerivation(cursor, components, frameCount) {
  const kind = cursor.u8();
  if (kind >= SIGNALS.length) throw cursor.corrupt(`a derivation's kind is ${kind}`);
  const reference = cursor.varint(frameCount - 1, "a reference frame");
  const coefficients = new Float32Array(cursor.take(4 * components * SIGNALS[kind]).slice().buffer);
  if (!coefficients.every(Number.isFinite)) throw cursor.corrupt("a coefficient of its derivation is not finite");
  return { kind, reference, coefficients };
}

/**
 * @param {number[]} frames of the segment, counted from its start @param {Span} span
 * @returns {Promise<Float64Array>} (n, R, C) what follows in these frames
 */
export async function derivedValues({ kind, reference, coefficients }, frames, span) {
  const rows = rowsOf(span);
  const still = await rows(reference);
  const components = coefficients.length / SIGNALS[kind];
  const count = still.length / 3;
  const result = new Float64Array(frames.length * count * components);
  let at = 0;
  for (const frame of frames) {
    const k = span.start + frame;
    const now = await rows(k);
    const signals = kind === MAGNITUDE ? [distances(now, still)] : differences(now, still);
    if (kind !== MAGNITUDE) {
      signals.push(...differences(await rows(Math.min(k + 1, span.frameCount - 1)), await rows(Math.max(k - 1, 0))));
    }
    for (let c = 0; c < components; c++) {
      for (let s = 0; s < signals.length; s++) {
        const own = coefficients[c * signals.length + s];
        if (own === 0) continue;
        for (let row = 0; row < count; row++) result[at + row * components + c] += own * signals[s][row];
      }
    }
    at += count * components;
  }
  return result;
}

/** A function that gives rows' positions (R, 3) in a frame; it keeps those that are asked for again. */
function rowsOf({ faces, polygons, positions }) {
  const kept = new Map();
  return async (frame) => {
    if (!kept.has(frame)) {
      const points = await positions(frame);
      if (kept.size > 3) kept.delete(Math.min(...kept.keys()));
      kept.set(frame, faces ? middles(points, faces, polygons) : points);
    }
    return kept.get(frame);
  };
}

function middles(points, faces, polygons) {
  const result = new Float64Array(faces.length);
  for (let t = 0; t < faces.length; t += 3) {
    for (let axis = 0; axis < 3; axis++) {
      result[t + axis] = (points[3 * faces[t] + axis] + points[3 * faces[t + 1] + axis] + points[3 * faces[t + 2] + axis]) / 3;
    }
  }
  return polygons ? means(result, polygons) : result;
}

/** The mean of the triangles of each polygon. */
function means(points, polygons) {
  const result = new Float64Array(3 * polygons.length);
  let from = 0;
  polygons.forEach((corners, p) => {
    for (let axis = 0; axis < 3; axis++) {
      let sum = 0;
      for (let k = 0; k < corners - 2; k++) sum += points[from + 3 * k + axis];
      result[3 * p + axis] = sum / (corners - 2);
    }
    from += 3 * (corners - 2);
  });
  return result;
}

/** One array for each axis. */
function differences(a, b) {
  return [0, 1, 2].map((axis) => Float64Array.from({ length: a.length / 3 }, (_, row) => a[3 * row + axis] - b[3 * row + axis]));
}

function distances(a, b) {
  const [x, y, z] = differences(a, b);
  return x.map((_, row) => Math.sqrt(x[row] * x[row] + y[row] * y[row] + z[row] * z[row]));
}

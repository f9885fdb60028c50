/** Positions moved by a field of displacements. Mirrors `gvpipe.model.warp`. */

import { WARP_USUAL as USUAL } from "../constants.js";

/** A field of vectors at vertices, and how far it moves them. */
export class Warp {
  /** @param {import("../fields/coded_field.js").CodedField} field that `canMove` @param {number} scale */
  constructor(field, scale) {
    this.field = field;
    this.scale = scale;
    const Values = field.type === "float64" ? Float64Array : Float32Array;
    this.moves = new Values(field.rowCount * field.components);
  }

  /** Have the displacements of frame k, if it is in memory; else those of the frame before stay. @returns {boolean} whether it was */
  read(k) {
    return this.field.read(k, this.moves);
  }

  /** Move points `(V, 3)` in units that are `unit` of the model's; holes (NaN) move nothing. */
  move(points, unit) {
    const { moves, field } = this;
    const factor = this.scale * unit;
    const width = field.components;
    for (let v = 0; v < field.rowCount; v++) {
      for (let axis = 0; axis < width; axis++) points[3 * v + axis] += factor * moves[v * width + axis] || 0;
    }
  }

  /** A box with room for displacements, as far as they were decoded. @param {{min: number[], max: number[]}} box */
  widened({ min, max }) {
    const reach = this.field.extents.map((extent) => extent.map((value) => this.scale * value));
    return {
      min: min.map((value, axis) => value + Math.min(0, ...(reach[axis] ?? []))),
      max: max.map((value, axis) => value + Math.max(0, ...(reach[axis] ?? []))),
    };
  }
}

/** Whether a field can move vertices. */
export function canMove({ domain, components }) {
  return domain === "vertex" && (components === 2 || components === 3);
}

/** The name of a field that is there to move the mesh, or null. @param {Map<string, object>} fields */
export function usualMover(fields) {
  return [...fields.keys()].find((name) => USUAL.includes(name.toLowerCase()) && canMove(fields.get(name))) ?? null;
}

/**
 * What `NAME` or `NAME:SCALE` asks for.
 *
 * @param {string|null} text @param {Map<string, object>} fields
 * @returns {{name: string, scale: number}|null} null: nothing, or no field that can move vertices
 */
export function parseWarp(text, fields) {
  if (text === null) return null;
  const isMover = (name) => fields.has(name) && canMove(fields.get(name));
  if (isMover(text)) return { name: text, scale: 1 };
  const colon = text.lastIndexOf(":");
  const [name, last] = [text.slice(0, colon), text.slice(colon + 1).trim()];
  const scale = last ? Number(last) : NaN;
  return colon > 0 && isMover(name) && Number.isFinite(scale) ? { name, scale } : null;
}

/** What repeats inside of a field and is coded once. Mirrors `gvpipe.asset_coding.reduction`. */

import { VALUES_MAX_COMPONENTS as MAX_COMPONENTS } from "../constants.js";
import { corrupt } from "../format/errors.js";

const LARGEST_OFFSET = 3.5e38;

/**
 * @typedef {object} Reduction
 * @property {Int32Array|null} polygons corners of each polygon, if there is a row per polygon
 * @property {number[]|null} columns (C) the coded component of each component; null: all are coded
 * @property {number[]|null} offsets what is added to each coded component
 * @property {number} components K, that are coded
 *
 * @param {import("../asset/asset_entry.js").AssetEntry|null} entry the member; null: nothing repeats @param {number} components C
 * @param {string} domain of the field @param {Int32Array|null} polygons of the mesh
 * @returns {Reduction} @throws {GeometryVideoError} it is not as gvpipe writes it
 */
export function readReduction(entry, components, domain, polygons) {
  if (!entry) return { polygons: null, columns: null, offsets: null, components };
  const byPolygon = entry.flag("polygons", false);
  if (byPolygon && (domain !== "triangle" || !polygons)) throw corrupt("asset", `${entry.where} has a row per polygon, and the mesh has none`);
  const columns = entry.numbers("columns", components, null, 0, MAX_COMPONENTS - 1);
  const coded = columns ? Math.max(...columns) + 1 : components;
  if (columns && !(columns.every(Number.isInteger) && new Set(columns).size === coded)) {
    throw corrupt("asset", `${entry.where}: its columns are not numbers from 0 on`);
  }
  const offsets = entry.numbers("offsets", coded, null, -LARGEST_OFFSET, LARGEST_OFFSET);
  return { polygons: byPolygon ? polygons : null, columns, offsets, components: coded };
}

/**
 * @param {Float32Array|Int32Array} values (n, R', K) as a section has them @param {Reduction} reduction
 * @returns {Float32Array|Float64Array|Int32Array} (n, R, C)
 */
export function restored(values, { polygons, columns, offsets, components }) {
  if (!polygons && !columns && !offsets) return values;
  const sources = columns ?? Array.from({ length: components }, (_, c) => c);
  const rows = values.length / components;
  const triangles = polygons ? polygons.reduce((sum, corners) => sum + corners - 2, 0) * (rows / polygons.length) : rows;
  const result = new (offsets ? Float64Array : values.constructor)(triangles * sources.length);
  let at = 0;
  for (let row = 0; row < rows; row++) {
    const count = polygons ? polygons[row % polygons.length] - 2 : 1;
    for (let k = 0; k < count; k++) {
      for (const c of sources) result[at++] = values[row * components + c] + (offsets ? offsets[c] : 0);
    }
  }
  return result;
}

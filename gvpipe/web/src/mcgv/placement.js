/** The slots' pixels where a blend moves them. Mirrors `gvcodecs.mcgv.decoding.frame_reader.read_layout`. */

import { corrupt } from "../format/errors.js";
import { decodeCharts } from "./chart_coding.js";
import { place } from "./kd_tree.js";
import { decodePixels } from "./layout_coding.js";
import { placeCharts } from "./tiles.js";

/** The section that a placement needs; none where it follows from the base frame. */
export const SECTIONS = { charts: "pixels", tiles: "charts" };

/**
 * @param {Uint8Array|null} data that section
 * @param {import("./header.js").Header} header @param {import("./surface.js").Surface} surface
 * @returns {ArrayLike<number>} (S) the pixel of each slot in a plane
 */
export function placeSlots(data, header, surface) {
  const { lattice, point, points, visits, nSlots } = surface;
  const { width, height, placement } = header;
  if (width * height < nSlots) throw corrupt("header", `planes of ${width}x${height} do not hold ${nSlots} samples`);
  if (placement === "charts") return decodePixels(data, visits, header);
  if (placement === "halves") return place(lattice, piecesOf(surface), header);
  const charts = decodeCharts(data, points.causalNeighbours());
  return placeCharts(lattice, point.map((p) => charts[p]), header);
}

/** (S) the connected piece of the surface that each slot belongs to. */
function piecesOf({ point, points }) {
  const pieces = points.pieces();
  return point.map((p) => pieces[p]);
}

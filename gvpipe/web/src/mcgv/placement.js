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
  const { lattice, points, nSlots } = surface;
  const { width, height, placement } = header;
  if (width * height < nSlots) throw corrupt("header", `planes of ${width}x${height} do not hold ${nSlots} samples`);
  if (placement === "charts") return decodePixels(data, nSlots, header);
  if (placement === "halves") return place(lattice, points.pieces(), header);
  return placeCharts(lattice, decodeCharts(data, points.causalNeighbours()), header);
}

/** What the reader of an `mcgv` bitstream must know beside its sections. Mirrors `gvcodecs.mcgv.header.Header`. */

import {
  HEADER_VERSION as VERSION,
  SEGMENTS_HUGE as HUGE,
  HEADER_MAX_CLUSTERS as MAX_CLUSTERS,
  HEADER_MAX_SEGMENTS as MAX_SEGMENTS,
  HEADER_OF_PICTURES as OF_PICTURES,
  HEADER_PLACEMENTS as PLACEMENTS,
  HEADER_PREDICTIONS as PREDICTIONS,
  SEGMENTS_TINY as TINY,
  BASIS_MAX_COMPONENTS as MAX_COMPONENTS,
  TRAJECTORIES_PLANES as PLANES,
  HEADER_MAX_FINENESS as MAX_FINENESS,
  VIDEO_MAX_SIDE as MAX_SIDE,
  VIDEO_PROFILES as PROFILES,
} from "../constants.js";
import { GeometryVideoError, corrupt, quote } from "../format/errors.js";
import { checkInteger, checkNumber } from "../format/header.js";
import { readSteps } from "../format/segments.js";

export { VERSION, PLANES };

export const CODEC = "mcgv";

const WEB = "h264-8"; // profile of files without pictures: that of their zero level

/**
 * How planes become pictures, as `gvpipe.media.video.Profile` says.
 *
 * @typedef {object} Profile
 * @property {"h264"|"mjpeg"} codec @property {number} depth bits of a sample
 * @property {number} low @property {number} high levels that carry data; that of a zero is half of all
 *
 * @typedef {object} Header
 * @property {"blended"|"affine"} prediction how the clusters move the slots
 * @property {"halves"|"charts"|"tiles"} placement how the slots get their pixels
 * @property {Profile} profile of the video
 * @property {number} block side of the blocks of the image coder, pixels
 * @property {number} width @property {number} height of one plane, pixels
 * @property {number} clusters K @property {number} segments
 * @property {number[]} origin @property {number} baseStep lattice of the base frame
 * @property {number} transformStep @property {number} residualStep model units, where pictures are frames
 * @property {{fineness: number, components: number[], steps: number[]}|null} images where they are coefficients: levels per step; of each
 *   segment R and the step, model units
 * @property {boolean} outliers whether residuals exceed the pictures' levels
 * @property {boolean} pictures false where frames are their prediction; what tells of pictures is then absent
 *
 * @param {object} header of the payload, of this codec
 * @returns {Header}
 */
export function readHeader(header) {
  const settings = header.settings;
  if ("pictures" in settings) return withoutPictures(header);
  if (!PROFILES.has(settings.profile)) throw corrupt("header", `profile is ${quote(settings.profile)}`);
  const { prediction, placement } = settings;
  if (!PREDICTIONS.includes(prediction)) throw corrupt("header", `prediction is ${quote(prediction)}`);
  if (!PLACEMENTS.includes(placement)) throw corrupt("header", `placement is ${quote(placement)}`);
  const motion = readMotion(header);
  const images = "transform" in settings ? readImages(header, motion.segments, prediction) : null;
  const result = {
    prediction,
    placement,
    profile: PROFILES.get(settings.profile),
    block: checkInteger(settings, "block", 2, 64),
    width: checkInteger(settings, "width", 2, MAX_SIDE),
    height: checkInteger(settings, "height", 2, Math.floor(MAX_SIDE / 3)),
    ...motion,
    transformStep: images ? 1 : checkNumber(settings, "transform_step", TINY, HUGE),
    residualStep: images ? 1 : checkNumber(settings, "residual_step", TINY, HUGE),
    images,
    outliers: "outliers" in settings,
    pictures: true,
  };
  if (result.outliers && (settings.outliers !== true || images)) {
    throw corrupt("header", `outliers is ${quote(settings.outliers)}`);
  }
  if (result.width % result.block || result.height % result.block) {
    throw corrupt("header", `planes of ${result.width}x${result.height} are not whole blocks of ${result.block}`);
  }
  if (placement === "tiles" && prediction !== "blended") throw corrupt("header", `placement is tiles, prediction ${prediction}`);
  if (placement !== "charts" && ![8, 16].includes(result.block)) throw corrupt("header", `blocks of ${result.block} pixels`);
  return result;
}

/** What files with and without pictures tell alike. */
function readMotion(header) {
  const settings = header.settings;
  const base = settings.base;
  if (!Array.isArray(base) || base.length !== 4 || !base.every((v) => Math.abs(v) < HUGE) || !(base[3] > 0)) {
    throw corrupt("header", `base is ${quote(base)}`);
  }
  return {
    clusters: checkInteger(settings, "clusters", 1, MAX_CLUSTERS),
    segments: checkInteger(settings, "segments", 1, Math.min(MAX_SEGMENTS, header.frames)),
    origin: base.slice(0, 3),
    baseStep: base[3],
  };
}

function withoutPictures(header) {
  const settings = header.settings;
  const alien = [...OF_PICTURES, "outliers"].filter((key) => key in settings);
  if (settings.pictures !== false || alien.length || settings.prediction !== "blended") {
    throw corrupt("header", `pictures is ${quote(settings.pictures)} beside ${quote(alien)}`);
  }
  const transformStep = checkNumber(settings, "transform_step", TINY, HUGE);
  const known = { ...readMotion(header), transformStep, profile: PROFILES.get(WEB) };
  return { prediction: "blended", ...known, residualStep: 1, images: null, outliers: false, pictures: false };
}

/** Mirrors `gvcodecs.mcgv.header.TrajectoryHeader`. */
function readImages({ frames, settings }, segments, prediction) {
  const { transform, profile, components } = settings;
  if (transform !== "klt" || prediction !== "blended") {
    throw corrupt("header", `transform is ${quote(transform)}, prediction ${quote(prediction)}`);
  }
  if (PROFILES.get(profile).codec !== "h264") throw corrupt("header", `profile is ${quote(profile)} beside transform`);
  if (!Array.isArray(components) || components.length !== segments) throw corrupt("header", `components is ${quote(components)}`);
  const most = Math.min(MAX_COMPONENTS, 3 * Math.ceil(frames / segments));
  for (const s of components.keys()) checkInteger(components, s, 0, most);
  return { fineness: checkInteger(settings, "fineness", 1, MAX_FINENESS), components, steps: readSteps(settings, segments) };
}

/** Pictures of a segment of R components: one at least. */
export function countPictures(components) {
  return Math.max(1, Math.ceil(components / PLANES));
}

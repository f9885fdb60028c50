/**
 * What the reader knows of a prediction, whichever it is. Mirrors `gvcodecs.mcgv.motion.contract`.
 *
 * @typedef {object} Motion
 * @property {(data: Uint8Array, name: string, frames: number) => object} decode a segment of so many frames: its section, and that one's name
 * @property {(segment: object, place: number, predicted: Float64Array) => void} predict fills in the prediction (S, 3) of the segment's
 *   frame `place`, model units, flat
 * @property {(box: {min: number[], max: number[]}, segment: object, frames: number, looks: number) => void} extend makes a box hold the
 *   prediction of a segment's frames; `looks` are the products of numbers that this may take
 */

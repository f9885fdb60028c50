/**
 * The samples of a video in fragments: what the tables of a plain MP4 file say is in the `moof` boxes, a run in each.
 */

const DEFAULTS = [
  // flags of `tfhd`, and bytes of what they announce
  [0x1, 8], // base_data_offset
  [0x2, 4], // sample_description_index
];
const NOT_A_KEY = 0x10000; // of a sample's flags

/**
 * @param {Uint8Array} file whole, its offsets relative to each `moof`
 * @returns {{sizes: number[], places: number[], times: number[], keys: Set<number>}} bytes, place, time of presentation of each
 *   sample, and the numbers of those that decode alone
 * @throws {RangeError} a box ends too early
 */
export function readFragmentSamples(file) {
  const view = new DataView(file.buffer, file.byteOffset, file.byteLength);
  const samples = { sizes: [], places: [], times: [], keys: new Set() };
  for (const moof of listBoxes(view, 0, file.length)) {
    if (moof.kind !== "moof") continue;
    for (const traf of listBoxes(view, moof.start, moof.end)) {
      if (traf.kind !== "traf") continue;
      const boxes = new Map(listBoxes(view, traf.start, traf.end).map((box) => [box.kind, box.start]));
      addRun(view, moof.start - 8, boxes, samples);
    }
  }
  return samples;
}

function addRun(view, base, boxes, samples) {
  const defaults = readDefaults(view, boxes.get("tfhd"));
  const decoded = boxes.get("tfdt");
  let time = view.getUint8(decoded) ? Number(view.getBigUint64(decoded + 4)) : view.getUint32(decoded + 4);
  let at = boxes.get("trun");
  const [flags, count] = [view.getUint32(at) & 0xffffff, view.getUint32(at + 4)];
  at += 8;
  const next = (flag, otherwise) => (flags & flag ? view.getUint32((at += 4) - 4) : otherwise);
  let place = base + next(0x1, 0);
  let first = next(0x4, undefined);
  if (count > view.byteLength) throw new RangeError("too many pictures");
  for (let i = 0; i < count; i++) {
    const [duration, size, own] = [next(0x100, defaults.duration), next(0x200, defaults.size), next(0x400, defaults.flags)];
    const shift = next(0x800, 0) | 0;
    if (place + size > view.byteLength || !size) throw new RangeError("a picture lies outside of it");
    if (!((first ?? own) & NOT_A_KEY)) samples.keys.add(samples.sizes.length);
    samples.sizes.push(size);
    samples.places.push(place);
    samples.times.push(time + shift);
    place += size;
    time += duration;
    first = undefined;
  }
}

function readDefaults(view, start) {
  const flags = view.getUint32(start) & 0xffffff;
  let at = start + 8;
  for (const [flag, bytes] of DEFAULTS) at += flags & flag ? bytes : 0;
  const next = (flag) => (flags & flag ? view.getUint32((at += 4) - 4) : 0);
  return { duration: next(0x8), size: next(0x10), flags: next(0x20) };
}

/** Boxes one after the other: kind, start and end of their contents. @throws {RangeError} one has an impossible size */
export function listBoxes(view, position, end) {
  const boxes = [];
  while (position + 8 <= end) {
    const size = view.getUint32(position);
    const kind = String.fromCharCode(...[4, 5, 6, 7].map((i) => view.getUint8(position + i)));
    if (size < 8 || position + size > end) throw new RangeError(`box ${kind} has an impossible size`);
    boxes.push({ kind, start: position + 8, end: position + size });
    position += size;
  }
  return boxes;
}

/**
 * JPEG pictures by the browser's own decoder, through a canvas. Mirrors `gvpipe.media.jpeg.decode_jpeg`.
 *
 * JPEG decoders differ by a level in places, and browsers may blur what a canvas gives back. So a picture whose samples are known is
 * decoded first. Where they differ, pictures are refused.
 */

import { crc32 } from "./format/checksum.js";
import { AGAIN, GeometryVideoError } from "./format/errors.js";

const PROBE = [
  "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDABAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBD/",
  "wAALCAAYABgBAREA/8QAFgABAQEAAAAAAAAAAAAAAAAABAEC/8QAHhAAAwADAQADAQAAAAAAAAAAAQIDBBITEQAhIjP/2gAIAQEAAD8AlnsfeaEymZ+RnlI/",
  "9EvqGnSclYNOxnPHR55S3RoitWEGnUquLPosw9a0mFgkyrNjQmGyF0+pRUFph3m/6Zp0mpuXbIqsgWdJDalxWkzQ4bj2JxxYtyLKzsBzIVmHgjRpMsZLk4bo",
  "ElVgWo3qxr4871M3qceiLXXmrl1Wazdp2SYHWXSwfdq5JWBNH9RwzK6VyKS/c0E+TRG3ZVsswHtSR14URTcIWNzqaa07HEd2YMGYtLmIEkqz09DB7JZdO+OV",
  "BavPVLOrV5U7Tus28mOzEs4KsRIdONBjCxo7qN6ULQnDmfhWYgAVurrkIk1UKhANtSnOrUVqFfIs67hKEtZtEpdmeySmtdpX2VaOtETy7PVzISlIFlrCskKM",
  "OJXy/qhiujf/2Q==",
];
const PROBE_SIDE = 24; // pixels
const PROBE_CRC32 = 2570489254; // of its samples, as Python decodes them
const START_OF_IMAGE = 0xffd8;
const END_OF_IMAGE = 0xffd9;
const FRAMES = [0xffc0, 0xffc1]; // markers of sequential frames, Huffman coded
const SCAN = 0xffda;
const AS_STORED = { colorSpaceConversion: "none", premultiplyAlpha: "none" };

let probed = null; // promise of whether this browser's samples are Python's

export class JpegDecoder {
  #size;
  #samples;

  /** @param {[number, number]} size of a picture, pixels @param {Uint32Array} samples indices of a picture's samples */
  constructor(size, samples) {
    this.#size = size;
    this.#samples = samples;
  }

  /**
   * @param {import("./track.js").Sample[]} group
   * @param {(picture: number, levels: Uint8Array) => void} give called for each picture, with the levels of `samples`
   * @throws {GeometryVideoError} this browser's decoder gives other samples, or a picture is damaged
   */
  async decode(group, give) {
    if (!(await (probed ??= isExact()))) {
      throw new GeometryVideoError("unsupported", "this browser does not give the exact samples of JPEG pictures; another one, or gvpipe export-html --convert, is needed");
    }
    for (const { data, picture } of group) {
      checkHeader(data, this.#size);
      const grey = await greyOf(data, this.#size);
      give(picture, Uint8Array.from(this.#samples, (sample) => grey[sample]));
    }
  }

  close() {}
}

/** Whether the browser decodes a picture to the samples that Python has of it. */
async function isExact() {
  if (typeof createImageBitmap !== "function") return false;
  const data = Uint8Array.from(atob(PROBE.join("")), (character) => character.charCodeAt(0));
  const grey = await greyOf(data, [PROBE_SIDE, PROBE_SIDE]).catch(() => new Uint8Array(0));
  return crc32(grey) === PROBE_CRC32;
}

/** Samples of a picture, row by row. @returns {Promise<Uint8Array>} */
async function greyOf(data, [width, height]) {
  const image = await createImageBitmap(new Blob([data], { type: "image/jpeg" }), AS_STORED).catch(() => null);
  if (image?.width !== width || image.height !== height) throw damaged("unreadable");
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const context = canvas.getContext("2d", { willReadFrequently: true, alpha: false });
  context.drawImage(image, 0, 0);
  image.close();
  const { data: colours } = context.getImageData(0, 0, width, height);
  const grey = new Uint8Array(width * height);
  for (let i = 0; i < grey.length; i++) grey[i] = colours[4 * i];
  return grey;
}

/** Throw unless it is a whole greyscale JPEG of a size, before anything is allocated for it. */
function checkHeader(data, [width, height]) {
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const marks = (at) => (at >= 0 && at + 2 <= data.length ? view.getUint16(at) : 0);
  if (marks(0) !== START_OF_IMAGE || marks(data.length - 2) !== END_OF_IMAGE) throw damaged("no whole JPEG");
  for (let at = 2; at + 10 <= data.length && marks(at) >> 8 === 0xff && marks(at) !== SCAN; at += 2 + marks(at + 2)) {
    if (!FRAMES.includes(marks(at))) continue;
    const [bits, rows, columns, components] = [data[at + 4], marks(at + 5), marks(at + 7), data[at + 9]];
    if (bits === 8 && rows === height && columns === width && components === 1) return;
    throw damaged(`a JPEG of ${columns}x${rows} and ${components} components, not a greyscale one of ${width}x${height}`);
  }
  throw damaged("no JPEG that browsers read");
}

function damaged(what) {
  return new GeometryVideoError("corrupt", `a picture of its video is ${what}; ${AGAIN}`);
}

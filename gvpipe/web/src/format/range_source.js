/**
 * Files whose bytes a function gives, of a notebook's kernel for example, asked as web servers are.
 *
 * @typedef {object} RangeSource
 * @property {string} name of the file, for messages
 * @property {(start: number, stop: number, signal: AbortSignal) => Promise<{data: Uint8Array, size: number}>} fetchRange bytes `start` to
 *   `stop` (`Infinity`: all that follow), fewer where the file ends before, and the bytes of the whole file
 */

const PARTIAL = 206;
const UNSATISFIABLE = 416;

/** @param {unknown} source @returns {source is RangeSource} */
export function isRangeSource(source) {
  return typeof source?.fetchRange === "function";
}

/** What a web server would answer that has the file and knows Range. @param {RangeSource} source @param {RequestInit} init @returns {Promise<Response>} */
export async function answer(source, { headers = {}, signal }) {
  const range = /^bytes=(\d+)-(\d*)$/.exec(headers.Range ?? "");
  const [start, stop] = range ? [Number(range[1]), range[2] ? Number(range[2]) + 1 : Infinity] : [0, Infinity];
  const { data, size } = await source.fetchRange(start, stop, signal);
  if (range && start >= size) return new Response(null, { status: UNSATISFIABLE });
  const place = { "Content-Range": `bytes ${start}-${start + data.length - 1}/${size}` };
  return new Response(data, { status: range ? PARTIAL : 200, headers: { "Content-Length": data.length, ...(range ? place : {}) } });
}

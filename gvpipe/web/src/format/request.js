/** Requests to web servers, which end when nothing comes for a while, or when what asked for them is closed. */

import { GeometryVideoError } from "./errors.js";
import { answer, isRangeSource } from "./range_source.js";

/** How long an answer may take: seconds without a byte, seconds in all, and the bytes per second of long ones, which may take longer. */
export const TIMES = { silence: 30, least: 60, rate: 1e4 };

const MOST = 1 << 28; // bytes of an answer, if nobody says how many are asked for

/** From this status on, a server may come back. */
export const OUTAGE = 500;

/** What a promise is rejected with that a closed video leaves open. */
export function closed() {
  return new DOMException("the video was closed", "AbortError");
}

/**
 * @param {string|URL|import("./range_source.js").RangeSource} url a range source may be silent for as long as it likes, as busy kernels are
 * @param {AbortSignal} signal ends it
 * @param {{what?: string, remedy?: string, init?: RequestInit, most?: number}} [options] `what` is asked for, and what helps if it does not
 *   come: for messages; `most` bytes are taken of the answer
 * @returns {Promise<{response: Response, read: () => Promise<Uint8Array|null>, bytes: () => Promise<Uint8Array>, close: () => void,
 *   refused: () => GeometryVideoError}>} `read`: the next bytes, null at the end; `bytes`: all of them; `refused`: an error of this status
 * @throws {GeometryVideoError} kind "load": the connection fails; of `read` and `bytes`, too
 * @throws {unknown} the signal's reason
 */
export async function request(url, signal, { what = nameOf(url), remedy = "try again", init = {}, most = MOST } = {}) {
  const own = new AbortController();
  const follow = () => own.abort(signal.reason);
  const end = () => signal.removeEventListener("abort", follow);
  signal.throwIfAborted();
  signal.addEventListener("abort", follow);

  let waited = 0; // ms, in all
  let taken = 0; // bytes of the body
  const isPatient = isRangeSource(url);
  async function watched(promise) {
    const begun = performance.now();
    const left = 1000 * (TIMES.least + taken / TIMES.rate) - waited;
    const silent = 1000 * TIMES.silence <= left;
    const why = silent ? `nothing came for ${TIMES.silence} s` : `it comes too slowly`;
    const limit = Math.max(0, Math.min(1000 * TIMES.silence, left));
    const timer = isPatient ? 0 : setTimeout(() => own.abort(new Error(why)), limit);
    try {
      const result = await promise;
      waited += performance.now() - begun;
      return result;
    } catch (error) {
      end();
      signal.throwIfAborted();
      throw new GeometryVideoError("load", `${what} cannot be fetched: ${error.message || error.name}; ${remedy}`);
    } finally {
      clearTimeout(timer);
    }
  }

  const asked = { ...init, signal: own.signal };
  const response = await watched(isPatient ? answer(url, asked) : fetch(url, asked));
  let body = null;
  async function read() {
    body ??= response.body?.getReader();
    const { done, value } = body ? await watched(body.read()) : { done: true };
    if (done) end();
    else if ((taken += value.length) > most) {
      close();
      throw new GeometryVideoError("load", `${what} has more than ${most} bytes, which is all that a page takes of it; open it in Python`);
    }
    return done ? null : value;
  }
  async function bytes() {
    const length = Number(response.headers.get("Content-Length"));
    const room = new Uint8Array(length <= most ? length : 0);
    const parts = []; // behind the room
    let filled = 0;
    for (let part = await read(); part; part = await read()) {
      if (!parts.length && filled + part.length <= room.length) {
        room.set(part, filled);
        filled += part.length;
      } else {
        parts.push(part);
      }
    }
    const data = room.subarray(0, filled);
    return parts.length ? joined([data, ...parts]) : data;
  }
  function close() {
    end();
    own.abort(closed());
  }
  function refused() {
    close();
    const error = new GeometryVideoError("load", `${what} cannot be fetched: status ${response.status}${response.status < OUTAGE ? "" : `; ${remedy}`}`);
    return Object.assign(error, { status: response.status });
  }
  return { response, read, bytes, close, refused };
}

/** What messages call a file. @param {string|URL|import("./range_source.js").RangeSource} source */
export function nameOf(source) {
  return isRangeSource(source) ? source.name : String(source);
}

/** Bytes one after the other. @param {Uint8Array[]} parts @returns {Uint8Array} */
export function joined(parts) {
  const data = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let end = 0;
  for (const part of parts) {
    data.set(part, end);
    end += part.length;
  }
  return data;
}

/** zlib streams to bytes by the browser's own inflater, with a limit on what may come out. */

const TOGETHER = 1 << 16; // bytes that go in at once, so that little comes out before the limit is looked at

/**
 * @param {Uint8Array} data a whole zlib stream
 * @param {number} limit most bytes that it may inflate to
 * @param {(what: string) => Error} corrupt makes the error to throw
 * @returns {Promise<Uint8Array>}
 */
export function inflate(data, limit, corrupt) {
  return inflated(data, "deflate", limit, corrupt);
}

/**
 * The same of a stream without head and checksum, which was deflated with a dictionary. Browsers take none: the dictionary goes in
 * as a stored block before it, and comes out again.
 *
 * @param {Uint8Array} dictionary of at most 65535 bytes
 */
export async function inflateRaw(data, dictionary, limit, corrupt) {
  const { length } = dictionary;
  const stored = Uint8Array.of(0, length & 255, length >> 8, ~length & 255, (~length >> 8) & 255, ...dictionary);
  const whole = new Uint8Array(stored.length + data.length);
  whole.set(stored);
  whole.set(data, stored.length);
  return (await inflated(whole, "deflate-raw", limit + length, corrupt)).subarray(length);
}

async function inflated(data, format, limit, corrupt) {
  const reader = streamOf(data).pipeThrough(new DecompressionStream(format)).getReader();
  const parts = [];
  let size = 0;
  try {
    for (let part = await reader.read(); !part.done; part = await reader.read()) {
      size += part.value.length;
      if (size > limit) break;
      parts.push(part.value);
    }
  } catch {
    throw corrupt("it does not inflate");
  }
  if (size > limit) {
    await reader.cancel();
    throw corrupt(`it inflates to more than ${limit} bytes`);
  }
  const result = new Uint8Array(size);
  let position = 0;
  for (const part of parts) {
    result.set(part, position);
    position += part.length;
  }
  return result;
}

/** Bytes as a stream. A `Blob` has one, too, but not in a worker of WebKit whose page comes from a disk. */
function streamOf(data) {
  let position = 0;
  return new ReadableStream({
    pull(controller) {
      if (position < data.length) controller.enqueue(data.subarray(position, (position += TOGETHER)));
      else controller.close();
    },
  });
}

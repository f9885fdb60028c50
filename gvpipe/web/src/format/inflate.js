/** zlib streams to bytes by the browser's own inflater, with a limit on what may come out. */

/**
 * @param {Uint8Array} data a whole zlib stream
 * @param {number} limit most bytes that it may inflate to
 * @param {(what: string) => Error} corrupt makes the error to throw
 * @returns {Promise<Uint8Array>}
 */
export async function inflate(data, limit, corrupt) {
  const { readable, writable } = new DecompressionStream("deflate"); // without a Blob: workers of pages from a disk may read none
  const writer = writable.getWriter();
  for (const written of [writer.write(data), writer.close()]) written.catch(() => {}); // told by the reader
  const reader = readable.getReader();
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

/** How fast a video may play. */

export const SLOWEST = 0.0625; // what browsers play
export const FASTEST = 16;

/** A rate that browsers play. @returns {number} @throws {DOMException} it is another one */
export function checkRate(rate) {
  const number = Number(rate);
  if (number >= SLOWEST && number <= FASTEST) return number;
  throw new DOMException(`playbackRate is ${rate}; ${SLOWEST} to ${FASTEST} are possible`, "NotSupportedError");
}

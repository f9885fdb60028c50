/** From what browsers give of a picture to the levels that its file holds, 16..235. */

const LOW = 16;
const HIGH = 235;
const ROUNDING = 0.57; // libyuv's, in Chromium and Firefox: 0.56; WebKitGTK is off by up to 1.4

/**
 * Of a grey 0..255 that a browser made of luma in limited range. Steps are 1.16 apart and browsers round by at most 0.57, so a
 * table undoes it exactly. 0: so far from every level that this browser converts colours in a way of its own.
 */
export const OF_GREY = Uint8Array.from({ length: 256 }, (_, grey) => {
  const level = LOW + Math.round((grey * (HIGH - LOW)) / 255);
  return Math.abs(grey - ((level - LOW) * 255) / (HIGH - LOW)) <= ROUNDING ? level : 0;
});

/**
 * Of luma itself: coarse quantisers overshoot, and every reader clips.
 *
 * @param {{depth: number, low: number, high: number}} profile @returns {Uint16Array}
 */
export function ofLuma({ depth, low, high }) {
  return Uint16Array.from({ length: 2 ** depth }, (_, luma) => Math.min(high, Math.max(low, luma)));
}

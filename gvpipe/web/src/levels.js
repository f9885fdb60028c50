/** From what browsers give of a picture to the levels that its file holds, 16..235. */

const LOW = 16;
const HIGH = 235;

/** Of a grey 0..255 that a browser made of luma in limited range: steps are 1.16 apart, so a table undoes it exactly. */
export const OF_GREY = Uint8Array.from({ length: 256 }, (_, grey) => LOW + Math.round((grey * (HIGH - LOW)) / 255));

/** Of luma itself: coarse quantisers overshoot, and every reader clips. */
export const OF_LUMA = Uint8Array.from({ length: 256 }, (_, luma) => Math.min(HIGH, Math.max(LOW, luma)));

/** Frequency tables of integers by two numbers. Mirrors `gvpipe.entropy.parametric_tables`; `docs/format.md`, section 6. */

import {
  PARAMETRIC_TABLES_N_TOKENS as N_TOKENS,
  PARAMETRIC_TABLES_RATIOS as RATIOS,
  PARAMETRIC_TABLES_RATIO_BITS as RATIO_BITS,
  PARAMETRIC_TABLES_TOTAL as TOTAL,
  PARAMETRIC_TABLES_ZEROS as ZEROS,
  TOKENS_DIRECT as DIRECT,
} from "../constants.js";

export const N_RATIOS = RATIOS.length;

const shapes = []; // of the ratios used so far

/** @param {number} zero 0..255 @param {number} ratio its index @returns {number[]} a frequency for each token */
export function magnitudeTable(zero, ratio) {
  shapes[ratio] ??= shape(RATIOS[ratio]);
  const frequencies = shapes[ratio].map((frequency) => Math.max(1, Math.floor((frequency * (ZEROS - zero)) / ZEROS)));
  frequencies[0] = Math.max(1, Math.floor((TOTAL * zero) / ZEROS));
  return frequencies;
}

/** Frequencies of the tokens of nonzero values; token 0's is 0. */
function shape(thin) {
  const thick = 4096 - Math.floor((4096 - thin) / 3);
  const frequencies = [0];
  for (let token = 1; token < N_TOKENS; token++) {
    const [low, high] = bounds(token);
    const mass = 7 * (tail(thin, low) - tail(thin, high)) + tail(thick, low) - tail(thick, high);
    frequencies.push(Math.floor(mass / 16)); // eighths, and half for each sign
  }
  return frequencies;
}

/** Twice the magnitudes that a token begins and ends at, both signs counted. */
function bounds(token) {
  if (token < DIRECT) return [token + 1, token + 2];
  const width = 1 << (((token - DIRECT) >> 1) + 3);
  const low = (2 + ((token - DIRECT) & 1)) * width;
  return [low + 1, low + width + 1];
}

/** Probability, in 1 / TOTAL, that a nonzero magnitude is at least `twice / 2`; half way between for odd values. */
function tail(ratio, twice) {
  return power(ratio, Math.max(0, (twice >> 1) - 1)) + power(ratio, Math.max(0, ((twice + 1) >> 1) - 1));
}

/** TOTAL times a power of `ratio / 4096`, rounded down. */
function power(ratio, exponent) {
  if (exponent * ((1 << RATIO_BITS) - ratio) >= 14 << RATIO_BITS) return 0; // below 1 / TOTAL
  return Number((BigInt(ratio) ** BigInt(exponent) * BigInt(TOTAL)) >> BigInt(RATIO_BITS * exponent));
}

/** Tables of the logistic function, in integers. Mirrors `gvpipe.entropy.logistic_tables`. */

import { LOGISTIC_TABLES_LIMIT as LIMIT, LOGISTIC_TABLES_SPACING as SPACING } from "../constants.js";

const BITS = 160n; // of fractions
const ONE = 1n << BITS;
const TERMS = 24n; // of the exponential series: 16^-24 / 24! lies far below 2^-160

/** (2 LIMIT + 1) probabilities, 1 / 65536, of logits -LIMIT..LIMIT. */
export const SQUASH = squashTable();

/** (4096) logits of probabilities 16 i + 8. */
export const STRETCH = stretchTable();

function squashTable() {
  const exact = [0]; // 2^24 times the probability, rounded down, from logit 0 + SPACING downwards
  const ratio = exponential();
  for (let power = ONE, logit = 0; logit <= LIMIT + 1; logit += SPACING) {
    exact.push(Number((1n << 24n) * ONE / (ONE + power)));
    power = (power * ratio) >> BITS;
  }
  exact.reverse();
  const lower = Array.from({ length: LIMIT + 1 }, (_, i) => {
    const place = Math.floor((i + 1) / SPACING);
    const part = (i + 1) % SPACING;
    const below = Math.floor((exact[place] * (SPACING - part) + exact[place + 1] * part) / SPACING);
    return Math.max(1, (below + 128) >> 8);
  });
  return Int32Array.from([...lower, ...lower.slice(0, -1).reverse().map((chance) => 65536 - chance)]);
}

/** exp(SPACING / 256), in 2^-BITS. */
function exponential() {
  let [sum, term] = [ONE, ONE];
  for (let n = 1n; n <= TERMS; n++) {
    term = (term * BigInt(SPACING)) / (256n * n);
    sum += term;
  }
  return sum;
}

function stretchTable() {
  let logit = 0;
  return Int32Array.from({ length: 4096 }, (_, i) => {
    while (SQUASH[logit] < 16 * i + 8) logit++;
    return logit - LIMIT;
  });
}

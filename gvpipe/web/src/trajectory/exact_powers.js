/** Powers of two with fractional exponents, rounded down, exactly: what integer logarithms compare with. */

const FRACTIONS = 16; // of an octave
const OCTAVES = 62;

/** @returns {bigint[]} 2 ** (i / 16) rounded down, i below 16 * 62 */
export function powersOfTwo() {
  const top = Array.from({ length: FRACTIONS }, (_, i) => {
    let root = 1n << BigInt(FRACTIONS * OCTAVES + i);
    for (let half = FRACTIONS; half > 1; half /= 2) root = squareRoot(root);
    return root; // of the last octave: earlier ones are its halves
  });
  const halvings = (i) => BigInt(OCTAVES - Math.floor(i / FRACTIONS));
  return Array.from({ length: FRACTIONS * OCTAVES }, (_, i) => top[i % FRACTIONS] >> halvings(i));
}

/** Rounded down; Newton's method from above. */
function squareRoot(n) {
  let root = 1n << BigInt((n.toString(16).length + 1) * 2);
  for (;;) {
    const next = (root + n / root) >> 1n;
    if (next >= root) return root;
    root = next;
  }
}

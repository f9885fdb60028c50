/** SHA-256 (FIPS 180-4). The browser's own is not there on pages of plain http. */

const ROUNDS = 64;
const BLOCK = 64; // bytes

/** The first 32 bits of the fractional parts of roots of the first primes. */
function fractions(count, root) {
  const found = [];
  for (let n = 2; found.length < count; n++) {
    let isPrime = true;
    for (let d = 2; d * d <= n && isPrime; d++) isPrime = n % d !== 0;
    if (isPrime) found.push(Math.floor((root(n) % 1) * 2 ** 32));
  }
  return Int32Array.from(found, (value) => value | 0);
}

const CONSTANTS = fractions(ROUNDS, Math.cbrt);
const START = fractions(8, Math.sqrt);

const turned = (word, by) => (word >>> by) | (word << (32 - by));

/** @param {Uint8Array} data @returns {string} 64 hexadecimal digits */
export function sha256(data) {
  const whole = data.length - (data.length % BLOCK);
  const tail = new Uint8Array(data.length % BLOCK < BLOCK - 8 ? BLOCK : 2 * BLOCK);
  tail.set(data.subarray(whole));
  tail[data.length - whole] = 128;
  const length = new DataView(tail.buffer, tail.length - 8);
  length.setUint32(0, Math.floor(data.length / 2 ** 29));
  length.setUint32(4, data.length * 8);
  const state = Int32Array.from(START);
  const words = new Int32Array(ROUNDS);
  for (const part of [data.subarray(0, whole), tail]) {
    const view = new DataView(part.buffer, part.byteOffset, part.length);
    for (let at = 0; at < part.length; at += BLOCK) mix(state, words, view, at);
  }
  return [...Uint32Array.from(state)].map((word) => word.toString(16).padStart(8, "0")).join("");
}

/** One block into the state. */
function mix(state, words, view, at) {
  for (let i = 0; i < 16; i++) words[i] = view.getUint32(at + 4 * i);
  for (let i = 16; i < ROUNDS; i++) {
    const a = words[i - 15];
    const b = words[i - 2];
    const low = turned(a, 7) ^ turned(a, 18) ^ (a >>> 3);
    const high = turned(b, 17) ^ turned(b, 19) ^ (b >>> 10);
    words[i] = words[i - 16] + low + words[i - 7] + high;
  }
  let [a, b, c, d, e, f, g, h] = state;
  for (let i = 0; i < ROUNDS; i++) {
    const first = (h + (turned(e, 6) ^ turned(e, 11) ^ turned(e, 25)) + ((e & f) ^ (~e & g)) + CONSTANTS[i] + words[i]) | 0;
    const second = ((turned(a, 2) ^ turned(a, 13) ^ turned(a, 22)) + ((a & b) ^ (a & c) ^ (b & c))) | 0;
    h = g;
    g = f;
    f = e;
    e = (d + first) | 0;
    d = c;
    c = b;
    b = a;
    a = (first + second) | 0;
  }
  [a, b, c, d, e, f, g, h].forEach((value, i) => (state[i] += value));
}

/** Values of a field in arrays of their type. Mirrors `gvpipe.fields.values`. */

const ARRAYS = {
  float32: Float32Array,
  int8: Int8Array,
  uint8: Uint8Array,
  int16: Int16Array,
  uint16: Uint16Array,
  int32: Int32Array,
  uint32: Uint32Array,
};
const TO_WHOLE = 1.5 * 2 ** 52; // a sum with it has no fraction

/** @param {string} type @param {number} count @returns {Float32Array|Int32Array} of zeros */
export function newValues(type, count) {
  return new ARRAYS[type](count);
}

/** The bytes of `count` values. */
export function bytesOf(type, count) {
  return count * ARRAYS[type].BYTES_PER_ELEMENT;
}

/** The values that bytes hold, of any place in memory. */
export function valuesOf(type, bytes) {
  return new ARRAYS[type](bytes.slice().buffer);
}

/**
 * @param {string} type @param {boolean} isExact whether integers must fit as they are
 * @returns {(number: number) => number} a number as a value of the type: rounded, integers cut to their range; NaN if it has none
 */
export function rounding(type, isExact) {
  if (type === "float32") return (number) => (Number.isFinite(Math.fround(number)) ? number : NaN);
  const bits = 8 * ARRAYS[type].BYTES_PER_ELEMENT;
  const isSigned = type[0] === "i";
  const least = isSigned ? -(2 ** (bits - 1)) : 0;
  const most = least + 2 ** bits - 1;
  return (number) => {
    if (!Number.isFinite(number) || (isExact && !(number >= least && number <= most))) return NaN;
    return Math.min(Math.max(number, least), most) + TO_WHOLE - TO_WHOLE; // halves to even
  };
}

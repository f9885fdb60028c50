/**
 * Python's compiled kernels, as WebAssembly: `tools/build_wasm.py` makes `kernels.wasm` and `signatures.js` of them.
 *
 *     const kernels = await Kernels.open(bytes);
 *     const faces = kernels.array("int32", [2, 3], [0, 1, 2, 0, 2, 3]);
 *     const [order, waves] = kernels.call("decimate", faces, 4, 64); // arrays again
 *     kernels.view(order); // Int32Array
 *
 * A call follows numba: `(result, error, arguments...) -> status`. An array is its memory's owner, its owner's object, items, bytes of an
 * item, data, shape and strides. Pointers have 32 bits, other integers 64.
 */

import { SIGNATURES } from "./signatures.js";

const TYPES = {
  bool: Uint8Array,
  uint8: Uint8Array,
  int32: Int32Array,
  int64: BigInt64Array,
  float64: Float64Array,
};
const DONE = [0, -2]; // statuses of calls that went well: with a result, and without one
const PAGE = 65536;
const HEADER = 64; // bytes before the data of what kernels allocate
const SMALL = 1 << 20; // bytes; below, sizes are powers of two
const ALIGNMENT = 64;

/** An array in the memory of kernels: C order. @typedef {{type: string, shape: number[], pointer: number}} KernelArray */

/** Kernels with a memory of their own, which is freed as a whole: with this object. */
export class Kernels {
  /** @param {Uint8Array} bytes of `kernels.wasm` @returns {Promise<Kernels>} */
  static async open(bytes) {
    const kernels = new Kernels();
    const { instance } = await WebAssembly.instantiate(bytes, { env: kernels.#imports() });
    kernels.#exports = instance.exports;
    kernels.#end = align(instance.exports.__heap_base.value);
    return kernels;
  }

  #exports;
  #end; // of what was ever allocated
  #free = new Map(); // bytes -> pointers of blocks of that size

  /**
   * An array of `values`, or of zeros.
   *
   * @param {string} type @param {number[]} shape @param {ArrayLike<number|bigint>|null} [values] in C order
   * @returns {KernelArray}
   */
  array(type, shape, values = null) {
    const count = shape.reduce((a, b) => a * b, 1);
    const pointer = this.#allocate(count * TYPES[type].BYTES_PER_ELEMENT);
    const array = { type, shape, pointer };
    if (values) this.view(array).set(values);
    else this.view(array).fill(type === "int64" ? 0n : 0);
    return array;
  }

  /** What an array holds now. It is of no use once anything more is allocated: a memory that grows moves. */
  view({ type, shape, pointer }) {
    return new TYPES[type](this.#exports.memory.buffer, pointer, shape.reduce((a, b) => a * b, 1));
  }

  /** The 32-bit halves of an array of int64, the lower ones first: of what lies below 2^53, faster than `view`. */
  words({ shape, pointer }) {
    return new Int32Array(this.#exports.memory.buffer, pointer, shape.reduce((a, b) => a * b, 2));
  }

  /** Give the memory of an array that `array` made back. */
  free({ type, shape, pointer }) {
    this.#release(pointer, shape.reduce((a, b) => a * b, TYPES[type].BYTES_PER_ELEMENT));
  }

  /**
   * @param {string} name of a kernel @param {...(KernelArray|number|boolean)} given its arguments, NamedTuples unpacked
   * @returns {(KernelArray|number)[]} its result, unpacked
   * @throws {WebAssembly.RuntimeError} it raised an error
   */
  call(name, ...given) {
    const signature = SIGNATURES[name];
    if (given.length !== signature.given.length) throw new TypeError(`${name} takes ${signature.given.length} arguments`);
    const unpacked = given.flatMap((value, i) => (value.shape ? unpackArray(value, signature.given[i]) : [unpackScalar(value, signature.given[i])]));
    const result = this.#allocate(8 * ALIGNMENT);
    const status = this.#exports[name](result, result + 7 * ALIGNMENT, ...unpacked);
    if (!DONE.includes(status)) throw new WebAssembly.RuntimeError(`kernel ${name} fails with status ${status}`);
    return this.#results(signature.returned, result);
  }

  #results(types, result) {
    const memory = new DataView(this.#exports.memory.buffer);
    let at = result;
    return types.map((type) => {
      const [element, dimensions] = type.split(/[[\]]/);
      if (dimensions === undefined) return element === "bool" ? memory.getUint8(at) : Number(memory.getBigInt64(at, true));
      const shape = Array.from({ length: Number(dimensions) }, (_, i) => Number(memory.getBigInt64(at + 32 + 8 * i, true)));
      const array = { type: element, shape, pointer: memory.getUint32(at + 24, true) };
      at += 32 + 16 * shape.length;
      return array;
    });
  }

  /** What numba's code asks of its surroundings. */
  #imports() {
    return {
      NRT_MemInfo_alloc_aligned: (bytes) => {
        const block = this.#allocate(Number(bytes) + HEADER);
        const memory = new DataView(this.#exports.memory.buffer, block, HEADER);
        memory.setBigInt64(0, 1n, true); // references
        memory.setUint32(16, block + HEADER, true); // where the data are
        memory.setBigInt64(24, bytes, true);
        return block;
      },
      NRT_MemInfo_call_dtor: (block) => {
        const bytes = Number(new DataView(this.#exports.memory.buffer).getBigInt64(block + 24, true));
        this.#release(block, bytes + HEADER);
      },
      __multi3: (result, a, _, b) => {
        const product = BigInt.asIntN(64, a) * BigInt.asIntN(64, b); // sizes of arrays: 64 bits each, sign-extended
        const memory = new DataView(this.#exports.memory.buffer, result, 16);
        memory.setBigInt64(0, BigInt.asIntN(64, product), true);
        memory.setBigInt64(8, BigInt.asIntN(64, product >> 64n), true);
      },
    };
  }

  /** @throws {RangeError} there is no more memory */
  #allocate(bytes) {
    const size = blockSize(bytes);
    const free = this.#free.get(size);
    if (free?.length) return free.pop();
    const pointer = this.#end;
    const { memory } = this.#exports;
    const missing = pointer + size - memory.buffer.byteLength;
    if (missing > 0) memory.grow(Math.ceil(missing / PAGE));
    this.#end += size;
    return pointer;
  }

  #release(pointer, bytes) {
    const size = blockSize(bytes);
    if (!this.#free.has(size)) this.#free.set(size, []);
    this.#free.get(size).push(pointer);
  }
}

/** Bytes that a block takes: few different numbers, so that what is freed is used again. */
function blockSize(bytes) {
  if (bytes >= SMALL) return Math.ceil(bytes / SMALL) * SMALL;
  let size = ALIGNMENT;
  while (size < bytes) size *= 2;
  return size;
}

function align(pointer) {
  return Math.ceil(pointer / ALIGNMENT) * ALIGNMENT;
}

function unpackArray({ type, shape, pointer }, expected) {
  if (expected !== `${type}[${shape.length}]`) throw new TypeError(`an array is ${type}[${shape.length}], not ${expected}`);
  const bytes = TYPES[type].BYTES_PER_ELEMENT;
  const strides = shape.map((_, axis) => shape.slice(axis + 1).reduce((a, b) => a * b, bytes));
  const count = shape.reduce((a, b) => a * b, 1);
  return [0, 0, BigInt(count), BigInt(bytes), pointer, ...shape.map(BigInt), ...strides.map(BigInt)];
}

function unpackScalar(value, expected) {
  return expected === "int64" ? BigInt(value) : Number(value);
}

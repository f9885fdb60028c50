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

import { GeometryVideoError } from "../format/errors.js";
import { SIGNATURES } from "./signatures.js";

const TYPES = {
  bool: Uint8Array,
  uint8: Uint8Array,
  int32: Int32Array,
  uint32: Uint32Array,
  int64: BigInt64Array,
  uint64: BigUint64Array,
  float32: Float32Array,
  float64: Float64Array,
};
const DONE = [0, -2]; // statuses of calls that went well: with a result, and without one
const PAGE = 65536;
const HEADER = 64; // bytes before the data of what kernels allocate
const SMALL = 1 << 20; // bytes; below, sizes are powers of two
const ALIGNMENT = 64;
const WAITS = [250, 500, 1000, 2000, 4000]; // ms, until memory is asked for again: a busy browser gives it back late
const RESULT = 1024; // bytes; a tuple of ten arrays takes fewer

const modules = new WeakMap(); // bytes -> promise of what they compile to: instances share machine code

/**
 * An array in the memory of kernels: C order. What a call returned has an owner, 0 if that is one of its arguments.
 * @typedef {{type: string, shape: number[], pointer: number, owner?: number}} KernelArray
 */

/** By the page, most likely: the code is the same for all. */
function refused(error) {
  const remedy = "let script-src of its Content-Security-Policy have 'wasm-unsafe-eval'";
  return new GeometryVideoError("unsupported", `this page runs no WebAssembly (${error.message}); ${remedy}`);
}

/** Kernels with a memory of their own, which is freed as a whole: with this object. */
export class Kernels {
  /** @param {Uint8Array} bytes of `kernels.wasm` @returns {Promise<Kernels>} @throws {RangeError} there is no memory for more */
  static async open(bytes) {
    if (!modules.has(bytes)) modules.set(bytes, WebAssembly.compile(bytes).catch((error) => Promise.reject(refused(error))));
    const module = await modules.get(bytes);
    for (const wait of WAITS) {
      try {
        return new Kernels(module);
      } catch (error) {
        if (!(error instanceof RangeError)) throw error;
      }
      await new Promise((resolve) => setTimeout(resolve, wait)); // memories of workers that ended are given back some time later
    }
    return new Kernels(module);
  }

  #module;

  #exports;
  #end; // of what was ever allocated
  #result; // where results are written
  #free = new Map(); // bytes -> pointers of blocks of that size

  /** @param {WebAssembly.Module} module */
  constructor(module) {
    this.#module = module;
    this.#exports = new WebAssembly.Instance(module, { env: this.#imports() }).exports;
    this.#end = align(this.#exports.__heap_base.value);
  }

  /** The same kernels with another memory. */
  fresh() {
    return new Kernels(this.#module);
  }

  /**
   * An array of `values`, or of zeros.
   *
   * @param {string} type @param {number[]} shape @param {ArrayLike<number|bigint>|null} [values] in C order
   * @returns {KernelArray}
   */
  array(type, shape, values = null) {
    const count = shape.reduce((a, b) => a * b, 1);
    const used = this.#end; // what lies behind is zero, and costs nothing until it is written
    const pointer = this.#allocate(count * TYPES[type].BYTES_PER_ELEMENT);
    const array = { type, shape, pointer };
    if (values) this.view(array).set(values);
    else if (pointer < used) new Uint8Array(this.#exports.memory.buffer, pointer, count * TYPES[type].BYTES_PER_ELEMENT).fill(0);
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

  /** An array of int64 of `values` of 32 bits, with a sign. */
  whole(values, shape = [values.length]) {
    const array = this.array("int64", shape);
    const words = this.words(array);
    for (let i = 0; i < values.length; i++) {
      words[2 * i] = values[i];
      if (values[i] < 0) words[2 * i + 1] = -1;
    }
    return array;
  }

  /** Mirror of `whole`, of values whose doubles are exact. @returns {Float64Array} */
  numbers(array) {
    const words = this.words(array);
    return Float64Array.from({ length: words.length / 2 }, (_, i) => words[2 * i + 1] * 2 ** 32 + (words[2 * i] >>> 0));
  }

  /** Give the memory of arrays back, those that calls returned among them. @param {...(KernelArray|number|boolean)} given */
  free(...given) {
    for (const { type, shape, pointer, owner } of given) {
      if (owner > 0) this.#release(owner, this.#sizeOf(owner));
      else if (owner === undefined && shape) this.#release(pointer, shape.reduce((a, b) => a * b, TYPES[type].BYTES_PER_ELEMENT));
    }
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
    const result = (this.#result ??= this.#allocate(2 * RESULT));
    const status = this.#exports[name](result, result + RESULT, ...unpacked); // the error's place is not read
    if (!DONE.includes(status)) throw new WebAssembly.RuntimeError(`kernel ${name} fails with status ${status}`);
    return this.#results(signature.returned, result);
  }

  #results(types, result) {
    const memory = new DataView(this.#exports.memory.buffer);
    let at = result;
    return types.map((type) => {
      const [element, dimensions] = type.split(/[[\]]/);
      if (dimensions === undefined) {
        const value = element === "bool" ? memory.getUint8(at) : Number(memory.getBigInt64(at, true));
        at += 8; // what follows is aligned
        return value;
      }
      const shape = Array.from({ length: Number(dimensions) }, (_, i) => Number(memory.getBigInt64(at + 32 + 8 * i, true)));
      const array = { type: element, shape, pointer: memory.getUint32(at + 24, true), owner: memory.getUint32(at, true) };
      at += 32 + 16 * shape.length;
      return array;
    });
  }

  /** What numba's code asks of its surroundings. */
  #imports() {
    return {
      NRT_MemInfo_alloc_aligned: (bytes) => this.#own(bytes),
      NRT_MemInfo_new_varsize_dtor: (bytes) => this.#own(bytes), // a list, of plain numbers: they need no destructor
      NRT_MemInfo_call_dtor: (block) => {
        this.#release(block, this.#sizeOf(block));
      },
      numba_attempt_nocopy_reshape: (_, __, ___, dimensions, shape, strides, itemBytes) => {
        const memory = new DataView(this.#exports.memory.buffer);
        for (let axis = Number(dimensions) - 1, bytes = itemBytes; axis >= 0; axis--) {
          memory.setBigInt64(strides + 8 * axis, bytes, true); // arrays are in C order
          bytes *= memory.getBigInt64(shape + 8 * axis, true);
        }
        return 1;
      },
      pow: Math.pow,
      __multi3: (result, a, _, b) => {
        const product = BigInt.asIntN(64, a) * BigInt.asIntN(64, b); // sizes of arrays: 64 bits each, sign-extended
        const memory = new DataView(this.#exports.memory.buffer, result, 16);
        memory.setBigInt64(0, BigInt.asIntN(64, product), true);
        memory.setBigInt64(8, BigInt.asIntN(64, product >> 64n), true);
      },
    };
  }

  /** What numba counts references of: a header, and `bytes` of data. */
  #own(bytes) {
    const block = this.#allocate(Number(bytes) + HEADER);
    const memory = new DataView(this.#exports.memory.buffer, block, HEADER);
    memory.setBigInt64(0, 1n, true); // references
    memory.setUint32(16, block + HEADER, true); // where the data are
    memory.setBigInt64(24, bytes, true);
    return block;
  }

  /** Bytes of a block that a kernel allocated. */
  #sizeOf(block) {
    return Number(new DataView(this.#exports.memory.buffer).getBigInt64(block + 24, true)) + HEADER;
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

/**
 * Bounds-checked reading of small binary sections: little-endian fields and varints (LEB128: seven bits a byte, least
 * significant group first, top bit set on all bytes but the last). Mirrors `gvpipe.container.cursor`.
 */

import { corrupt } from "./errors.js";

const MAX_VARINT_BYTES = 7; // 49 bits: all that the format's limits need, and exact in a double

export class Cursor {
  /** @param {Uint8Array} data one section. @param {string} name of the section, for messages. */
  constructor(data, name) {
    this.data = data;
    this.name = name;
    this.position = 0;
    this.view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  }

  get left() {
    return this.data.length - this.position;
  }

  /** The next `count` bytes, not copied. */
  take(count) {
    if (!(count <= this.left)) throw this.corrupt(`needs ${count} more bytes where ${this.left} are left`);
    this.position += count;
    return this.data.subarray(this.position - count, this.position);
  }

  rest() {
    return this.take(this.left);
  }

  u8() {
    return this.take(1)[0];
  }

  u16() {
    this.take(2);
    return this.view.getUint16(this.position - 2, true);
  }

  u32() {
    this.take(4);
    return this.view.getUint32(this.position - 4, true);
  }

  u64() {
    const low = this.u32();
    return this.u32() * 2 ** 32 + low;
  }

  f64() {
    this.take(8);
    return this.view.getFloat64(this.position - 8, true);
  }

  /** The next `count` 32-bit words, copied: sections are not aligned. Browsers run on little-endian machines alone. */
  words(count) {
    return new Uint32Array(this.take(4 * count).slice().buffer);
  }

  /** A varint that must not exceed `limit`; `what` names it in the message. */
  varint(limit, what) {
    let value = 0;
    for (let k = 0; k < MAX_VARINT_BYTES; k++) {
      const byte = this.u8();
      value += (byte & 127) * 2 ** (7 * k);
      if (byte < 128) {
        if (value > limit) throw this.corrupt(`${what} is ${value}, above its limit of ${limit}`);
        return value;
      }
    }
    throw this.corrupt(`${what} is longer than ${MAX_VARINT_BYTES} bytes`);
  }

  /** The bytes of a block: its length as a varint comes before it. */
  block() {
    return this.take(this.varint(this.left, "the length of a block"));
  }

  end() {
    if (this.left) throw this.corrupt(`${this.left} bytes are left over`);
  }

  corrupt(what) {
    return corrupt(this.name, what);
  }
}

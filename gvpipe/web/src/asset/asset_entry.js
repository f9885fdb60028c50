/** An object of section `asset`: members read by name and checked, with a default for those that may be left out. */

import { corrupt, quote } from "../format/errors.js";

/** Control characters, lone surrogates, separators of lines, and marks that turn the direction of writing round. */
const UNSHOWN = /[\p{Cc}\p{Cs}\p{Zl}\p{Zp}\u202a-\u202e\u2066-\u2069]/u;

export class AssetEntry {
  /** @param {object} given JSON value @param {string} where for messages */
  constructor(given, where) {
    this.where = where;
    if (typeof given !== "object" || given === null || Array.isArray(given)) throw this.#wrong("it", given);
    this.given = given;
  }

  /** A text that can be shown (`gvpipe.foundation.text`). Without a default the member is needed; so below. */
  text(name, otherwise) {
    return this.#read(name, otherwise, (value) => typeof value === "string" && value.length < 65536 && !UNSHOWN.test(value));
  }

  word(name, words, otherwise) {
    return this.#read(name, otherwise, (value) => words.includes(value));
  }

  words(name, count, words, otherwise) {
    return this.#read(name, otherwise, (value) => isList(value, count, (item) => words.includes(item)));
  }

  flag(name, otherwise) {
    return this.#read(name, otherwise, (value) => typeof value === "boolean");
  }

  number(name, otherwise, low, high) {
    return this.#read(name, otherwise, (value) => isNumber(value, low, high));
  }

  integer(name, otherwise, low, high) {
    return this.#read(name, otherwise, (value) => Number.isInteger(value) && isNumber(value, low, high));
  }

  numbers(name, count, otherwise, low, high) {
    return this.#read(name, otherwise, (value) => isList(value, count, (item) => isNumber(item, low, high)));
  }

  /** A list of at most `most` items; [] where there is none. */
  list(name, most) {
    return this.#read(name, [], (value) => Array.isArray(value) && value.length <= most);
  }

  #read(name, otherwise, isSound) {
    const value = (Object.hasOwn(this.given, name) ? this.given[name] : undefined) ?? undefined; // null counts as left out
    if (value === undefined && otherwise !== undefined) return otherwise;
    if (!isSound(value)) throw this.#wrong(`'${name}'`, value);
    return value;
  }

  #wrong(what, value) {
    return corrupt("asset", `${this.where}: ${what} is ${quote(value)}`);
  }
}

function isNumber(value, low, high) {
  return typeof value === "number" && value >= low && value <= high;
}

function isList(value, count, isSound) {
  return Array.isArray(value) && value.length === count && value.every(isSound);
}

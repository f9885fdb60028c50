/** Files that a page of one file holds. */

import { GeometryVideoError } from "../format/errors.js";

/** The file that an element of the page holds as base64 text. @param {string} selector `#id` @returns {Uint8Array} */
export function embedded(selector) {
  const holder = document.getElementById(selector.slice(1));
  if (!holder) throw new GeometryVideoError("load", `the page has no element ${selector}`);
  try {
    return Uint8Array.from(atob(holder.textContent.trim()), (character) => character.charCodeAt(0));
  } catch {
    throw new GeometryVideoError("corrupt", `the element ${selector} does not hold base64 text`);
  }
}

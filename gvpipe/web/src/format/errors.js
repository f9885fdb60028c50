/** The one kind of error that the player raises on purpose; its text is one line, fit to be shown to a user. */

import { ERRORS_REMEDY as AGAIN } from "../constants.js";

export { AGAIN };

const LONGEST = 800; // characters of a message
const LONGEST_QUOTE = 60; // characters of a value that a message quotes
const CUT = " ... ";
const UNSHOWN = /[\p{Cc}\p{Cs}\p{Zl}\p{Zp}]/gu; // what no page should show

/** A text as one line: control characters escaped, its middle left out where it is long. */
export function printable(text) {
  const shown = [...text.replace(UNSHOWN, escaped)]; // by characters, so that none is cut in two
  if (shown.length <= LONGEST) return shown.join("");
  const half = (LONGEST - CUT.length) >> 1;
  return [...shown.slice(0, half), CUT, ...shown.slice(-half)].join("");
}

function escaped(unit) {
  return /\s/.test(unit) ? " " : `\\u${unit.charCodeAt(0).toString(16).padStart(4, "0")}`;
}

/** A value of a file for a message, as JSON, cut where it is long. */
export function quote(value) {
  return String(JSON.stringify(value)).slice(0, LONGEST_QUOTE);
}

/**
 * @property {"load"|"not-geometry-video"|"newer"|"stripped"|"truncated"|"corrupt"|"unsupported"} kind what went wrong; the
 *   kinds of `gvpipe.errors`, and two of the browser's own: a file that cannot be fetched, a video that it cannot decode.
 */
export class GeometryVideoError extends Error {
  constructor(kind, message) {
    super(printable(message));
    this.name = "GeometryVideoError";
    this.kind = kind;
  }
}

/** A section that does not hold what it must. */
export function corrupt(section, what) {
  return new GeometryVideoError("corrupt", `section '${section}' is corrupt: ${what}; ${AGAIN}`);
}

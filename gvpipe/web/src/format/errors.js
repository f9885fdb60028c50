/** The one kind of error that the player raises on purpose; its text is one line, fit to be shown to a user. */

import { ERRORS_REMEDY as AGAIN } from "../constants.js";

export { AGAIN };

/**
 * @property {"load"|"not-geometry-video"|"newer"|"stripped"|"truncated"|"corrupt"|"unsupported"} kind what went wrong; the
 *   kinds of `gvpipe.errors`, and two of the browser's own: a file that cannot be fetched, a video that it cannot decode.
 */
export class GeometryVideoError extends Error {
  constructor(kind, message) {
    super(message);
    this.name = "GeometryVideoError";
    this.kind = kind;
  }
}

/** A section that does not hold what it must. */
export function corrupt(section, what) {
  return new GeometryVideoError("corrupt", `section '${section}' is corrupt: ${what}; ${AGAIN}`);
}

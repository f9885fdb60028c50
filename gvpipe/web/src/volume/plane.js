/** A plane across an axis by a text. Mirrors `gvpipe.rendering.cut.parse_cut`. */

const FORM = /^(-?)([xyz])=([-+0-9.eE]+)(%?)$/;
export const AXES = "xyz";

/**
 * @typedef {object} Cut
 * @property {number} axis 0, 1 or 2 @property {number} place along it, model units; a part of the box if `isPart`
 * @property {boolean} isPart @property {1|-1} sign 1: what lies above is left out; -1: what lies below
 *
 * @param {string|null} text `x=0.3` (model units), `x=30%` (of the box) or `-x=0.3` (the other half is left out)
 * @returns {Cut|null} null: it is none
 */
export function parseCut(text) {
  const found = FORM.exec(text ?? "");
  const number = found ? Number(found[3]) : NaN;
  if (!Number.isFinite(number)) return null;
  const isPart = found[4] === "%";
  return { axis: AXES.indexOf(found[2]), place: isPart ? number / 100 : number, isPart, sign: found[1] ? -1 : 1 };
}

/** Mirror of `parseCut`. @param {Cut} cut */
export function cutText({ axis, place, isPart, sign }) {
  const number = Number((isPart ? 100 * place : place).toPrecision(10));
  return `${sign < 0 ? "-" : ""}${AXES[axis]}=${number}${isPart ? "%" : ""}`;
}

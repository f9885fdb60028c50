/** The element with three.js inside. */

export * from "./element.js";

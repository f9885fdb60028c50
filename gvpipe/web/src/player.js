/** The player: defines the element `<geometry-video>`, and gives all that the module without it gives. */

import { GeometryVideoElement } from "./player/element.js";

export { GeometryVideo, GeometryVideoError } from "./geometry_video.js";
export { GeometryVideoElement };

const { customElements } = globalThis;
if (!customElements?.get("geometry-video")) customElements?.define("geometry-video", GeometryVideoElement); // a page may load it twice

/** What the player does outside of its element: the whole screen, and files that its user saves. Nothing is remembered there. */

const OFFERED = 60_000; // ms that a file can be saved: the browser may ask its user first where to put it

/** @param {Element} element */
export function isFullscreen(element) {
  return document.fullscreenElement === element || element.getRootNode().fullscreenElement === element;
}

/** @param {Element} element */
export function toggleFullscreen(element) {
  const changed = isFullscreen(element) ? document.exitFullscreen() : element.requestFullscreen();
  changed.catch(() => {}); // refused by the user or by a frame around the page: it stays as it is
}

/** @param {Blob} file @param {string} name */
export function save(file, name) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(file), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), OFFERED);
}

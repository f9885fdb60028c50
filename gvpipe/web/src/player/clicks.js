/** Clicks on the picture, which are no drags: those turn the view. */

const STILL = 4; // CSS pixels that a pointer may stray

/**
 * @param {HTMLElement} root around the canvas
 * @param {(x: number, y: number) => void} clicked called with CSS pixels from the canvas' upper left
 */
export function listenToClicks(root, clicked) {
  const down = new Map(); // by pointer: where it went down, or null if it has strayed, or is one of several
  const end = ({ pointerId }) => down.delete(pointerId);
  root.addEventListener("pointerdown", ({ pointerId, button, clientX, clientY, target }) => {
    const isAlone = down.size === 0 && button === 0 && target.localName === "canvas";
    for (const other of down.keys()) down.set(other, null);
    down.set(pointerId, isAlone ? [clientX, clientY] : null);
  });
  root.addEventListener("pointermove", ({ pointerId, clientX, clientY }) => {
    const from = down.get(pointerId);
    if (from && Math.hypot(clientX - from[0], clientY - from[1]) > STILL) down.set(pointerId, null);
  });
  root.addEventListener("pointerup", (event) => {
    const from = down.get(event.pointerId);
    end(event);
    if (!from) return;
    const { left, top } = root.querySelector("canvas").getBoundingClientRect();
    clicked(from[0] - left, from[1] - top);
  });
  root.addEventListener("pointercancel", end);
}

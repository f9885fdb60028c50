/** What keys do: from a key to the name of an action of the player. */

const KEYS = {
  " ": "play",
  ArrowLeft: "back",
  ArrowRight: "forward",
  Home: "first",
  End: "last",
  "+": "nearer",
  "-": "farther",
  "<": "slower",
  ">": "faster",
  l: "loop",
  m: "mute",
  w: "wireframe",
  r: "view",
  c: "follow",
  v: "probe",
  p: "still",
  f: "fullscreen",
};
const SHIFTED = { ArrowLeft: "turn-left", ArrowRight: "turn-right", ArrowUp: "turn-up", ArrowDown: "turn-down" };

/** @param {KeyboardEvent} event @returns {string|undefined} an action; none where the key belongs to what has the focus */
export function actionOf(event) {
  const { key, target } = event;
  if (event.ctrlKey || event.metaKey || event.altKey) return undefined;
  if (target.matches("input[type=search], input[type=number]")) return undefined; // all keys write there
  if (key === " " && target.matches("button, select, summary, input[type=checkbox]")) return undefined; // space presses it
  if (/^(Arrow|Home|End)/.test(key) && target.matches("input, select")) return undefined; // its own steps
  return event.shiftKey && SHIFTED[key] ? SHIFTED[key] : (KEYS[key] ?? KEYS[key.toLowerCase()]);
}

/** The live page: the player of `web.md`, and its state in a line. */

import "./player.js";

const SHOWN = ["currentTime", "duration", "paused", "ended", "seeking", "playbackRate"];
const EVENTS = ["loadedmetadata", "play", "pause", "timeupdate", "seeked", "ratechange", "ended", "error"];

const element = document.querySelector("geometry-video");
const line = document.querySelector("#state");
const text = (value) => (typeof value === "number" ? value.toFixed(2) : String(value));

function show({ type }) {
  line.textContent = [`event ${type}`, ...SHOWN.map((name) => `${name} ${text(element[name])}`)].join(" · ");
}

for (const name of EVENTS) element.addEventListener(name, show);

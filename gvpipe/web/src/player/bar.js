/** The bar below the picture: markup, what its parts show, and what they ask for. It knows no video. */

import { icon } from "./icons.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];

const button = (name, label, symbol, more = "") =>
  `<button type="button" data-act="${name}" aria-label="${label}" title="${label}" ${more}>${icon(symbol)}</button>`;

const MARKUP = `
  ${button("back", "Previous frame (←)", "back")}
  ${button("play", "Play (space)", "play")}
  ${button("forward", "Next frame (→)", "forward")}
  <input type="range" min="0" step="1" value="0" aria-label="Frame">
  <span class="count"></span>
  <select aria-label="Speed" title="Speed (&lt; and &gt;)">
    ${SPEEDS.map((speed) => `<option value="${speed}">${speed}×</option>`).join("")}
  </select>
  ${button("mute", "Mute (M)", "sound", "hidden")}
  ${button("loop", "Loop (L)", "loop", 'aria-pressed="false"')}
  ${button("wireframe", "Wireframe (W)", "wireframe", 'aria-pressed="false"')}
  ${button("follow", "Camera follows the mesh (C)", "follow", 'aria-pressed="false"')}
  ${button("view", "Reset the view (R)", "view")}
  ${button("still", "Save this picture as PNG (P)", "still")}
  ${button("fullscreen", "Full screen (F)", "fullscreen", 'aria-pressed="false"')}
  <p class="facts"></p>
  <p class="notes"></p>`;

export class Bar {
  /**
   * @param {HTMLElement} root filled with the bar
   * @param {{act: (name: string) => void, seek: (frame: number, done: boolean) => void, speed: (speed: number) => void}} on
   *   called for what the user asks for; `done` is false while the slider is still held
   */
  constructor(root, on) {
    root.innerHTML = MARKUP;
    this.root = root;
    this.slider = root.querySelector("input");
    this.count = root.querySelector(".count");
    this.speeds = root.querySelector("select");
    this.facts = root.querySelector(".facts");
    this.notes = root.querySelector(".notes");
    root.addEventListener("click", (event) => {
      const pressed = event.target.closest("[data-act]");
      if (pressed) on.act(pressed.dataset.act);
    });
    this.slider.addEventListener("input", () => on.seek(this.slider.valueAsNumber, false));
    this.slider.addEventListener("change", () => on.seek(this.slider.valueAsNumber, true));
    this.speeds.addEventListener("change", () => on.speed(Number(this.speeds.value)));
    this.setSpeed(1);
  }

  setEnabled(enabled) {
    this.root.inert = !enabled;
  }

  /** @param {import("../geometry_video.js").GeometryVideo} video */
  setVideo(video) {
    this.frames = video.frameCount;
    const { shots } = video;
    this.times = shots.length > 1 ? null : video.metadata.times; // of a simulation, whose steps are no frames of a film
    this.slider.max = video.frameCount - 1;
    this.root.querySelector('[data-act="mute"]').hidden = !video.sound;
    const bits = (8 * video.byteLength) / shots.reduce((sum, { vertices, frames }) => sum + vertices * frames, 0);
    this.facts.textContent = [
      ...(video.isLive ? ["live"] : []),
      `${formatSpan(shots.map(({ vertices }) => vertices))} vertices`,
      `${formatSpan(shots.map(({ triangles }) => triangles))} triangles`,
      ...(shots.length > 1 ? [`${shots.length} shots`] : []),
      `${video.frameCount} frames at ${Number(video.fps.toPrecision(4))} fps`,
      formatBytes(video.byteLength),
      `${formatRate(video.bitRate)}`,
      `${bits.toFixed(2)} bits per vertex and frame`,
    ]
      .map((fact) => fact.replaceAll(" ", "\u00a0"))
      .join(" · ");
    this.facts.title = this.facts.textContent;
  }

  /** What of the file is not shown as it should be. @param {string[]} notes */
  setNotes(notes) {
    this.notes.textContent = notes.join(" · ");
  }

  setFrame(frame) {
    this.slider.value = frame;
    this.slider.ariaValueText = `frame ${frame} of ${this.frames}`;
    const time = this.times ? ` · ${Number(this.times[frame].toPrecision(6))} s` : "";
    this.count.textContent = `${frame} / ${this.frames - 1}${time}`;
  }

  setPlaying(playing) {
    const play = this.root.querySelector('[data-act="play"]');
    play.innerHTML = icon(playing ? "pause" : "play");
    play.ariaLabel = play.title = playing ? "Pause (space)" : "Play (space)";
  }

  setMuted(muted) {
    const mute = this.root.querySelector('[data-act="mute"]');
    mute.innerHTML = icon(muted ? "muted" : "sound");
    mute.ariaLabel = mute.title = muted ? "Sound on (M)" : "Mute (M)";
  }

  /** Leave a button out. @param {string} name */
  hide(name) {
    this.root.querySelector(`[data-act="${name}"]`).hidden = true;
  }

  /** @param {"loop"|"wireframe"|"follow"|"fullscreen"} name @param {boolean} pressed */
  setPressed(name, pressed) {
    this.root.querySelector(`[data-act="${name}"]`).ariaPressed = String(pressed);
  }

  setSpeed(speed) {
    const isOffered = [...this.speeds.options].some((option) => Number(option.value) === speed);
    if (!isOffered) this.speeds.add(new Option(`${speed}×`, speed));
    this.speeds.value = speed;
  }
}

/** The next speed up (direction 1) or down (-1) from `speed`. */
export function nextSpeed(speed, direction) {
  const sorted = direction > 0 ? SPEEDS : SPEEDS.toReversed();
  return sorted.find((other) => direction * (other - speed) > 0) ?? speed;
}

/** The least and the most of counts. */
function formatSpan(counts) {
  const [low, high] = counts.reduce(([least, most], count) => [Math.min(least, count), Math.max(most, count)], [Infinity, 0]);
  return [...new Set([low, high])].map((count) => count.toLocaleString("en")).join(" to ");
}

function formatBytes(count) {
  return count >= 1e6 ? `${(count / 1e6).toFixed(2)} MB` : `${(count / 1e3).toFixed(1)} kB`;
}

function formatRate(bits) {
  return bits >= 1e6 ? `${(bits / 1e6).toFixed(2)} Mbit/s` : `${Math.round(bits / 1e3)} kbit/s`;
}

// Plays a file from a web server as a page does, without a browser: node run_parts.mjs BUNDLE.js; each line of standard input is a
// command, and gets a line of JSON.
import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";
import { StreamFile } from "../../gvpipe/web/src/format/stream_file.js";
import { LevelChooser } from "../../gvpipe/web/src/level_chooser.js";
import { Playback } from "../../gvpipe/web/src/playback.js";
import { ShotRow } from "../../gvpipe/web/src/shots/shot_row.js";

const { process } = globalThis;
delete globalThis.process; // Draco's wrapper then takes this for a page
globalThis.window = globalThis;
globalThis.location = new URL("http://localhost/");
const { GeometryVideo } = await import(pathToFileURL(process.argv[2]));
let video = null;
let lost = null; // the error that ended following a file
let playing = null; // what has been shown

const state = () => [video.frameCount, video.isLive, video.startFrame, String(video.duration), lost && [lost.kind, lost.message]];

/** A clock whose steps are `milliseconds` apart, whatever the time is. */
function clock(milliseconds) {
  let now = 0;
  return (tick) => setTimeout(() => tick((now += milliseconds)), 0);
}

const commands = {
  async load({ url, level }) {
    video?.close();
    video = await GeometryVideo.load(url, { level });
    return { level: video.level, levels: video.levels, counts: [video.frameCount, video.vertexCount, video.triangleCount] };
  },
  async frame({ k }) {
    const frame = await video.frame(k);
    return { positions: [...frame], bounds: video.bounds };
  },
  /** Shots of a file on a server or on the disk, and frames in this order, with what is theirs. */
  async shots({ url, path, frames }) {
    video?.close();
    video = await GeometryVideo.load(url ?? new Uint8Array(readFileSync(path)));
    const found = [];
    for (const k of frames) {
      const positions = await video.frame(k);
      found.push({ positions: [...positions], indices: [...video.indices], shot: video.shot, own: video.ownFrame(k) });
    }
    return { shots: video.shots, duration: video.duration, bounds: video.bounds, images: video.images.map(({ data }) => data.length), found };
  },
  /** What a row of shots opens and closes, `together` at once, while these frames are sought, or while it plays so many. */
  async row({ shots, vertices, together, frames, plays }) {
    const [opened, closed] = [[], []];
    let [open, most] = [0, 0];
    const load = async (number) => {
      opened.push(number);
      most = Math.max(most, ++open);
      await new Promise((go) => setTimeout(go, 1));
      open--;
      const bounds = { min: [0, 0, 0], max: [1, 1, 1] };
      const made = { indices: [0, 1, 2], basePoints: [], vertexCount: 1, bounds, frame: async (k) => Float32Array.of(number, k, 0) };
      return { video: { ...made, close: () => closed.push(number) }, header: { frames: 2, vertices, triangles: 1, fps: 30 } };
    };
    const rows = Array.from({ length: shots }, (_, number) => ({ start: 2 * number, frames: 2, vertices, triangles: 1, bytes: 1 }));
    const row = await ShotRow.open({ fps: 30, shots: rows, box: null, source: {} }, load, together, () => {});
    const pictures = await row.openPictures();
    const seen = [];
    for (const k of frames) {
      row.aim(k);
      await pictures.seek(k);
      row.shown = pictures.current.shot;
      seen.push([...pictures.current.positions]);
    }
    if (plays) {
      await new Promise((resolve, failed) => {
        const show = (k) => {
          row.shown = pictures.current.shot;
          seen.push(k);
          if (seen.length === plays) resolve();
        };
        pictures.play({ show, failed, ended: resolve, nextTick: clock(1000 / 30) }, 1, true);
      });
      pictures.pause();
    }
    const kept = pictures.kept.size;
    row.close();
    await null;
    return { opened, closed, seen, most, kept };
  },
  async level({ level }) {
    await video.setLevel(level);
    return [video.level, video.vertexCount, video.triangleCount, video.indices.length];
  },
  /** A file that is still written, or bytes on the disk. */
  async join({ url, path }) {
    video?.close();
    lost = null;
    video = await GeometryVideo.load(url ?? new Uint8Array(readFileSync(path)));
    video.lost = (error) => (lost = error);
    return state();
  },
  /** The state once there are so many frames, or all, or the file is lost, or time is over. */
  async grown({ frames, seconds = 8 }) {
    const end = performance.now() + 1000 * seconds;
    while (video.frameCount < frames && video.isLive && !lost && performance.now() < end) await new Promise((go) => setTimeout(go, 10));
    return state();
  },
  /** Starts to play, by a clock that is as fast as the page's. */
  async start() {
    playing = { frames: [], waits: [], ended: 0 };
    const on = { failed: (error) => (lost = error), ended: () => playing.ended++, waits: (isWaiting) => playing.waits.push(isWaiting) };
    let now = 0;
    const nextTick = (tick) => setTimeout(() => tick((now += 10)), 10);
    await video.play((positions, k) => playing.frames.push(k), { ...on, nextTick });
    return true;
  },
  /** What was shown, once so many frames were, or after so many seconds. */
  async shown({ count, seconds = 8 }) {
    const end = performance.now() + 1000 * seconds;
    while (playing.frames.length < count && performance.now() < end) await new Promise((go) => setTimeout(go, 10));
    return playing;
  },
  /** Plays `count` frames from the one shown last, and changes the level after some of them. */
  async play({ count, after, level }) {
    const shown = [];
    let changed = null;
    await new Promise((resolve, failed) => {
      const show = (positions, k) => {
        shown.push([k, positions.length / 3]);
        if (shown.length === after) changed = video.setLevel(level);
        if (shown.length === count) resolve();
      };
      video.play(show, { failed, loop: true, nextTick: clock(1000 / video.fps) });
    });
    video.pause();
    await changed;
    return shown;
  },
  /** Sections that a file keeps when it has loaded these, at most so many bytes of segments. */
  async keep({ url, names, most }) {
    const file = await StreamFile.open(url, new AbortController().signal);
    file.mostKept = most;
    for (const name of names) await file.load(name);
    return [...file.sections.keys()];
  },
  /** The level after each step of a clock: `[ms, isThere, times]`. */
  choose({ vertices, due, steps }) {
    const chooser = new LevelChooser(vertices);
    const levels = [];
    let [now, level] = [0, 0];
    for (const [milliseconds, isThere, times] of steps) {
      for (let i = 0; i < times; i++) level = chooser.step((now += milliseconds), level, isThere, due);
      levels.push(level);
    }
    return levels;
  },
  /** Levels of a video that plays by clocks of these steps, whose frames come at once. */
  async follow({ vertices, steps }) {
    let on = null;
    const fake = {
      levels: vertices,
      level: 0,
      fps: 25,
      frameCount: 1e6,
      isWaiting: false,
      play: async (_, given) => (on = given),
      pause() {},
      setLevel: async (level) => (fake.level = level),
      frame: async () => new Float32Array(3 * vertices[fake.level]),
    };
    const playback = new Playback(fake, { show() {}, tell() {}, prepare() {}, fail: (error) => { throw error; } });
    playback.choosesLevel = true;
    await playback.play();
    const levels = [];
    let now = 0;
    for (const [milliseconds, isWaiting, times] of steps) {
      fake.isWaiting = isWaiting;
      for (let i = 0; i < times; i++) {
        on.ticked((now += milliseconds), true);
        await null; // a change of the level takes a moment
      }
      levels.push(fake.level);
    }
    return levels;
  },
};

for await (const line of createInterface({ input: process.stdin })) {
  const { command, ...given } = JSON.parse(line);
  const answer = await Promise.resolve()
    .then(() => commands[command](given))
    .then((value) => ({ value }), (error) => ({ error: [error.kind ?? error.name, error.message] }));
  process.stdout.write(`${JSON.stringify(answer)}\n`);
}

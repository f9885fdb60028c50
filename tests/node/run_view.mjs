// What the player picks, draws and plots: node run_view.mjs; reads {"command", ...} from standard input, writes JSON.
import { readFileSync } from "node:fs";
import { Trace } from "../../gvpipe/web/src/player/trace.js";
import { pickPoint, pickTriangle } from "../../gvpipe/web/src/three/picking.js";
import { polygonEdges } from "../../gvpipe/web/src/three/polygon_edges.js";
import { Warp, parseWarp, usualMover } from "../../gvpipe/web/src/three/warp.js";

const commands = {
  edges: ({ faces, polygons, ranges }) => [...polygonEdges(Uint32Array.from(faces.flat()), polygons, ranges)],
  pick({ points, faces, ranges, rays }) {
    const [places, indices] = [Float32Array.from(points.flat()), Uint32Array.from(faces.flat())];
    const met = ([origin, direction]) =>
      faces.length ? pickTriangle(origin, direction, places, indices, ranges) : pickPoint(origin, direction, places);
    return rays.map(met);
  },
  /** Values of 1000 frames in segments of 100, of which `kept` are in memory; what was asked for. */
  async trace({ count, kept, stop }) {
    const here = new Set(kept);
    const asked = [];
    const field = {
      frameCount: count,
      row: (k) => (here.has(Math.floor(k / 100)) ? [k === 5 ? NaN : 3 * k, 4 * k] : null),
      load: async (k) => here.add((asked.push(k), Math.floor(k / 100))),
    };
    const trace = new Trace(field, 0);
    const first = trace.take();
    let changes = 0;
    await trace.load(() => asked.length < stop, () => changes++);
    return { frames: trace.frames, values: trace.values, first, changes, asked };
  },
  warp({ texts, fields }) {
    const map = new Map(fields.map((field) => [field.name, field]));
    return [texts.map((text) => parseWarp(text, map)), usualMover(map)];
  },
  bounds({ extents, scale }) {
    const field = { type: "float32", rowCount: 1, components: extents.length, extents };
    return new Warp(field, scale).widened({ min: [0, 0, 0], max: [1, 1, 1] });
  },
};

const { command, ...given } = JSON.parse(readFileSync(0, "utf8"));
console.log(JSON.stringify(await commands[command](given)));

/**
 * The interactive plots of `curves.md`: rate against error of all codecs on one sequence. The pointer or the arrow keys choose a
 * point, and the line below describes it; the legend's buttons hide and show codecs. Nothing is fetched but `data-files`.
 */

import { METRICS, RATE, describe, logAxis, seriesOf } from "./curve-points.js";

const [WIDTH, HEIGHT] = [760, 460];
const FRAME = { left: 70, right: 750, top: 12, bottom: 410 }; // pixels of the axes
const NEAR = 40; // pixels: a pointer farther from all points chooses none
const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8b5a2b", "#7f7f7f"];
const SHAPES = [
  "M-3.5,0a3.5,3.5 0 1,0 7,0a3.5,3.5 0 1,0 -7,0", // of the first eight codecs: a circle, then a square, then a triangle
  "M-3,-3h6v6h-6z",
  "M0,-4l4,7h-8z",
];
const DASHES = ["", "6 3", "2 2"];
const KEYS = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] };
const STYLE = `
  #curves .box { position: relative; }
  #curves label { margin-right: 1rem; }
  #curves select, #curves button { font: inherit; color: inherit; background: none; padding: 0 .3rem; }
  #curves select, #curves button, #curves .tip { border: 1px solid currentColor; border-radius: 3px; }
  #curves select option { color: black; }
  #curves svg { display: block; width: 100%; height: auto; overflow: visible; }
  #curves svg.swatch { display: inline; width: 24px; height: 10px; }
  #curves svg text { fill: currentColor; font-size: 12px; }
  #curves ul { list-style: none; margin: 0; padding: 0; display: flex; flex-wrap: wrap; gap: .3rem; }
  #curves li { margin: 0; }
  #curves button[aria-pressed=false] { opacity: .45; text-decoration: line-through; }
  #curves [role=status] { min-height: 4.5em; margin: .5rem 0; white-space: pre-line; }
  #curves .tip { position: absolute; max-width: 22rem; padding: .3rem .5rem; white-space: pre-line; pointer-events: none;
    font-size: .65rem; background: var(--md-default-bg-color, white); }`;

const looks = new Map(); // of codecs, the same on every sequence
const hidden = new Set(); // codecs
const reports = new Map(); // by address
const state = { metric: "kg", report: null, shown: [], chosen: null };

function make(name, attributes = {}, ...children) {
  const isDrawn = ["svg", "g", "path", "line", "text"].includes(name);
  const element = isDrawn ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

function lookOf(codec) {
  if (!looks.has(codec)) {
    const group = Math.floor(looks.size / COLOURS.length) % SHAPES.length;
    looks.set(codec, { colour: COLOURS[looks.size % COLOURS.length], shape: SHAPES[group], dash: DASHES[group] });
  }
  return looks.get(codec);
}

function choice(label, options) {
  const select = make("select", {}, ...options.map(([value, text]) => make("option", { value }, text)));
  return [make("label", {}, `${label} `, select), select];
}

const root = document.querySelector("#curves");
const files = root.dataset.files.split(" ").map((path) => [path, path.replace(/^.*\/|\.json$/g, "")]);
const [sequenceLabel, sequenceSelect] = choice("Sequence", files);
const [metricLabel, metricSelect] = choice("Error", Object.entries(METRICS));
const plot = make("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "application", "aria-roledescription": "plot", tabindex: 0 });
const status = make("p", { role: "status" });
const tip = make("div", { class: "tip", "aria-hidden": "true", hidden: "" });
const box = make("div", { class: "box" }, plot, tip);
const legend = make("ul", { "aria-label": "Codecs that are shown" });

function place() {
  const series = seriesOf(state.report, state.metric);
  const points = series.flatMap((one) => one.points);
  const x = logAxis(points.map((point) => point.rate), FRAME.left, FRAME.right);
  const y = logAxis(points.map((point) => point.error), FRAME.bottom, FRAME.top);
  for (const point of points) [point.x, point.y] = [x.place(point.rate), y.place(point.error)];
  return { series, x, y };
}

function axes(x, y) {
  const { left, right, top, bottom } = FRAME;
  const line = (x1, y1, x2, y2) => make("line", { x1, y1, x2, y2, stroke: "currentColor", "stroke-opacity": 0.2 });
  const text = (value, transform, anchor = "middle") => make("text", { transform, "text-anchor": anchor }, String(value));
  const tickOfX = (value, at) => [line(at, top, at, bottom), text(value, `translate(${at} ${bottom + 18})`)];
  const tickOfY = (value, at) => [line(left, at, right, at), text(value, `translate(${left - 6} ${at + 4})`, "end")];
  return [
    ...x.ticks.flatMap((value) => tickOfX(value, x.place(value))),
    ...y.ticks.flatMap((value) => tickOfY(value, y.place(value))),
    text(RATE, `translate(${(left + right) / 2} ${bottom + 38})`),
    text(METRICS[state.metric], `translate(14 ${(top + bottom) / 2}) rotate(-90)`),
  ];
}

function curve(one) {
  const { colour, shape, dash } = lookOf(one.codec);
  const marks = one.points.map((point) => make("path", { d: shape, fill: colour, transform: `translate(${point.x} ${point.y})` }));
  const way = one.points.map((point) => `${point.x},${point.y}`).join("L");
  const line = make("path", { d: `M${way}`, fill: "none", stroke: colour, "stroke-dasharray": dash });
  return make("g", { "data-codec": one.codec }, line, ...marks);
}

function draw() {
  const { series, x, y } = place();
  for (const { codec } of series) lookOf(codec);
  state.shown = series.filter((one) => one.points.length && !hidden.has(one.codec));
  plot.replaceChildren(...axes(x, y), ...state.shown.map(curve));
  const what = `${METRICS[state.metric]} against ${RATE}, ${state.shown.length} codecs`;
  plot.setAttribute("aria-label", `${what}. Arrow keys choose a point. The tables of this page have the rates.`);
  legend.replaceChildren(...series.map(({ codec }) => make("li", {}, button(codec))));
  choose(null);
}

function button(codec) {
  const { colour, shape, dash } = lookOf(codec);
  const line = make("path", { d: "M0,5H24", stroke: colour, "stroke-dasharray": dash });
  const mark = make("path", { d: shape, fill: colour, transform: "translate(12 5)" });
  const swatch = make("svg", { viewBox: "0 0 24 10", class: "swatch", "aria-hidden": "true" }, line, mark);
  const made = make("button", { type: "button", "aria-pressed": !hidden.has(codec) }, swatch, ` ${codec}`);
  made.addEventListener("click", () => {
    if (!hidden.delete(codec)) hidden.add(codec);
    draw();
    [...legend.querySelectorAll("button")].find((one) => one.textContent === made.textContent).focus(); // it was made anew
  });
  return made;
}

/** Describe a point, `{ series, k }`, or none. */
function choose(chosen) {
  state.chosen = chosen;
  plot.querySelector(".ring")?.remove();
  tip.hidden = !chosen;
  status.textContent = "Point at a curve, or use the arrow keys in the plot.";
  if (!chosen) return;
  const point = chosen.series.points[chosen.k];
  const lines = describe(chosen.series, point, state.metric);
  const at = `translate(${point.x} ${point.y}) scale(2)`;
  plot.append(make("path", { class: "ring", d: SHAPES[0], fill: "none", stroke: "currentColor", transform: at }));
  status.textContent = tip.textContent = lines.join("\n");
  const scale = plot.clientWidth / WIDTH;
  tip.style.top = `${point.y * scale + 12}px`;
  tip.style.left = point.x < WIDTH / 2 ? `${point.x * scale + 12}px` : "";
  tip.style.right = point.x < WIDTH / 2 ? "" : `${(WIDTH - point.x) * scale + 12}px`;
}

function point({ offsetX, offsetY }) {
  const scale = WIDTH / plot.clientWidth;
  const all = state.shown.flatMap((series) => series.points.map((_, k) => ({ series, k })));
  const far = ({ series, k }) => Math.hypot(series.points[k].x - offsetX * scale, series.points[k].y - offsetY * scale);
  const nearest = all.reduce((best, one) => (best && far(best) <= far(one) ? best : one), null);
  choose(nearest && far(nearest) < NEAR ? nearest : null);
}

function step(event) {
  if (event.key === "Escape") return choose(null);
  if (!(event.key in KEYS) || !state.shown.length) return;
  event.preventDefault();
  if (!state.chosen) return choose({ series: state.shown[0], k: 0 });
  const [across, along] = KEYS[event.key];
  const at = state.shown.indexOf(state.chosen.series) + across;
  const series = state.shown[(at + state.shown.length) % state.shown.length];
  choose({ series, k: Math.min(Math.max(state.chosen.k + along, 0), series.points.length - 1) });
}

async function open() {
  const address = new URL(sequenceSelect.value, import.meta.url).href;
  try {
    if (!reports.has(address)) {
      const answer = await fetch(address);
      if (!answer.ok) throw new Error(`status ${answer.status}`);
      reports.set(address, await answer.json());
    }
  } catch (error) {
  X
  }
  if (address !== new URL(sequenceSelect.value, import.meta.url).href) return; // another was chosen meanwhile
  state.report = reports.get(address);
  draw();
}

root.replaceChildren(make("style", {}, STYLE), make("p", {}, sequenceLabel, metricLabel), box, status, legend);
sequenceSelect.addEventListener("change", open);
metricSelect.addEventListener("change", () => {
  state.metric = metricSelect.value;
  if (state.report) draw();
});
plot.addEventListener("pointermove", point);
plot.addEventListener("pointerdown", point);
plot.addEventListener("pointerleave", () => choose(null));
plot.addEventListener("keydown", step);
await open();

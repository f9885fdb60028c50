/** Prints what the plots of the documentation show of a file of results: `run_curves.mjs MODULE RESULTS METRIC`, as JSON. */

import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [source, path, metric] = process.argv.slice(2);
const { METRICS, describe, logAxis, seriesOf } = await import(pathToFileURL(source));
const series = seriesOf(JSON.parse(readFileSync(path, "utf-8")), metric);
const errors = series.flatMap((one) => one.points.map((point) => point.error));
const axis = logAxis(errors, 100, 0);
const [one] = series;
console.log(JSON.stringify({
  metrics: Object.keys(METRICS),
  points: series.flatMap(({ codec, points }) => points.map((point) => [codec, point.quality, point.bytes, point.rate, point.error])),
  lines: describe(one, one.points[0], metric),
  ticks: axis.ticks,
  places: [Math.min(...errors), ...axis.ticks, Math.max(...errors)].map(axis.place),
}));

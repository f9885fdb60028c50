/** What the plots of `curves.md` show: points of `benchmarks/curves/NAME.json`, logarithmic axes, and what stands beside a point. */

export const RATE = "bits per vertex and frame";
export const METRICS = {
  kg: "KG error, %",
  sted: "STED",
  da: "da",
  rmse_diag: "root mean square error, part of the diagonal",
  max_diag: "largest error, part of the diagonal",
};
const STEPS = [1, 2, 5]; // of a decade
const MOST_TICKS = 9; // beyond, decades alone

/** The curves of a report with one metric, by codec: points with a rate and an error above 0, the smallest first. */
export function seriesOf(report, metric) {
  return report.curves.map(({ codec, settings, points }) => ({
    codec,
    settings,
    points: points
      .map((point) => ({ quality: point.quality, bytes: point.bytes, rate: point.bpvf, error: point[metric] }))
      .filter(({ rate, error }) => rate > 0 && error > 0)
      .sort((a, b) => a.rate - b.rate),
  }));
}

/** A logarithmic axis that has all values: `place` gives the pixel of one, from `start` to `end`; `ticks` are round values. */
export function logAxis(values, start, end) {
  const [low, high] = [Math.min(...values), Math.max(...values)].map(Math.log10);
  const margin = 0.04 * (high - low || 1);
  const [first, last] = [low - margin, high + margin];
  const ticks = [];
  for (let decade = Math.floor(first); decade <= last; decade++) {
    for (const step of STEPS) {
      const value = Number(`${step}e${decade}`);
      if (Math.log10(value) >= first && Math.log10(value) <= last) ticks.push(value);
    }
  }
  const shown = ticks.length > MOST_TICKS ? ticks.filter((value) => /^1(e|0*$)|^0\.0*1$/.test(String(value))) : ticks;
  return { place: (value) => start + ((Math.log10(value) - first) / (last - first)) * (end - start), ticks: shown };
}

/** Lines about a point: codec, quality, size, error, settings. */
export function describe({ codec, settings }, point, metric) {
  const own = Object.entries(settings).map(([key, value]) => `${key} ${value}`);
  return [
    codec,
    `quality ${point.quality}`,
    `${point.bytes.toLocaleString("en")} bytes, ${point.rate} bits per vertex and frame`,
    `${METRICS[metric]}: ${point.error}`,
    own.length ? `settings: ${own.join(", ")}` : "",
  ].filter(Boolean);
}

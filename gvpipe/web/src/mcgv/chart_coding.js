/** The chart of every point. Mirrors `gvcodecs.mcgv.layout.chart_coding.decode_charts` and its kernels; `docs/format.md`, section 5.5. */

import { CHART_CODING_CONTEXTS as CONTEXTS, CHART_KERNELS_MAX_NEAR as MAX_NEAR } from "../constants.js";
import { Cursor } from "../format/cursor.js";
import { decodeIntegers } from "../format/integers.js";

/**
 * @param {Uint8Array} data section `charts`
 * @param {{starts: Int32Array, neighbours: Int32Array}} causal of the points
 * @returns {Int32Array} (P) charts, numbered without a gap
 */
export function decodeCharts(data, causal) {
  const cursor = new Cursor(data, "charts");
  const n = causal.starts.length - 1;
  const context = (p) => Math.min(causal.starts[p + 1] - causal.starts[p], CONTEXTS - 1);
  const contexts = Uint8Array.from({ length: n }, (_, p) => context(p));
  const ranks = decodeIntegers(cursor.take(cursor.varint(cursor.left, "a length")), n, contexts, "charts");
  const count = cursor.varint(n, "the number of charts told by number");
  const numbers = decodeIntegers(cursor.rest(), count, null, "charts");
  const charts = new Int32Array(n);
  const listed = new Int32Array(MAX_NEAR);
  const counts = new Int32Array(MAX_NEAR);
  let [nCharts, used] = [0, 0];
  for (let point = 0; point < n; point++) {
    const length = listCharts(point, causal, charts, listed, counts);
    const rank = ranks[point];
    if (rank >= 0 && rank < length) {
      charts[point] = listed[rank];
      continue;
    }
    const ago = rank === length && used < count ? numbers[used++] : -1;
    if (ago < 0 || ago > nCharts) throw cursor.corrupt(`the chart of point ${point} makes no sense`);
    charts[point] = nCharts - ago;
    nCharts = Math.max(nCharts, charts[point] + 1);
  }
  if (used < count) throw cursor.corrupt(`the chart of point ${n} makes no sense`);
  return charts;
}

/** Fill `listed` and `counts` with the charts of a point's causal neighbours, most frequent first; return how many. */
function listCharts(point, { starts, neighbours }, charts, listed, counts) {
  let n = 0;
  for (let entry = starts[point + 1] - 1; entry >= Math.max(starts[point], starts[point + 1] - MAX_NEAR); entry--) {
    let place = 0;
    while (place < n && listed[place] !== charts[neighbours[entry]]) place++;
    if (place === n) {
      listed[n] = charts[neighbours[entry]];
      counts[n++] = 0;
    }
    counts[place]++;
  }
  for (let i = 1; i < n; i++) {
    const [chart, count] = [listed[i], counts[i]];
    let place = i;
    for (; place > 0 && counts[place - 1] < count; place--) {
      listed[place] = listed[place - 1];
      counts[place] = counts[place - 1];
    }
    listed[place] = chart;
    counts[place] = count;
  }
  return n;
}

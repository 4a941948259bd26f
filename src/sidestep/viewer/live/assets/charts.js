// Four small charts over the same time: belief, collision probability, distance, planning time.

import { FONT } from "./bodies.js";
import { alpha } from "./palette.js";

const WINDOW = 20; // s shown of a running world

const percent = (p) => (p < 0.001 ? "< 0.1 %" : p < 0.1 ? `${(100 * p).toFixed(1)} %` : `${Math.round(100 * p)} %`);

const ROWS = [
  { key: "belief", title: "Will the person give way?", range: () => [0, 1], ticks: [0, 0.5, 1], tick: (v) => `${100 * v} %`, value: percent },
  {
    key: "risk", title: "Chance of coming too close", range: () => [-4, 0], ticks: [-4, -2, 0], map: (v) => Math.log10(Math.max(v, 1e-4)),
    tick: (v) => ({ "-4": "0.01 %", "-2": "1 %", 0: "100 %" })[v], value: percent, limit: (world) => [world.limit, world.summed ? "limit of the sum" : "limit"],
  },
  {
    key: "distance", title: "Distance", range: () => [0, 4], ticks: [0, 2, 4], tick: (v) => `${v} m`, value: (v) => `${v.toFixed(2)} m`,
    limit: (world) => [world.clearance, "keep"],
  },
  { key: "ms", title: "Thinking time per step", range: (values) => [0, nice(usual(values))], ticks: null, tick: milliseconds, value: (v) => `${v.toFixed(1)} ms` },
];

// The largest value, without a few that stand far out (a first step, say): those are cut off at the top.
function usual(values) {
  const sorted = [...values].sort((a, b) => a - b);
  const largest = sorted.at(-1) ?? 0;
  const most = sorted[Math.floor(0.8 * (sorted.length - 1))] ?? 0;
  return Math.min(largest, 4 * most);
}

function milliseconds(v) {
  return v >= 1000 ? `${v / 1000} s` : `${v} ms`;
}

function nice(top) {
  for (const step of [2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000]) if (top <= step) return step;
  return 10000;
}

export class Charts {
  constructor(host) {
    this.rows = ROWS.map((row) => {
      const figure = document.createElement("figure");
      figure.className = "chart";
      figure.innerHTML = `<figcaption><span>${row.title}</span><output>–</output></figcaption><canvas role="img"></canvas>`;
      host.append(figure);
      return { ...row, output: figure.querySelector("output"), canvas: figure.querySelector("canvas") };
    });
    this.clear({ panels: [] });
  }

  clear(world) {
    this.world = world;
    this.series = world.panels.map(() => []);
    this.dirty = true;
  }

  // One sample: {time, belief, risk, distance, ms}, of one panel.
  add(panel, sample) {
    const series = this.series[panel];
    if (!series) return;
    while (series.length && series[series.length - 1].time >= sample.time) series.pop();
    series.push(sample);
    const limit = this.world.length ? Infinity : WINDOW + 2;
    while (series.length && sample.time - series[0].time > limit) series.shift();
    this.dirty = true;
  }

  // All samples of a record at once.
  history(panel, samples) {
    this.series[panel] = samples;
    this.dirty = true;
  }

  draw(time, colours) {
    const span = this.world.length ? [0, this.world.length] : [time - WINDOW, time];
    for (const row of this.rows) this.drawRow(row, span, time, colours);
  }

  drawRow(row, span, time, colours) {
    const { canvas } = row;
    const { clientWidth: width, clientHeight: height } = canvas;
    if (!width) return;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const ctx = canvas.getContext("2d");
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.clearRect(0, 0, width, height);
    const map = row.map ?? ((v) => v);
    const values = this.series.flat().map((s) => s[row.key]).filter((v) => v !== null && v !== undefined);
    const range = row.range(values);
    const plot = { x: 44, y: 5, width: width - 50, height: height - 10 };
    const at = (t, v) => [
      plot.x + (plot.width * (t - span[0])) / (span[1] - span[0]),
      plot.y + plot.height * (1 - (Math.min(range[1], Math.max(range[0], map(v))) - range[0]) / (range[1] - range[0])),
    ];
    drawAxis(ctx, row, range, plot, colours);
    if (row.limit && this.world.limit) drawLimit(ctx, row.limit(this.world), at, plot, colours);
    ctx.save();
    ctx.beginPath();
    ctx.rect(plot.x, 0, plot.width + 3, height);
    ctx.clip();
    for (let i = this.series.length - 1; i >= 0; i -= 1) drawSeries(ctx, this.series[i], row.key, at, i, colours);
    if (this.world.length) drawCursor(ctx, at(time, 0)[0], height, colours);
    ctx.restore();
    this.say(row, time);
  }

  say(row, time) {
    const series = this.series[0] ?? [];
    let i = series.length - 1;
    while (i > 0 && series[i].time > time + 0.3) i -= 1;
    const value = series[i]?.[row.key];
    const text = value === null || value === undefined ? "–" : row.value(value);
    if (row.output.textContent === text) return;
    row.output.textContent = text;
    row.canvas.setAttribute("aria-label", `${row.title}: now ${text}`);
  }
}

function drawAxis(ctx, row, range, plot, colours) {
  ctx.font = `450 10.5px ${FONT}`;
  ctx.textAlign = "right";
  ctx.textBaseline = "middle";
  for (const tick of row.ticks ?? [0, range[1] / 2, range[1]]) {
    const y = plot.y + plot.height * (1 - (tick - range[0]) / (range[1] - range[0]));
    ctx.fillStyle = colours.edge;
    ctx.fillRect(plot.x, Math.round(y), plot.width, 1);
    ctx.fillStyle = colours.muted;
    ctx.fillText(row.tick(tick), plot.x - 6, Math.min(plot.y + plot.height - 3, Math.max(plot.y + 4, y)));
  }
}

function drawLimit(ctx, [value, name], at, plot, colours) {
  const y = at(0, value)[1];
  ctx.save();
  ctx.setLineDash([5, 4]);
  ctx.strokeStyle = colours.limit;
  ctx.lineWidth = 1.5;
  ctx.beginPath();
  ctx.moveTo(plot.x, y);
  ctx.lineTo(plot.x + plot.width, y);
  ctx.stroke();
  ctx.restore();
  ctx.fillStyle = colours.limit;
  ctx.textAlign = "left";
  ctx.fillText(name, plot.x + 4, y - 7);
}

// The first planner is a full line, the second a dashed one.
function drawSeries(ctx, series, key, at, index, colours) {
  ctx.save();
  ctx.strokeStyle = index ? colours.muted : colours.line;
  ctx.lineWidth = index ? 1.5 : 2;
  ctx.setLineDash(index ? [4, 3] : []);
  ctx.lineJoin = "round";
  ctx.beginPath();
  let pen = false;
  let last = null;
  for (const sample of series) {
    const value = sample[key];
    if (value === null || value === undefined) {
      pen = false;
      continue;
    }
    last = at(sample.time, value);
    if (pen) ctx.lineTo(...last);
    else ctx.moveTo(...last);
    pen = true;
  }
  ctx.stroke();
  if (pen && last && !index) {
    ctx.beginPath();
    ctx.arc(...last, 3, 0, 2 * Math.PI);
    ctx.fillStyle = colours.line;
    ctx.fill();
  }
  ctx.restore();
}

function drawCursor(ctx, x, height, colours) {
  ctx.fillStyle = alpha(colours.ink, 0.6);
  ctx.fillRect(x - 0.75, 0, 1.5, height);
}

// The robot's plan, with a band whose width and colour say how probable it is that a person comes too close there.

import { rgb } from "./palette.js";

export function drawPlan(ctx, view, colours, plan, { radius, robot }) {
  const points = plan.positions.map((p, k) => view.point(...(k === 0 && robot ? robot : p)));
  const shares = points.map((_, k) => Math.min(1.4, (plan.risk[k - 1] ?? 0) / plan.limit));
  drawBand(ctx, colours, points, shares, radius * view.scale);
  ctx.lineWidth = 2.5;
  ctx.lineJoin = "round";
  ctx.strokeStyle = colours.robot;
  ctx.beginPath();
  points.forEach((p, k) => (k === 0 ? ctx.moveTo(...p) : ctx.lineTo(...p)));
  ctx.stroke();
  ctx.fillStyle = colours.robot;
  points.slice(1).forEach(([x, y]) => {
    ctx.beginPath();
    ctx.arc(x, y, 3, 0, 2 * Math.PI);
    ctx.fill();
  });
}

// From a hair's breadth (no risk) to the robot's whole width (at the limit); beyond the limit it is outlined too.
function drawBand(ctx, colours, points, shares, radius) {
  const half = shares.map((share) => radius * (0.18 + 0.82 * Math.min(1, share)));
  const sides = points.map((point, k) => across(points, k).map((n) => [point[0] + n[0] * half[k], point[1] + n[1] * half[k]]));
  for (let k = 1; k < points.length; k += 1) {
    const [a, b] = [points[k - 1], points[k]];
    if (Math.hypot(b[0] - a[0], b[1] - a[1]) < 0.5) continue;
    const gradient = ctx.createLinearGradient(...a, ...b);
    gradient.addColorStop(0, tone(colours, shares[k - 1]));
    gradient.addColorStop(1, tone(colours, shares[k]));
    ctx.fillStyle = gradient;
    ctx.beginPath();
    for (const corner of [sides[k - 1][0], sides[k][0], sides[k][1], sides[k - 1][1]]) ctx.lineTo(...corner);
    ctx.fill();
    if (shares[k] <= 1) continue;
    ctx.lineWidth = 2;
    ctx.strokeStyle = colours.limit;
    for (const side of [0, 1]) {
      ctx.beginPath();
      ctx.moveTo(...sides[k - 1][side]);
      ctx.lineTo(...sides[k][side]);
      ctx.stroke();
    }
  }
}

// The two unit vectors across the way at point k: the mean of the stretches before and after, so that bends have no gaps.
function across(points, k) {
  let [dx, dy] = [0, 0];
  for (const [a, b] of [[k - 1, k], [k, k + 1]]) {
    if (a < 0 || b >= points.length) continue;
    const [x, y] = [points[b][0] - points[a][0], points[b][1] - points[a][1]];
    const length = Math.hypot(x, y);
    if (length > 0.5) [dx, dy] = [dx + x / length, dy + y / length];
  }
  const length = Math.hypot(dx, dy) || 1;
  return [[-dy / length, dx / length], [dy / length, -dx / length]];
}

// From the robot's colour to the limit's, and stronger.
function tone(colours, share) {
  const t = Math.min(1, share);
  const [from, to] = [rgb(colours.robot), rgb(colours.limit)];
  const mixed = from.map((c, i) => Math.round(c + (to[i] - c) * t));
  return `rgba(${mixed.join()},${0.18 + 0.42 * t})`;
}

// Where the plan has the robot, `instant` steps ahead (fractions in between).
export function planned(plan, instant) {
  const last = plan.positions.length - 1;
  const k = Math.min(Math.floor(instant), last - 1);
  const share = Math.min(1, instant - k);
  const [a, b] = [plan.positions[k], plan.positions[k + 1]];
  return [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share];
}

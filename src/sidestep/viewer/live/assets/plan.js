// The robot's plan, with a band whose width and colour say how probable it is that a person comes too close there.

import { alpha } from "./palette.js";

export function drawPlan(ctx, view, colours, plan, { radius, robot }) {
  const points = plan.positions.map((p, k) => view.point(...(k === 0 && robot ? robot : p)));
  const shares = [0, ...plan.risk.map((risk) => Math.min(1.4, (risk ?? 0) / plan.limit))];
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
  const half = shares.map((s) => radius * (0.18 + 0.82 * Math.min(1, s)));
  for (let k = 1; k < points.length; k += 1) {
    const [a, b] = [points[k - 1], points[k]];
    const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
    if (length < 0.5) continue;
    const [nx, ny] = [(a[1] - b[1]) / length, (b[0] - a[0]) / length];
    const gradient = ctx.createLinearGradient(...a, ...b);
    gradient.addColorStop(0, tone(colours, shares[k - 1]));
    gradient.addColorStop(1, tone(colours, shares[k]));
    ctx.beginPath();
    ctx.moveTo(a[0] + nx * half[k - 1], a[1] + ny * half[k - 1]);
    ctx.lineTo(b[0] + nx * half[k], b[1] + ny * half[k]);
    ctx.lineTo(b[0] - nx * half[k], b[1] - ny * half[k]);
    ctx.lineTo(a[0] - nx * half[k - 1], a[1] - ny * half[k - 1]);
    ctx.closePath();
    ctx.fillStyle = gradient;
    ctx.fill();
    if (shares[k] > 1) {
      ctx.lineWidth = 1.5;
      ctx.strokeStyle = colours.limit;
      ctx.stroke();
    }
  }
}

function tone(colours, share) {
  if (share <= 0.02) return alpha(colours.robot, 0.16);
  return share < 0.5 ? alpha(colours.robot, 0.16 + 0.5 * share) : alpha(colours.limit, 0.25 + 0.4 * Math.min(1, share));
}

// Where the plan has the robot, `instant` steps ahead (fractions in between).
export function planned(plan, instant) {
  const last = plan.positions.length - 1;
  const k = Math.min(Math.floor(instant), last - 1);
  const share = Math.min(1, instant - k);
  const [a, b] = [plan.positions[k], plan.positions[k + 1]];
  return [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share];
}

// Robot, people and what belongs to them. Shapes differ as well as colours.

import { alpha } from "./palette.js";

const TAU = 2 * Math.PI;

export function drawRobot(ctx, view, colours, { at, radius, status, heading }) {
  const [x, y] = view.point(at[0], at[1]);
  const r = radius * view.scale;
  ctx.save();
  ctx.translate(x, y);
  ctx.beginPath();
  ctx.arc(0, 0, r, 0, TAU);
  ctx.fillStyle = colours.robot;
  ctx.fill();
  ctx.lineWidth = 2;
  ctx.strokeStyle = colours.floor;
  ctx.stroke();
  ctx.fillStyle = colours.robotInk;
  if (status === "stopped") {
    ctx.fillRect(-0.3 * r, -0.3 * r, 0.6 * r, 0.6 * r);
  } else {
    ctx.rotate(view.angle(heading ?? 0));
    ctx.beginPath();
    ctx.moveTo(0.68 * r, 0);
    ctx.lineTo(-0.36 * r, 0.5 * r);
    ctx.lineTo(-0.12 * r, 0);
    ctx.lineTo(-0.36 * r, -0.5 * r);
    ctx.fill();
  }
  ctx.restore();
  if (status === "least_risk") ring(ctx, [x, y], r + 4, { colour: colours.limit, width: 2.5, dash: [5, 4] });
}

export function drawPerson(ctx, view, colours, { at, radius, you, belief, walking }) {
  const [x, y] = view.point(at[0], at[1]);
  const r = radius * view.scale;
  const colour = you ? colours.you : colours.other;
  ctx.save();
  ctx.translate(x, y);
  ctx.beginPath();
  ctx.arc(0, 0, r, 0, TAU);
  ctx.fillStyle = alpha(colour, 0.22);
  ctx.fill();
  ctx.rotate(view.angle(at[2] ?? 0));
  const swing = walking ? Math.sin(performance.now() / 130) : 0;
  ctx.fillStyle = alpha(colour, 0.75);
  for (const side of [-1, 1]) {
    ctx.beginPath(); // feet
    ctx.ellipse(0.3 * r + side * swing * 0.28 * r, side * 0.34 * r, 0.32 * r, 0.17 * r, 0, 0, TAU);
    ctx.fill();
  }
  ctx.fillStyle = colour;
  ctx.beginPath(); // shoulders
  ctx.ellipse(-0.04 * r, 0, 0.46 * r, 0.92 * r, 0, 0, TAU);
  ctx.fill();
  ctx.beginPath(); // head
  ctx.arc(0.1 * r, 0, 0.42 * r, 0, TAU);
  ctx.fillStyle = colours.hair;
  ctx.fill();
  ctx.restore();
  if (belief !== null && belief !== undefined) drawBelief(ctx, colours, [x, y], r + 6, belief);
}

// A gauge around the person: how much of the ring is filled is the belief that they give way.
function drawBelief(ctx, colours, centre, radius, belief) {
  ring(ctx, centre, radius, { colour: alpha(colours.ink, 0.16), width: 4 });
  ctx.beginPath();
  ctx.arc(centre[0], centre[1], radius, -TAU / 4, -TAU / 4 + TAU * belief);
  ctx.lineWidth = 4;
  ctx.lineCap = "round";
  ctx.strokeStyle = colours.givesWay;
  ctx.stroke();
}

export function ring(ctx, [x, y], radius, { colour, width = 1.5, dash = [] }) {
  ctx.save();
  ctx.beginPath();
  ctx.arc(x, y, radius, 0, TAU);
  ctx.setLineDash(dash);
  ctx.lineWidth = width;
  ctx.strokeStyle = colour;
  ctx.stroke();
  ctx.restore();
}

// Fades toward its old end; drawn in a few stretches, each as one line, so that no joints show.
export function drawTrail(ctx, view, points, colour, width) {
  const stretches = 12;
  ctx.lineCap = "butt";
  ctx.lineJoin = "round";
  ctx.lineWidth = width;
  for (let s = 0; s < stretches; s += 1) {
    const from = Math.floor((s * (points.length - 1)) / stretches);
    const to = Math.floor(((s + 1) * (points.length - 1)) / stretches);
    if (to <= from) continue;
    ctx.strokeStyle = alpha(colour, 0.5 * ((s + 1) / stretches) ** 1.5);
    ctx.beginPath();
    ctx.moveTo(...view.point(...points[from]));
    for (let i = from + 1; i <= to; i += 1) ctx.lineTo(...view.point(...points[i]));
    ctx.stroke();
  }
}

export function label(ctx, colours, text, [x, y], { align = "center", bold = false, colour = colours.ink, size = 12.5 } = {}) {
  ctx.font = `${bold ? 600 : 450} ${size}px ${FONT}`;
  ctx.textAlign = align;
  ctx.textBaseline = "middle";
  ctx.lineJoin = "round";
  ctx.lineWidth = 4;
  ctx.strokeStyle = alpha(colours.floor, 0.9);
  ctx.strokeText(text, x, y);
  ctx.fillStyle = colour;
  ctx.fillText(text, x, y);
}

export const FONT = 'Inter, "Segoe UI", Roboto, system-ui, sans-serif';

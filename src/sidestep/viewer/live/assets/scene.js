// The scene from above, one panel per planner, on one canvas.

import { FONT, drawPerson, drawRobot, drawTrail, label, ring } from "./bodies.js";
import { drawHeat, Heat } from "./heat.js";
import { alpha, palette } from "./palette.js";
import { drawPlan, planned } from "./plan.js";
import { View } from "./view.js";

const TRAIL = 6; // s
const LOOK_PACE = 1.6; // how much faster than real time the prediction plays
const PAUSE_AT_END = 0.7; // s

export class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    this.ctx = canvas.getContext("2d", { alpha: false });
    this.ground = document.createElement("canvas");
    this.world = null;
    this.looking = false; // the prediction plays forward
    this.lookStarted = 0;
    this.recolour();
  }

  show(world) {
    this.world = world;
    this.plans = world.panels.map(() => null);
    this.trails = world.panels.map(() => ({ robot: [], people: [] }));
    this.paths = [];
    this.views = [];
    this.size = null;
  }

  // Where everybody was, of a record: [[time, x, y], …] for the robot and for each person.
  history(panel, paths) {
    const points = (path) => path.filter((p) => p[1] !== null).map(([time, x, y]) => ({ time, at: [x, y] }));
    this.paths[panel] = { robot: points(paths.robot), people: paths.people.map(points) };
  }

  recolour() {
    this.colours = palette();
    this.heat = new Heat(this.colours);
    this.size = null;
    for (const plan of this.plans ?? []) if (plan) plan.painted = plan.heats.map((heat) => this.heat.paint(heat));
  }

  plan(message) {
    message.painted = message.heats.map((heat) => this.heat.paint(heat));
    this.plans[message.panel] = message;
  }

  look(on) {
    if (on && !this.looking) this.lookStarted = performance.now();
    this.looking = on;
  }

  // Steps ahead that are shown now, or null when the prediction does not play.
  instant(now, plan) {
    if (!this.looking || !plan) return null;
    const last = plan.positions.length - 1;
    const length = (last * plan.step) / LOOK_PACE + PAUSE_AT_END;
    const into = Math.max(0, (now - this.lookStarted) / 1000) % length;
    return Math.min(last, (into * LOOK_PACE) / plan.step);
  }

  layout() {
    const box = this.canvas.getBoundingClientRect();
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const size = [box.width, box.height, ratio, this.colours.key].join();
    if (size === this.size) return;
    this.size = size;
    this.canvas.width = Math.round(box.width * ratio);
    this.canvas.height = Math.round(box.height * ratio);
    this.outlines = [];
    const count = this.world.panels.length;
    const across = box.width >= box.height;
    this.views = this.world.panels.map((_, i) => {
      const part = across
        ? { x: (i * box.width) / count, y: 0, width: box.width / count, height: box.height }
        : { x: 0, y: (i * box.height) / count, width: box.width, height: box.height / count };
      const top = count > 1 ? 44 : 12;
      return { part, view: new View(this.world.bounds, { x: part.x + 10, y: part.y + top, width: part.width - 20, height: part.height - top - 12 }) };
    });
    this.drawGround(ratio);
  }

  // What does not move is drawn once: floor, one dot per metre, scale.
  drawGround(ratio) {
    this.ground.width = this.canvas.width;
    this.ground.height = this.canvas.height;
    const ctx = this.ground.getContext("2d");
    ctx.scale(ratio, ratio);
    ctx.fillStyle = this.colours.beyond;
    ctx.fillRect(0, 0, this.ground.width, this.ground.height);
    for (const { part, view } of this.views) {
      ctx.save();
      ctx.beginPath();
      ctx.rect(part.x, part.y, part.width, part.height);
      ctx.clip();
      this.drawFloor(ctx, part, view);
      ctx.restore();
    }
    if (this.views.length > 1) {
      const { part } = this.views[1];
      ctx.fillStyle = this.colours.edge;
      if (part.x > 0) ctx.fillRect(part.x - 0.5, 0, 1, part.height);
      else ctx.fillRect(0, part.y - 0.5, part.width, 1);
    }
  }

  drawFloor(ctx, part, view) {
    const [x0, y0, x1, y1] = this.world.bounds;
    const [a, b] = [view.point(x0, y0), view.point(x1, y1)];
    ctx.fillStyle = this.colours.floor;
    ctx.beginPath();
    ctx.roundRect(Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.abs(b[0] - a[0]), Math.abs(b[1] - a[1]), 10);
    ctx.fill();
    ctx.fillStyle = this.colours.dot;
    for (let x = Math.ceil(x0); x <= x1; x += 1) {
      for (let y = Math.ceil(y0); y <= y1; y += 1) {
        const [u, v] = view.point(x, y);
        ctx.fillRect(u - 1, v - 1, 2, 2);
      }
    }
    this.drawScale(ctx, part, view);
  }

  // Over what is predicted: nobody is expected inside a wall, and a blurred picture of it must not look so.
  drawWalls(view, i) {
    const walls = (this.outlines[i] ??= outline(this.world.walls, view));
    this.ctx.fillStyle = this.colours.wall;
    this.ctx.fill(walls);
  }

  drawScale(ctx, part, view) {
    const [x, y] = [part.x + 22, part.y + part.height - 22];
    ctx.fillStyle = this.colours.muted;
    ctx.fillRect(x, y, view.scale, 1.5);
    ctx.fillRect(x, y - 3, 1.5, 7);
    ctx.fillRect(x + view.scale - 1.5, y - 3, 1.5, 7);
    ctx.font = `450 11.5px ${FONT}`;
    ctx.textAlign = "left";
    ctx.fillText("1 m", x, y - 8);
  }

  draw(frame, now) {
    if (!this.world) return;
    this.layout();
    const { ctx } = this;
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    ctx.drawImage(this.ground, 0, 0);
    const ratio = this.canvas.width / this.canvas.getBoundingClientRect().width;
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (!frame) return;
    frame.panels.forEach((panel, i) => {
      if (!this.views[i]) return;
      const { part, view } = this.views[i];
      ctx.save();
      ctx.beginPath();
      ctx.rect(part.x, part.y, part.width, part.height);
      ctx.clip();
      this.drawPanel(view, frame, panel, i, now);
      if (frame.panels.length > 1) this.drawTitle(part, panel, i);
      ctx.restore();
    });
  }

  drawPanel(view, frame, panel, i, now) {
    const { ctx, colours, world } = this;
    const plan = this.plans[i];
    const radius = world.panels[i].radius;
    const instant = this.instant(now, plan);
    this.remember(this.trails[i], frame, panel);
    const trail = this.paths[i] ? this.passed(this.paths[i], frame.time) : this.trails[i];
    this.drawGoal(view, panel.goal);
    for (const painted of plan?.painted ?? []) drawHeat(ctx, view, painted, instant, instant === null ? 0.62 : 1);
    this.drawWalls(view, i);
    drawTrail(ctx, view, trail.robot.map((p) => p.at), colours.robot, 3);
    trail.people.forEach((points, j) => drawTrail(ctx, view, points.map((p) => p.at), world.people[j].you ? colours.you : colours.other, 2.5));
    if (plan && panel.status !== "arrived") drawPlan(ctx, view, colours, plan, { radius, robot: panel.robot });
    this.drawSafety(view, panel);
    panel.people.forEach((at, j) => this.drawPersonOf(view, panel, at, j));
    drawRobot(ctx, view, colours, { at: panel.robot, radius, status: panel.status, heading: panel.robot[2] });
    if (instant !== null) this.drawAhead(view, plan, radius, instant);
    if (frame.hand && i === 0) this.drawHand(view, frame, panel);
  }

  remember(trail, frame, panel) {
    if (trail.trip !== panel.trip) Object.assign(trail, { trip: panel.trip, robot: [] });
    const add = (points, at) => {
      if (at[0] === null) return;
      const last = points[points.length - 1];
      if (last && last.time > frame.time) points.length = 0;
      if (!last || frame.time - last.time > 0.1) points.push({ time: frame.time, at: [at[0], at[1]] });
      while (points.length && frame.time - points[0].time > TRAIL) points.shift();
    };
    add(trail.robot, panel.robot);
    panel.people.forEach((at, j) => add((trail.people[j] ??= []), at));
  }

  passed(paths, time) {
    const part = (points) => points.filter((p) => p.time <= time && p.time > time - TRAIL);
    return { robot: part(paths.robot), people: paths.people.map(part) };
  }

  drawGoal(view, goal) {
    const at = view.point(...goal);
    ring(this.ctx, at, 12, { colour: this.colours.robot, width: 2 });
    ring(this.ctx, at, 5, { colour: this.colours.robot, width: 2 });
  }

  // The circle that people's centres should stay out of, and the distance to the nearest of them.
  drawSafety(view, panel) {
    const { ctx, colours, world } = this;
    const near = panel.distance !== null && panel.distance < world.clearance;
    const at = view.point(panel.robot[0], panel.robot[1]);
    ring(ctx, at, world.clearance * view.scale, {
      colour: near ? colours.limit : alpha(colours.robot, 0.55), width: near ? 2.5 : 1.5, dash: near ? [] : [6, 5],
    });
    const other = panel.people[panel.nearest];
    if (!other || panel.distance === null || panel.distance > 4) return;
    const end = view.point(other[0], other[1]);
    ctx.save();
    ctx.setLineDash([2, 4]);
    ctx.lineWidth = 1.5;
    ctx.strokeStyle = colours.muted;
    ctx.beginPath();
    ctx.moveTo(...at);
    ctx.lineTo(...end);
    ctx.stroke();
    ctx.restore();
    const length = Math.hypot(end[0] - at[0], end[1] - at[1]) || 1;
    const [nx, ny] = [(at[1] - end[1]) / length, (end[0] - at[0]) / length];
    const aside = length < 90 ? 14 + 24 * Math.abs(nx) : 0; // beside the line where it is too short for the words
    const middle = [(at[0] + end[0]) / 2 + aside * nx, (at[1] + end[1]) / 2 + aside * ny];
    label(ctx, colours, `${panel.distance.toFixed(2)} m`, middle, { bold: near, colour: near ? colours.limit : colours.ink });
  }

  drawPersonOf(view, panel, at, j) {
    const { ctx, colours, world } = this;
    if (at[0] === null) return; // not there yet, or gone
    const person = world.people[j];
    const belief = panel.beliefs[j] ?? null;
    drawPerson(ctx, view, colours, { at, radius: person.radius, you: person.you, belief, walking: panel.walking[j] });
    if (!person.you && world.people.length > 4) return;
    const lines = [];
    if (person.you) lines.push(["you", true]);
    if (belief !== null) lines.push([`gives way? ${Math.round(100 * belief)} %`, false]);
    const [x, y] = view.point(at[0], at[1]);
    const away = y < view.point(panel.robot[0], panel.robot[1])[1] ? -1 : 1; // the robot's side is for the distance
    const start = y + away * (person.radius * view.scale + 22) - (away < 0 ? 17 * (lines.length - 1) : 0);
    lines.forEach(([text, bold], k) => label(ctx, colours, text, [x, start + 17 * k], { bold }));
  }

  drawAhead(view, plan, radius, instant) {
    const at = view.point(...planned(plan, instant));
    ring(this.ctx, at, radius * view.scale, { colour: this.colours.robot, width: 2, dash: [4, 3] });
    label(this.ctx, this.colours, `in ${(instant * plan.step).toFixed(1)} s`, [at[0], at[1] - radius * view.scale - 14], { bold: true, colour: this.colours.robot });
  }

  drawHand(view, frame, panel) {
    const { ctx, colours } = this;
    const you = this.world.people.findIndex((p) => p.you);
    const from = view.point(panel.people[you][0], panel.people[you][1]);
    const to = view.point(...frame.hand);
    ctx.save();
    ctx.strokeStyle = alpha(colours.you, 0.7);
    ctx.setLineDash([3, 4]);
    ctx.lineWidth = 2;
    ctx.beginPath();
    ctx.moveTo(...from);
    ctx.lineTo(...to);
    ctx.stroke();
    ctx.restore();
    ring(ctx, to, 14, { colour: colours.you, width: 2 });
  }

  drawTitle(part, panel, i) {
    const { ctx, colours } = this;
    label(ctx, colours, this.world.panels[i].title, [part.x + 18, part.y + 18], { align: "left", bold: true, size: 14 });
    label(ctx, colours, panel.score, [part.x + 18, part.y + 36], { align: "left", colour: colours.muted });
  }

  // Which panel lies under the screen point, and where in the world that is.
  under(u, v) {
    const found = this.views.find(({ part }) => u >= part.x && u < part.x + part.width && v >= part.y && v < part.y + part.height);
    return (found ?? this.views[0])?.view.world(u, v) ?? null;
  }
}

// All walls as one shape on the screen, all turning the same way: where two overlap, both fill.
function outline(walls, view) {
  const shape = new Path2D();
  for (const wall of walls) {
    const corners = wall.map(([x, y]) => view.point(x, y));
    const area = corners.reduce((sum, [x, y], i) => sum + x * corners.at(i - 1)[1] - y * corners.at(i - 1)[0], 0);
    if (area < 0) corners.reverse();
    corners.forEach(([u, v], i) => (i ? shape.lineTo(u, v) : shape.moveTo(u, v)));
    shape.closePath();
  }
  return shape;
}

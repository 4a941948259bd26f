// Frames arrive some twenty times a second; the screen is drawn more often. Shown is a moment slightly in the past,
// between two frames.

const DELAY = 0.075; // s behind the newest frame
const LARGEST_GAP = 0.6; // s; beyond it the clock jumps instead of catching up

export class Playback {
  constructor() {
    this.clear();
  }

  clear() {
    this.frames = [];
    this.clock = null;
    this.drawn = null;
  }

  push(frame) {
    const last = this.frames[this.frames.length - 1];
    if (last && frame.time < last.time) this.clear(); // a reset, or a look back
    if (last && frame.time === last.time) this.frames.pop();
    this.frames.push(frame);
    if (this.frames.length > 12) this.frames.shift();
  }

  // The frame to draw at `now` (ms), or null before the first.
  at(now) {
    if (this.frames.length === 0) return null;
    const newest = this.frames[this.frames.length - 1];
    const elapsed = this.drawn === null ? 0 : Math.min((now - this.drawn) / 1000, 0.25);
    this.drawn = now;
    const target = newest.running ? newest.time - DELAY : newest.time;
    if (this.clock === null || Math.abs(target - this.clock) > LARGEST_GAP) this.clock = target;
    if (newest.running) this.clock += elapsed * (newest.pace ?? 1);
    this.clock += (target - this.clock) * Math.min(1, elapsed * 6);
    this.clock = Math.min(this.clock, newest.time);
    let i = this.frames.length - 1;
    while (i > 0 && this.frames[i - 1].time > this.clock) i -= 1;
    if (i === 0) return newest.running ? this.frames[0] : newest;
    const [before, after] = [this.frames[i - 1], this.frames[i]];
    const share = Math.min(1, Math.max(0, (this.clock - before.time) / (after.time - before.time)));
    return between(before, after, share);
  }
}

function between(a, b, share) {
  const panels = b.panels.map((panel, i) => {
    const old = a.panels[i];
    if (!old || old.trip !== panel.trip) return panel;
    const people = panel.people.map((p, j) => (old.people[j] ? mix(old.people[j], p, share) : p));
    return { ...panel, robot: mix(old.robot, panel.robot, share), people };
  });
  return { ...b, time: a.time + (b.time - a.time) * share, panels };
}

// Linear in x and y; the third entry, where there is one, is an angle.
function mix(a, b, share) {
  if (a[0] === null || b[0] === null) return b;
  const out = [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share];
  if (b.length > 2) {
    const turn = b[2] === null || a[2] === null ? 0 : Math.atan2(Math.sin(b[2] - a[2]), Math.cos(b[2] - a[2]));
    out.push(a[2] === null ? b[2] : a[2] + turn * share);
  }
  return out;
}

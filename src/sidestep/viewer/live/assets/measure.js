// Frames drawn per second, round trip to the server, planning time: measured here, shown below the scene.

const KEPT = 240;

export class Measure {
  constructor(host, link) {
    this.host = host;
    this.link = link;
    this.gaps = []; // ms between drawn frames
    this.arrivals = []; // ms between received frames
    this.planning = []; // ms per planning step, of the first planner
    this.shown = 0;
  }

  drawn(now) {
    if (this.last) keep(this.gaps, now - this.last);
    this.last = now;
    if (now - this.shown > 1000) this.show(now);
  }

  frame() {
    const now = performance.now();
    if (this.received) keep(this.arrivals, now - this.received);
    this.received = now;
  }

  plan(plan) {
    if (plan.panel === 0 && plan.sample?.ms) keep(this.planning, plan.sample.ms);
  }

  report() {
    return {
      frames_per_second: 1000 / mean(this.gaps),
      frames_per_second_worst_twentieth: 1000 / quantile(this.gaps, 0.95),
      frames_received_per_second: 1000 / mean(this.arrivals),
      round_trip_ms: quantile(this.link.roundTrips, 0.5),
      planning_ms: quantile(this.planning, 0.5),
      planning_ms_worst_twentieth: quantile(this.planning, 0.95),
    };
  }

  show(now) {
    this.shown = now;
    const { frames_per_second: fps, round_trip_ms: trip, planning_ms: plan } = this.report();
    const parts = [`${Math.round(fps)} frames/s`, `round trip ${trip.toFixed(1)} ms`];
    if (Number.isFinite(plan)) parts.push(`planning ${plan.toFixed(1)} ms`);
    if (Number.isFinite(fps) && Number.isFinite(trip)) this.host.textContent = parts.join(" · ");
  }
}

function keep(values, value) {
  values.push(value);
  if (values.length > KEPT) values.shift();
}

function quantile(values, share) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted.length ? sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] : NaN;
}

function mean(values) {
  return values.reduce((a, b) => a + b, 0) / values.length;
}

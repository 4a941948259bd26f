// The page's own part: connects the server's frames with scene, charts, transport bar and keys.

import { Charts } from "./charts.js";
import { Link } from "./link.js";
import { Measure } from "./measure.js";
import { Playback } from "./playback.js";
import { Scene } from "./scene.js";
import { Steering } from "./steering.js";
import { Transport } from "./transport.js";

const SAY_EVERY = 3000; // ms between two readings aloud
const FULL = 4503; // closing code: no place is free

class App {
  constructor(host) {
    this.host = host;
    host.querySelector(".stage").innerHTML = `
      <canvas id="scene" tabindex="0" role="application" aria-describedby="keys"
        aria-label="The scene from above. Arrow keys walk, Shift hurries."></canvas>
      <div class="hint" hidden><strong>You are the person.</strong> <span class="coarse">Drag yourself with a finger.</span>
        <span class="fine">Drag yourself with the mouse, or walk with the arrow keys.</span></div>
      <div class="ready" role="status">Getting ready…</div>
      <div class="lost" role="alert" hidden></div>`;
    this.canvas = host.querySelector("#scene");
    this.words = host.querySelector(".words");
    this.spoken = host.querySelector(".spoken");
    this.hint = host.querySelector(".hint");
    this.scene = new Scene(this.canvas);
    this.charts = new Charts(host.querySelector(".charts"));
    this.playback = new Playback();
    this.said = 0;
    this.latest = null;
    this.link = new Link(address(host.dataset.token), {
      onMessage: (message) => this[`on_${message.type}`]?.(message),
      onState: (open, code) => this.connected(open, code),
    });
    this.measure = new Measure(host.querySelector(".measured"), this.link);
    this.transport = new Transport(host.querySelector(".transport"), this.link, this.scene);
    this.steering = new Steering({
      canvas: this.canvas, scene: this.scene, link: this.link, frame: () => this.latest,
      commands: {
        used: () => (this.hint.hidden = true),
        looking: () => this.transport.looking,
        key: (event) => this.transport.key(event),
      },
    });
    new MutationObserver(() => this.recolour()).observe(document.body, { attributes: true, attributeFilter: ["class"] });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recolour());
    document.addEventListener("visibilitychange", () => this.away(document.hidden));
    requestAnimationFrame((now) => this.draw(now));
  }

  // Nobody watches a hidden page: it pauses, and goes on when it is seen again.
  away(hidden) {
    if (hidden) this.interrupted = this.transport.running;
    if (this.interrupted) this.link.send({ type: hidden ? "pause" : "play" });
  }

  connected(open, code) {
    const lost = this.host.querySelector(".lost");
    lost.textContent = code === FULL ? "All places are taken at the moment. Trying again…" : "Connection lost. Trying again…";
    lost.hidden = open;
    if (open) this.playback.clear();
  }

  on_scene(world) {
    this.world = world;
    this.host.querySelector(".ready").hidden = true;
    this.host.dataset.mode = world.mode;
    this.host.querySelector("h1 small").textContent =
      world.mode === "live" ? "You are the pedestrian. The robot plans around you." : `A record: ${world.name}`;
    this.outcome(world.outcome ?? []);
    this.playback.clear();
    this.scene.show(world);
    this.charts.clear(world);
    this.transport.show(world);
    this.hint.hidden = world.mode !== "live" || this.hint.dataset.seen === "yes";
    this.hint.dataset.seen = "yes";
  }

  outcome(rows) {
    const list = document.createElement("dl");
    for (const [name, value] of rows) {
      list.append(Object.assign(document.createElement("dt"), { textContent: name }));
      list.append(Object.assign(document.createElement("dd"), { textContent: value }));
    }
    this.host.querySelector(".outcome").replaceChildren(Object.assign(document.createElement("h2"), { textContent: "What came of it" }), list);
  }

  on_frame(frame) {
    this.latest = frame;
    this.playback.push(frame);
    this.transport.update(frame);
    this.measure.frame(frame);
    this.say(frame);
  }

  on_plan(plan) {
    this.scene.plan(plan);
    if (plan.sample) this.charts.add(plan.panel, plan.sample);
    this.measure.plan(plan);
  }

  on_history(message) {
    this.charts.history(message.panel, message.samples);
    this.scene.history(message.panel, message.paths);
  }

  say(frame) {
    const words = [...frame.panels.map((panel) => panel.words), frame.trouble].filter(Boolean);
    if (words.join() === this.shownWords) return;
    this.shownWords = words.join();
    this.words.replaceChildren(
      ...frame.panels.map((panel, i) => {
        const line = document.createElement("p");
        line.dataset.status = panel.status;
        if (frame.panels.length > 1) line.append(Object.assign(document.createElement("b"), { textContent: `${this.world.panels[i].title}: ` }));
        line.append(panel.words);
        return line;
      }),
    );
    if (frame.trouble) this.words.append(Object.assign(document.createElement("p"), { textContent: frame.trouble }));
    const now = performance.now();
    if (now - this.said > SAY_EVERY) {
      this.said = now;
      this.spoken.textContent = words.join(" ");
    }
  }

  recolour() {
    this.scene.recolour();
    this.charts.dirty = true;
  }

  draw(now) {
    requestAnimationFrame((next) => this.draw(next)); // first, so that one bad picture does not stop all others
    const frame = this.playback.at(now);
    this.scene.draw(frame, now);
    const moving = frame && frame.time !== this.charted;
    if (frame && (moving || this.charts.dirty) && now - (this.chartsDrawn ?? 0) > 60) {
      this.charts.draw(frame.time, this.scene.colours);
      this.charts.dirty = false;
      this.charted = frame.time;
      this.chartsDrawn = now;
    }
    this.measure.drawn(now);
  }
}

function address(token) {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  return `${scheme}://${location.host}/live/stream/${token}`;
}

// The page's elements are put there by NiceGUI, some moments after this file has been read.
function start() {
  const host = document.querySelector("#live");
  if (!host?.querySelector(".measured")) return setTimeout(start, 30);
  window.sidestep = new App(host);
  return undefined;
}

start();

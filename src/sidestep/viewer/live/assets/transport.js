// Play, pause, step, reset, look ahead; and the scrubber of a record.

const ICONS = {
  play: '<path d="M7 4.5v15l12-7.5z"/>',
  pause: '<path d="M6 5h4.5v14H6zM13.5 5H18v14h-4.5z"/>',
  step: '<path d="M5 5v14l9-7zM16 5h3v14h-3z"/>',
  reset: '<path d="M12 5V1.5L6.5 6.5 12 11.5V8a5.5 5.5 0 1 1-5.5 5.5H3.5A8.5 8.5 0 1 0 12 5z"/>',
  look: '<path d="M12 5C6.5 5 2.5 9.5 1.5 12c1 2.5 5 7 10.5 7s9.5-4.500 10.500-7c-1-2.500-5-7-10.500-7zm0 11.200a4.200 4.200 0 1 1 0-8.400 4.200 4.200 0 0 1 0 8.400zm0-6.200a2 2 0 1 0 0 4 2 2 0 0 0 0-4z"/>',
};

export class Transport {
  constructor(host, link, scene) {
    this.link = link;
    this.scene = scene;
    this.looking = false;
    this.running = false;
    this.live = true;
    host.innerHTML = `
      <div class="buttons" role="group" aria-label="Playback">
        ${button("play", "Play or pause (space)")}${button("step", "One planning step (n)")}${button("reset", "Start again (r)")}
        ${button("look", "Play the prediction forward (f), or hover over the robot or a person")}
      </div>
      <label class="scrub" hidden><span class="clock"></span>
        <input type="range" min="0" value="0" step="1" aria-label="Position in the record"></label>`;
    this.button = (name) => host.querySelector(`[data-name=${name}]`);
    this.scrub = host.querySelector(".scrub");
    this.slider = host.querySelector("input");
    this.clock = host.querySelector(".clock");
    for (const name of Object.keys(ICONS)) this.button(name === "pause" ? "play" : name).onclick = () => this.press(name === "pause" ? "play" : name);
    this.slider.oninput = () => this.link.send({ type: "seek", index: Number(this.slider.value) });
  }

  press(name) {
    if (name === "look") this.look(!this.looking);
    else if (name === "play") this.link.send({ type: this.running ? "pause" : "play" });
    else this.link.send({ type: name });
  }

  look(on) {
    this.looking = on;
    this.scene.look(on);
    this.button("look").setAttribute("aria-pressed", String(on));
  }

  key(event) {
    const name = { " ": "play", n: "step", ".": "step", r: "reset", f: "look" }[event.key];
    if (!name || (event.key === " " && event.target instanceof HTMLButtonElement)) return false;
    this.press(name);
    return true;
  }

  show(world) {
    this.scrub.hidden = world.mode === "live";
    if (world.mode !== "live") this.slider.max = String(world.steps);
    this.world = world;
  }

  update(frame) {
    if (frame.running !== this.running) {
      this.running = frame.running;
      const play = this.button("play");
      play.querySelector("svg").innerHTML = ICONS[this.running ? "pause" : "play"];
      play.dataset.state = this.running ? "running" : "paused";
    }
    if (!this.scrub.hidden && frame.index !== undefined) {
      if (document.activeElement !== this.slider || this.running) this.slider.value = String(frame.index);
      this.clock.textContent = `${frame.time.toFixed(1)} / ${this.world.length.toFixed(1)} s`;
    }
  }
}

function button(name, title) {
  return `<button type="button" data-name="${name}" title="${title}" aria-label="${title}">
    <svg viewBox="0 0 24 24" width="22" height="22" aria-hidden="true" fill="currentColor">${ICONS[name]}</svg></button>`;
}

// Mouse, touch and keys → messages. Pressing steers; hovering near the robot or a person plays the prediction forward.

const ARROWS = {
  ArrowUp: [0, -1], ArrowDown: [0, 1], ArrowLeft: [-1, 0], ArrowRight: [1, 0],
  KeyW: [0, -1], KeyS: [0, 1], KeyA: [-1, 0], KeyD: [1, 0],
};
const HOVER = 1.3; // m around the robot or a person
const EVERY = 30; // ms between drag messages at most

export class Steering {
  constructor({ canvas, scene, link, commands, frame }) {
    Object.assign(this, { canvas, scene, link, commands, frame });
    this.held = new Set();
    this.dragging = false;
    this.sent = 0;
    this.backUntil = 0;
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) canvas.addEventListener(name, () => this.release());
    canvas.addEventListener("pointerleave", () => this.hover(null));
    window.addEventListener("keydown", (event) => this.key(event, true));
    window.addEventListener("keyup", (event) => this.key(event, false));
    window.addEventListener("blur", () => this.letGo());
    document.addEventListener("click", (event) => this.backToScene(event));
    document.addEventListener("focusin", (event) => this.keepBack(event));
    document.addEventListener("pointerdown", () => (this.backUntil = 0), true);
    document.addEventListener("keydown", (event) => (this.backUntil = event.key === "Tab" ? 0 : this.backUntil), true);
  }

  // Whoever sets a control with the mouse goes on walking with the keys; whoever does it with the keys stays where they are.
  backToScene(event) {
    const used = event.detail > 0 && event.target instanceof Element && event.target.closest(".q-slider, .q-menu [role=option], .buttons button");
    if (!used) return;
    this.backUntil = performance.now() + 1500;
    setTimeout(() => this.canvas.focus({ preventScroll: true }), 0);
  }

  // A menu that closes gives the focus back to its control, when it has faded out.
  keepBack(event) {
    if (performance.now() < this.backUntil && event.target !== this.canvas) this.canvas.focus({ preventScroll: true });
  }

  press(event) {
    if (event.button !== 0) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.dragging = true;
    this.scene.look(false);
    this.drag(event, true);
    this.commands.used();
  }

  move(event) {
    if (this.dragging) this.drag(event, false);
    else if (event.pointerType === "mouse") this.hover(event);
  }

  release() {
    if (!this.dragging) return;
    this.dragging = false;
    this.link.send({ type: "drag", point: null });
  }

  point(event) {
    const box = this.canvas.getBoundingClientRect();
    return this.scene.under(event.clientX - box.left, event.clientY - box.top);
  }

  drag(event, at_once) {
    const now = performance.now();
    if (!at_once && now - this.sent < EVERY) return;
    this.sent = now;
    const point = this.point(event);
    if (point) this.link.send({ type: "drag", point });
  }

  hover(event) {
    if (this.commands.looking()) return; // switched on by its button: hovering does not switch it off
    const point = event && this.point(event);
    const bodies = (this.frame()?.panels ?? []).flatMap((panel) => [panel.robot, ...panel.people]);
    this.scene.look(Boolean(point) && bodies.some(([x, y]) => x !== null && Math.hypot(x - point[0], y - point[1]) < HOVER));
  }

  key(event, down) {
    if (event.ctrlKey || event.metaKey || event.altKey || elsewhere(event.target)) return;
    if (event.code in ARROWS) {
      if (down) this.held.add(event.code);
      else this.held.delete(event.code);
      if (!event.repeat) this.walk(event.shiftKey);
      if (down) this.commands.used();
      event.preventDefault();
    } else if (event.key === "Shift") {
      if (this.held.size) this.walk(down);
    } else if (down && !event.repeat && this.commands.key(event)) {
      event.preventDefault();
    }
  }

  walk(hurry) {
    let [right, down] = [0, 0];
    for (const code of this.held) {
      right += ARROWS[code][0];
      down += ARROWS[code][1];
    }
    const view = this.scene.views[0]?.view;
    if (view) this.link.send({ type: "walk", direction: view.direction(right, down).map((v) => v + 0), hurry });
  }

  letGo() {
    if (this.held.size) {
      this.held.clear();
      this.walk(false);
    }
    this.release();
  }
}

// Keys belong to the control that has the focus, when it uses them itself.
function elsewhere(target) {
  if (!(target instanceof Element)) return false;
  return Boolean(target.closest("input, textarea, select, [contenteditable], [role=slider], [role=combobox], [role=listbox], [role=menu], [role=dialog], .q-slider, .q-select, .q-menu, .q-dialog"));
}

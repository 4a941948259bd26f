// World (m, y up) ↔ screen (px, y down). The world is turned by a quarter where that makes it larger on the screen.

export class View {
  constructor(bounds, box) {
    const [x0, y0, x1, y1] = bounds;
    const [width, height] = [x1 - x0, y1 - y0];
    const upright = Math.min(box.width / width, box.height / height);
    const turned = Math.min(box.width / height, box.height / width);
    this.turned = turned > 1.4 * upright;
    this.scale = this.turned ? turned : upright;
    this.box = box;
    this.middle = [(x0 + x1) / 2, (y0 + y1) / 2];
    this.centre = [box.x + box.width / 2, box.y + box.height / 2];
  }

  // A world vector (m) as a screen vector (px).
  along(dx, dy) {
    return this.turned ? [dy * this.scale, dx * this.scale] : [dx * this.scale, -dy * this.scale];
  }

  point(x, y) {
    const [u, v] = this.along(x - this.middle[0], y - this.middle[1]);
    return [this.centre[0] + u, this.centre[1] + v];
  }

  world(u, v) {
    const [du, dv] = this.direction(u - this.centre[0], v - this.centre[1]);
    return [this.middle[0] + du / this.scale, this.middle[1] + dv / this.scale];
  }

  // A screen vector (right, down) as a world vector of the same length.
  direction(right, down) {
    return this.turned ? [down, right] : [right, -down];
  }

  // A world angle (rad) as a screen angle (rad, clockwise from the right).
  angle(heading) {
    const [u, v] = this.along(Math.cos(heading), Math.sin(heading));
    return Math.atan2(v, u);
  }
}

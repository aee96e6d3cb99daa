// A time-stepped engine, as in games: bodies move by a step; then bodies that overlap and approach bounce.

import { Live } from "./live.mjs";

export class Stepped extends Live {
  /** Like `Live`, with a step in ticks. */
  until(end, deadline) {
    while (this.now + this.step <= end) {
      if (performance.now() > deadline) return false;
      this.now += this.step;
      this.bodies.forEach((body, at) => body.there && this.#bounce(body, at));
    }
    this.now = end;
    return true;
  }

  #bounce(body, at) {
    const [[x, y], [width, height]] = [this.place(body), this.arena];
    const walls = [[x, -body.vx], [width - x, body.vx], [y, -body.vy], [height - y, body.vy]];
    walls.forEach(([gap, speed], wall) => gap < body.radius && speed > 0 && this.happen({ kind: "wall", a: at, b: -1 - wall }));
    for (let other = at + 1; other < this.bodies.length; other += 1) {
      const second = this.bodies[other];
      const [left, up] = this.place(second);
      const [dx, dy] = [left - x, up - y];
      const nears = dx * (second.vx - body.vx) + dy * (second.vy - body.vy) < 0;
      if (second.there && nears && dx * dx + dy * dy < (body.radius + second.radius) ** 2) this.happen({ kind: "disc", a: at, b: other });
    }
  }
}

// The structure that a phase draws: shapes that hang on bodies, each present from one number of events to another.

import { compare } from "./clock.mjs";
import { apartAlong } from "./motion.mjs";

export const SHAPES = ["segment", "box", "polygon", "link", "entry"];
export const ENTRY = SHAPES.indexOf("entry");
const PLURALS = { axis: "axes" };
const ITSELF = [[0, 0]];
const STATES = ["old", "again", "fresh", "next"];

/** The plural of a role. */
export const plural = (role) => PLURALS[role] ?? `${role}s`;

/** A log of shapes (columns as in recording.py): it returns the shapes after any number of events. */
export class Structure {
  constructor(columns, labels, roles, seen) {
    Object.assign(this, columns);
    this.seen = seen; // the last number of events with a known structure
    this.labels = labels;
    this.roles = roles;
    this.start = new Int32Array(columns.size.length); // the index of each shape's first coordinate
    for (let shape = 1; shape < this.start.length; shape += 1) {
      this.start[shape] = this.start[shape - 1] + columns.size[shape - 1];
    }
    this.asked = -1;
    this.layered = -1;
  }

  /** The shapes that are present after a number of events, by their numbers; the lowest layer first. */
  at(done) {
    if (done !== this.asked) {
      this.asked = done;
      this.found = [];
      for (let shape = 0; shape < this.first.length; shape += 1) {
        if (this.first[shape] <= done && done < this.last[shape]) this.found.push(shape);
      }
    }
    return this.found;
  }

  /** The shapes that the last of a number of events has created and removed: {came, gone}. */
  changes(done) {
    this.ends ??= [this.first, this.last].map((column) => {
      const found = new Map();
      column.forEach((each, shape) => (found.has(each) ? found.get(each).push(shape) : found.set(each, [shape])));
      return found;
    });
    const [came, gone] = this.ends.map((found) => found.get(done) ?? []);
    return { came, gone };
  }

  /** True if a shape hangs on a body. */
  hangsOn(shape, body) {
    const first = this.start[shape];
    for (let at = first; at < first + this.size[shape]; at += 1) if (this.body[at] === body) return true;
    return false;
  }

  /** The shapes that fail first after a number of events, on a body unless that is null. */
  failing(done, body = null) {
    let found = [];
    let least = null;
    for (const shape of this.at(done)) {
      if (Number.isNaN(this.epoch[shape]) || (body !== null && !this.hangsOn(shape, body))) continue;
      const fails = [this.epoch[shape], this.tick[shape]];
      const order = least === null ? -1 : compare(fails, least);
      if (order < 0) [found, least] = [[shape], fails];
      else if (order === 0) found.push(shape);
    }
    return found;
  }

  /**
   * The present shapes after a number of events, in groups that look alike, the lowest layer first: {role, state,
   * shapes}. The state is "next" (it fails first), "fresh" (the last event has created it), "again" (the last event has
   * only rescheduled it) or "old".
   */
  layers(done) {
    if (done !== this.layered) {
      this.layered = done;
      const failing = new Set(this.failing(done));
      const groups = new Map();
      for (const shape of this.at(done)) {
        if (this.shape[shape] === ENTRY) continue; // it has no place in the scene
        const state = failing.has(shape) ? "next" : this.#age(shape, done);
        const key = (this.role[shape] * SHAPES.length + this.shape[shape]) * STATES.length + STATES.indexOf(state);
        let group = groups.get(key);
        if (!group) groups.set(key, (group = { role: this.roles[this.role[shape]], state, shapes: [] }));
        group.shapes.push(shape);
      }
      this.groups = [...groups.values()].sort((one, other) => STATES.indexOf(one.state) - STATES.indexOf(other.state));
      this.groups.sort((one, other) => this.roles.indexOf(one.role) - this.roles.indexOf(other.role));
    }
    return this.groups;
  }

  /** The news after a number of events: the shapes that are new, or else the shapes that fail next. */
  news(done) {
    const fresh = this.at(done).filter((shape) => SHAPES[this.shape[shape]] !== "entry" && this.isFresh(shape, done));
    return fresh.length ? fresh : this.failing(done);
  }

  /** True if the last of a number of events has created a shape. */
  isFresh(shape, done) {
    return this.#age(shape, done) === "fresh";
  }

  #age(shape, done) {
    if (done === 0 || this.first[shape] !== done) return "old";
    return this.fresh[shape] ? "fresh" : "again";
  }

  /** The entries of the matrix after a number of events: {a, b, role, label, fresh}. */
  entries(done) {
    const found = this.at(done).filter((shape) => SHAPES[this.shape[shape]] === "entry");
    return found.map((shape) => {
      const [a, b] = [this.body[this.start[shape]], this.body[this.start[shape] + 2]];
      const [role, label] = [this.roles[this.role[shape]], this.labels[this.label[shape]]];
      return { a, b, role, label, fresh: this.isFresh(shape, done) };
    });
  }

  /** True if a matrix is drawn, at any time. */
  get hasMatrix() {
    return this.shape.includes(SHAPES.indexOf("entry"));
  }

  /** The number of shapes of each role after a number of events, and the number of entries of the matrix. */
  counts(done) {
    const counts = {};
    let entries = this.at(done).length;
    for (const { role, shapes } of this.layers(done)) {
      const name = `${plural(role)} drawn`;
      counts[name] = (counts[name] ?? 0) + shapes.length;
      entries -= shapes.length;
    }
    if (entries) counts["in the matrix"] = entries;
    return counts;
  }

  /** The bodies that form a drawn pair with a body after a number of events. */
  partners(done, body) {
    const found = [];
    for (const shape of this.at(done)) {
      if (this.roles[this.role[shape]] !== "pair" || SHAPES[this.shape[shape]] !== "link") continue;
      const [a, b] = [this.body[this.start[shape]], this.body[this.start[shape] + 2]];
      if (a === body || b === body) found.push(a === body ? b : a);
    }
    return found.sort((one, other) => one - other);
  }

  /** The points [x, y] of a shape, with places of the bodies: {x, y}, and with periodic axes {kx, ky, periods}. */
  points(shape, places) {
    const found = [];
    for (let at = this.start[shape]; at < this.start[shape] + this.size[shape]; at += 2) {
      found.push([this.coordinate(shape, at, places), this.coordinate(shape, at + 1, places)]);
    }
    return found;
  }

  /** The shifts from a shape to its images that are visible in the box: [right, up] of each. */
  images(shape, places) {
    if (!places.periods) return ITSELF;
    const [across, upwards] = places.periods.map((period, axis) => {
      if (!period || this.#leader(shape, axis) < 0) return [0];
      const side = this.points(shape, places).map((point) => point[axis]);
      const first = Math.ceil(-Math.max(...side) / period);
      const count = Math.floor(1 - Math.min(...side) / period) - first + 1;
      return Array.from({ length: Math.max(count, 0) }, (_, at) => (first + at) * period);
    });
    return across.flatMap((right) => upwards.map((up) => [right, up]));
  }

  /** A shape as plain data, for comparisons. */
  plain(shape) {
    const own = { shape: SHAPES[this.shape[shape]], role: this.roles[this.role[shape]], label: this.labels[this.label[shape]] };
    const fails = Number.isNaN(this.epoch[shape]) ? null : [this.epoch[shape], this.tick[shape]];
    const coordinates = [];
    for (let at = this.start[shape]; at < this.start[shape] + this.size[shape]; at += 1) {
      coordinates.push([this.body[at], this.offset[at], this.turns?.[at] ?? 0]);
    }
    return { ...own, fails, coordinates };
  }

  /** A coordinate of a shape by its place in `body` and `offset`: x and y by turns. The shape's first body is at its displayed place; the others are beside it, through the shape's image; for a link, through the nearest. */
  coordinate(shape, at, places) {
    const body = this.body[at];
    if (body < 0) return this.offset[at];
    const axis = (at - this.start[shape]) & 1;
    const shown = axis ? places.y : places.x;
    const place = shown[body] + this.offset[at];
    const period = places.periods?.[axis];
    const leader = period ? this.#leader(shape, axis) : -1;
    if (leader < 0) return place;
    if (SHAPES[this.shape[shape]] === "link") return shown[leader] + apartAlong(shown[leader], place, period);
    const taken = axis ? places.ky : places.kx;
    return place + (this.turns[at] + taken[body] - taken[leader]) * period;
  }

  /** The first body of a shape on an axis; -1 if a coordinate is a fixed number. */
  #leader(shape, axis) {
    for (let at = this.start[shape] + axis; at < this.start[shape] + this.size[shape]; at += 2) if (this.body[at] < 0) return -1;
    return this.body[this.start[shape] + axis];
  }
}

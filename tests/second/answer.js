// Rules 7 to 10, and 7s: what happens in a scene, event by event.
//
// A scene is {bodies, turns, arena, periods, start}: bodies {x, y, vx, vy, r, m, shape}, r being that of rules 3 and 3s and m perhaps Infinity,
// turns {body, time, vx, vy} as they are written, an arena [W, H] or null, the periods of x and y, null for an axis that is not periodic, and a
// start time; all numbers doubles.

import { anchor, makePlan, tickLength, tickOf, unit, wrap } from "./clock.js";
import { BOTTOM, imageTick, LEFT, pairTick, RIGHT, TOP, wallTick } from "./contact.js";
import { along, exchange } from "./exchange.js";
import { sha256 } from "./sha256.js";
import { areDiscs, difference, shapeNormal, shapeTouch } from "./shapes.js";

export const CLOCK = 1;
export const TURN = 2;
export const WALL = 3;
export const PAIR = 4;
const SPAN = 1n << 61n;
const BEAT = 1n << 53n;

/** A scene as it goes on: `next` says what happens next, `happen` lets it happen. */
export class Run {
  constructor(scene) {
    const { bodies, turns, start, periods } = scene;
    this.scene = scene;
    this.periodic = periods.some((period) => period !== null);
    this.span = this.periodic ? BEAT : SPAN; // rules 8 and 8p
    this.e = unit(scene);
    this.q = tickLength(this.e);
    const differences = () => bodies.map((b, i) => bodies.slice(0, i).map((a) => difference(a.shape, b.shape)));
    this.differences = areDiscs(bodies) ? null : differences(); // rule 5s: differences[b][a], a < b
    this.alike = bodies.every(({ m }) => m === bodies[0].m);
    this.plans = bodies.map(({ x, y, vx, vy }) => wrap(makePlan(x, y, vx, vy, 0n), periods));
    this.turns = turns.map((turn) => ({ ...turn, tick: tickOf(turn.time, start, this.q) }));
    this.turns.sort((s, t) => order(s.tick, t.tick) || s.body - t.body || s.time - t.time); // the sort leaves equals as they are
    this.turned = 0; // how many turns have happened
    this.met = bodies.map(() => new Map()); // rules 7 and 7p: the bodies from which each body is barred, and the image [m, n]
    this.walls = bodies.map(() => null); // rule 6, {tick, wall} or null
    this.pairs = bodies.map((_, b) => new Array(b).fill(null)); // rules 5 and 5p, {tick, m, n} or null: pairs[b][a], a < b
    bodies.forEach((_, body) => this.predict(body));
  }

  /** The tick of a time. */
  tickOf(time) {
    return tickOf(time, this.scene.start, this.q);
  }

  /** The next event, {tick, class, a, b}, or null: at a turn b is null, at a wall its number. */
  next() {
    let first = null;
    const consider = (tick, kind, a, b) => {
      if (first !== null && (order(tick, first.tick) || kind - first.class || a - first.a || b - first.b) >= 0) return;
      first = { tick, class: kind, a, b };
    };
    // A tick j 2^61 with A < (j - 1) 2^61: the first such j is floor(A / 2^61) + 2.
    this.plans.forEach(({ A }, body) => consider((A / this.span + 2n) * this.span, CLOCK, body, null));
    if (this.turned < this.turns.length) consider(this.turns[this.turned].tick, TURN, this.turns[this.turned].body, null);
    this.walls.forEach((met, body) => met && consider(met.tick, WALL, body, met.wall));
    this.pairs.forEach((row, b) => row.forEach((met, a) => met && consider(met.tick, PAIR, a, b)));
    return first;
  }

  /** Lets the next event happen. */
  happen({ tick, class: kind, a, b }) {
    const { bodies, periods } = this.scene;
    const present = (body) => anchor(this.plans[body], tick, this.q, periods);
    if (kind === CLOCK) {
      this.write(a, present(a));
    } else if (kind === TURN) {
      const { vx, vy } = this.turns[this.turned];
      this.turned += 1;
      this.write(a, { ...present(a), vx, vy });
    } else if (kind === WALL) {
      const plan = present(a);
      if (b === LEFT || b === RIGHT) plan.vx = -plan.vx;
      if (b === BOTTOM || b === TOP) plan.vy = -plan.vy;
      this.write(a, plan);
    } else {
      const [planA, planB] = [present(a), present(b)];
      const { m, n } = this.pairs[b][a];
      const normal = this.differences ? shapeNormal(planA, planB, this.differences[b][a]) : this.discNormal(planA, planB, m, n);
      const [vxa, vya, vxb, vyb] = exchange(planA, planB, bodies[a].m, bodies[b].m, this.alike, normal);
      this.write(a, { ...planA, vx: vxa, vy: vya });
      this.write(b, { ...planB, vx: vxb, vy: vyb });
      this.met[a].set(b, [m, n]);
      this.met[b].set(a, [m, n]);
    }
    this.predict(a);
    if (kind === PAIR) this.predict(b);
  }

  /** The unit normal of two discs that meet through the image (m, n). */
  discNormal(planA, planB, m, n) {
    const { periods } = this.scene;
    const turns = [m + planB.kx - planA.kx, n + planB.ky - planA.ky];
    const [right, up] = turns.map((each, axis) => (periods[axis] === null ? 0 : Number(each) * periods[axis]));
    return along(planB.x - planA.x + right, planB.y - planA.y + up);
  }

  /** Gives a body a new plan, which ends its bars. */
  write(body, { x, y, vx, vy, A, kx, ky }) {
    this.plans[body] = makePlan(x, y, vx, vy, A, kx, ky);
    for (const other of this.met[body].keys()) this.met[other].delete(body);
    this.met[body].clear();
  }

  /** Asks rules 5 and 6 about a body anew. */
  predict(body) {
    const { bodies, arena, periods } = this.scene;
    if (arena) this.walls[body] = wallTick(this.plans[body], bodies[body].shape.sides, arena, this.q, periods);
    bodies.forEach((_, other) => {
      if (other === body) return;
      const [a, b] = other < body ? [other, body] : [body, other];
      this.pairs[b][a] = this.meeting(a, b, this.met[a].get(b) ?? null);
    });
  }

  /** The contact of two bodies a < b that have met through a barred image, or not yet: null. */
  meeting(a, b, barred) {
    const { bodies, periods } = this.scene;
    const asked = [this.plans[a], bodies[a].r, this.plans[b], bodies[b].r, this.q];
    if (this.periodic) return imageTick(...asked, periods, barred);
    if (barred !== null) return null;
    if (this.differences && bodies[a].m === Infinity && bodies[b].m === Infinity) return null; // rule 7s
    const tick = this.differences ? shapeTouch(this.plans[a], this.plans[b], this.differences[b][a], this.q)?.tick : pairTick(...asked);
    return (tick ?? null) === null ? null : { tick, m: 0n, n: 0n };
  }
}

/** The contacts of a scene up to and at the tick of a time, one after the other: {epoch, tick, a, b}, epoch and tick BigInts. */
export function* contacts(scene, until) {
  const run = new Run(scene);
  const end = run.tickOf(until);
  for (let event = run.next(); event !== null && event.tick <= end; event = run.next()) {
    run.happen(event);
    if (isContact(event)) yield entry(event);
  }
}

/** Whether an event stands in the answer. */
export function isContact(event) {
  return event.class === WALL || event.class === PAIR;
}

/** The entry of a contact in the answer. */
export function entry({ tick, a, b }) {
  return { epoch: tick >> 52n, tick: tick & ((1n << 52n) - 1n), a, b };
}

/** The fingerprint of a list of contacts. */
export function fingerprint(list) {
  const bytes = new DataView(new ArrayBuffer(24 * list.length));
  list.forEach(({ epoch, tick, a, b }, i) => {
    bytes.setBigInt64(24 * i, epoch, true);
    bytes.setBigInt64(24 * i + 8, tick, true);
    bytes.setInt32(24 * i + 16, a, true);
    bytes.setInt32(24 * i + 20, b, true);
  });
  return sha256(new Uint8Array(bytes.buffer));
}

function order(s, t) {
  return s < t ? -1 : s > t ? 1 : 0;
}

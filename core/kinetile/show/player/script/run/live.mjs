// Rules 3 to 10 of the specification for elastic discs in an arena with walls: a run that continues from any moment of
// a recorded one, with commands. Decisions are exact, in whole numbers, and results are the same doubles as everywhere;
// so the contacts are kinetile's. Every pair is checked, which is fast enough for some fifty discs.

import { momentOf, ticksOf } from "./clock.mjs";
import { parts, twoProduct } from "./doubles.mjs";
import { PLAN, positionAfter } from "./plan.mjs";
import { KINDS } from "./rows.mjs";

const FAR = 1n << 62n;
const SPAN = 1n << 61n; // ticks: the clock anchors a plan after two of these spans
const ROOM = 1e-12; // part of a radius by which inserted bodies may overlap
const MOST_ROWS = 20000; // limit of a run: a jam has contacts without end
const fractionBits = (double) => (double ? -parts(double)[1] : 0);

/** A double times 2^bits, which is whole. */
function scaled(double, bits) {
  const [whole, power] = parts(double);
  return whole && whole << BigInt(power + bits);
}

/** The root of a whole number above 0, rounded up, by Newton's iteration from above. */
function rootAbove(square) {
  let root = 1n << BigInt(2 * square.toString(16).length);
  for (let next = root - 1n; next < root; next = (root + square / root) >> 1n) root = next;
  return root * root < square ? root + 1n : root;
}

const floorDivide = (a, b) => (a < 0n && a % b ? a / b - 1n : a / b);
const lack = (a, b) => twoProduct(a, b)[1];

/** The part of the approach speed of bodies with masses m and o that the body of mass m takes (rules 9 and 11). */
function share(m, o, speed) {
  if (m === Infinity) return o === Infinity ? speed : 0;
  if (o === Infinity) return 2 * speed;
  const both = m + o;
  const part = both - m;
  const low = (m - (both - part)) + (o - part);
  const f = (2 * o) / both;
  const rest = ((2 * o - f * both) - lack(f, both) - low * f) / both;
  return f * speed + (lack(f, speed) + rest * speed);
}

export class Live {
  /**
 * A run that continues at a moment, from the plans in force there. `rows` are the rows before it, in lists as from
 * `rebuild`; the run appends its own.
   */
  constructor({ radius, mass }, { x, y, vx, vy, epoch, tick, there }, rows, moment, { unit, arena }) {
    Object.assign(this, { bodies: [], rows, arena, now: ticksOf(moment), isCut: false });
    this.tick = unit / 2 ** 52; // in the scene's time
    this.power = 52 - Math.round(Math.log2(unit)); // a tick is 2^-power
    radius.forEach((own, body) => {
      this.#enter(own, mass[body], [x[body], y[body]], [vx[body], vy[body]], ticksOf([epoch[body], tick[body]]), there[body] > 0);
    });
    for (let flight = 0; flight < 2 * rows.count; flight += 1) {
      const body = (flight % 2 ? rows.b : rows.a)[flight >> 1];
      if (body >= 0) this.bodies[body].flight = flight;
    }
    this.bodies.forEach((_, body) => this.#plan(body));
  }

  /** Adds a body; `flight` is the number of its plan: 2 * row + side. */
  #enter(radius, mass, [x, y], [vx, vy], since, there) {
    const flight = -2 * (this.bodies.length + 1); // without a row
    this.bodies.push({ radius, mass, x, y, vx, vy, since, there, flight, meets: [], wall: null });
  }

  /** The place of a body if it were anchored now, or at another tick. */
  place(plan, now = this.now) {
    return positionAfter(plan, Number(now - plan.since) * this.tick);
  }

  /** Gives a body another velocity, now. */
  turn(body, velocity) {
    this.#anchor(body);
    [this.bodies[body].vx, this.bodies[body].vy] = velocity;
    this.settle("turn", body, -5);
  }

  /** Inserts a disc of a radius and a mass at a place, now. Returns its number, or null without room. */
  insert([x, y], velocity, radius, mass) {
    const [width, height] = this.arena;
    const isFree = this.bodies.every((other) => {
      const [left, up] = this.place(other);
      const [dx, dy, reach] = [left - x, up - y, (radius + other.radius) - ROOM * (radius + other.radius)];
      return !other.there || dx * dx + dy * dy >= reach * reach;
    });
    if (!isFree || Math.min(x, width - x, y, height - y) < radius - ROOM * radius) return null;
    const body = this.bodies.length;
    this.#enter(radius, mass, [x, y], velocity, this.now, true);
    this.settle("insert", body, -7);
    return body;
  }

  /** Processes events up to the tick `end`, or until the page's clock reaches `deadline`. Returns true if all are done. */
  until(end, deadline = Infinity) {
    for (let event = this.#next(); event && event.tick <= end; event = this.#next()) {
      this.isCut = this.rows.count >= MOST_ROWS;
      if (this.isCut) return true;
      if (performance.now() > deadline) return false;
      this.now = event.tick;
      this.happen(event);
    }
    this.now = end;
    return true;
  }

  /** Processes an event {kind, a, b} now: for a wall, b is its number. */
  happen({ kind, a, b }) {
    this.#anchor(a);
    if (kind === "disc") this.#anchor(b);
    if (kind === "wall") this.bodies[a][b > -3 ? "vx" : "vy"] *= -1;
    if (kind === "disc") this.#exchange(a, b);
    this.settle(kind, a, b);
  }

  /** The next event: the first by its tick, then clock, walls, pairs, then by bodies. */
  #next() {
    let found = null;
    const offer = (tick, kind, a, b) => {
      if (tick !== null && (!found || tick < found.tick)) found = { tick, kind, a, b };
    };
    this.bodies.forEach(({ there, since }, a) => there && offer((since / SPAN + 2n) * SPAN, "anchor", a, -6));
    this.bodies.forEach(({ there, wall }, a) => there && wall && offer(wall[0], "wall", a, wall[1]));
    this.bodies.forEach(({ there, meets }, a) => there && meets.forEach((tick, b) => this.bodies[b].there && offer(tick, "disc", a, b)));
    return found;
  }

  #anchor(body) {
    const plan = this.bodies[body];
    [plan.x, plan.y] = this.place(plan);
    plan.since = this.now;
  }

  /** Records an event of the present tick, and computes the next contacts of its bodies. */
  settle(kind, a, b) {
    const { rows } = this;
    const both = b >= 0 ? [a, b] : [a];
    const [epoch, tick] = momentOf(this.now);
    for (const [name, value] of Object.entries({ kind: KINDS.indexOf(kind), a, b, epoch, tick })) rows[name][rows.count] = value;
    [0, 1].forEach((side) => {
      const plan = this.bodies[both[side]];
      for (const name of PLAN) rows[name][2 * rows.count + side] = plan?.[name] ?? NaN;
      rows.before[2 * rows.count + side] = Math.max(plan?.flight ?? -1, -1);
      if (plan) plan.flight = 2 * rows.count + side;
    });
    rows.count += 1;
    both.forEach((body) => this.#plan(body));
  }

  /** Computes the contacts of a body on its plan. */
  #plan(body) {
    const own = this.bodies[body];
    own.wall = own.there ? this.#wallOf(own) : null;
    this.bodies.forEach((other, at) => {
      if (at === body) return;
      const [a, b] = at < body ? [other, own] : [own, other];
      const isBarred = a.flight >> 1 === b.flight >> 1; // they have met, and neither has got another plan since (rule 7)
      a.meets[Math.max(at, body)] = own.there && other.there && !isBarred ? this.#meeting(a, b) : null;
    });
  }

  /** Rule 6: [tick, wall], or null. */
  #wallOf({ x, y, vx, vy, since, radius }) {
    const size = Math.max(...[x, y, radius, ...this.arena].map(fractionBits), ...[vx, vy].map((v) => fractionBits(v) + this.power));
    const whole = (double) => scaled(double, size);
    const reach = (at, speed, far, walls) => {
      if (!speed) return null;
      const gap = speed < 0 ? whole(at) - whole(radius) : whole(far) - whole(at) - whole(radius);
      const after = gap <= 0n ? 0n : gap / scaled(Math.abs(speed), size - this.power);
      return after < FAR ? [since + after, walls[speed < 0 ? 0 : 1]] : null;
    };
    const [across, up] = [reach(x, vx, this.arena[0], [-1, -2]), reach(y, vy, this.arena[1], [-3, -4])];
    return !up || (across && across[0] <= up[0]) ? across : up;
  }

  /** Rule 5: the tick of contact, or null. Doubles first exclude pairs that surely do not meet. */
  #meeting(a, b) {
    const since = a.since > b.since ? a.since : b.since;
    const [[fromX, fromY], [toX, toY]] = [a, b].map((body) => this.place(body, since));
    const [dx, dy] = [toX - fromX, toY - fromY];
    const [wx, wy] = [b.vx - a.vx, b.vy - a.vy];
    const far = [a, b].reduce((sum, { x, y }) => sum + Math.abs(x) + Math.abs(y), Math.abs(dx) + Math.abs(dy));
    const unsure = 1e-12 * far * [a, b].reduce((sum, { vx, vy }) => sum + Math.abs(vx) + Math.abs(vy), 0);
    if (dx * wx + dy * wy > unsure || Math.abs(dx * wy - dy * wx) > (a.radius + b.radius) * Math.hypot(wx, wy) * (1 + 1e-12) + unsure) return null;

    const lengths = [a.x, a.y, b.x, b.y, a.radius, b.radius];
    const size = Math.max(...lengths.map(fractionBits), ...[a.vx, a.vy, b.vx, b.vy].map((v) => fractionBits(v) + this.power));
    const [ax, ay, bx, by, ra, rb] = lengths.map((length) => scaled(length, size));
    const [avx, avy, bvx, bvy] = [a.vx, a.vy, b.vx, b.vy].map((speed) => scaled(speed, size - this.power));
    const [vx, vy, r] = [bvx - avx, bvy - avy, ra + rb];
    const x = bx + bvx * (since - b.since) - (ax + avx * (since - a.since));
    const y = by + bvy * (since - b.since) - (ay + avy * (since - a.since));
    const [nears, gap, square] = [x * vx + y * vy, x * x + y * y - r * r, vx * vx + vy * vy];
    if (nears >= 0n) return null;
    if (gap <= 0n) return square + 2n * nears < 0n ? since : null; // deeper at the next tick
    const under = nears * nears - square * gap;
    if (under <= 0n) return null;
    const after = floorDivide(-nears - rootAbove(under), square);
    const end = after + 1n; // a visit that is over by then does not count
    return after < FAR && gap + (2n * nears + square * end) * end < 0n ? since + after : null;
  }

  /** Rule 9: two anchored bodies exchange momentum. */
  #exchange(one, other) {
    const [a, b] = [this.bodies[one], this.bodies[other]];
    const [dx, dy] = [b.x - a.x, b.y - a.y];
    const length = Math.sqrt(dx * dx + dy * dy);
    const [nx, ny, ux, uy] = [dx / length, dy / length, b.vx - a.vx, b.vy - a.vy];
    const excess = ((nx * nx - 0.5) + (ny * ny - 0.5)) + (lack(nx, nx) + lack(ny, ny));
    const [px, py] = [ux * nx, uy * ny];
    const sum = px + py;
    const part = sum - px;
    const low = ((px - (sum - part)) + (py - part)) + (lack(ux, nx) + lack(uy, ny));
    const speed = sum + (low - sum * excess);
    const [ga, gb] = [share(a.mass, b.mass, speed), share(b.mass, a.mass, speed)];
    [a.vx, a.vy] = [a.vx + ga * nx, a.vy + ga * ny];
    [b.vx, b.vy] = [b.vx - gb * nx, b.vy - gb * ny];
  }
}

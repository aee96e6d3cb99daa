// Rules 3 to 10 of the specification for elastic discs in an arena with walls: a run that goes on from any moment of a
// recorded one, with commands. Decisions are exact, in whole numbers, and results are the same doubles as everywhere;
// so its contacts are those of kinetile. Every pair is checked, which is enough for some fifty discs.

import { momentOf, ticksOf } from "./clock.mjs";
import { parts, twoProduct } from "./doubles.mjs";
import { PLAN, positionAfter } from "./plan.mjs";
import { KINDS } from "./rows.mjs";

const FAR = 1n << 62n;
const SPAN = 1n << 61n; // ticks after two of which a plan is anchored by the clock
const ROOM = 1e-12; // of a radius: so much may bodies overlap that are inserted
const MOST_ROWS = 20000; // of a run: a jam has contacts without end
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

/** What a body of mass m takes of the speed at which it and one of mass o approach (rules 9 and 11). */
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
   * A run that goes on at a moment, from the plans in force there. `rows` are those before it, in lists as `rebuild` has
   * them; it goes on to fill them.
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

  /** A body more; `flight` is that of its plan: 2 * row + side. */
  #enter(radius, mass, [x, y], [vx, vy], since, there) {
    const flight = -2 * (this.bodies.length + 1); // of no row
    this.bodies.push({ radius, mass, x, y, vx, vy, since, there, flight, meets: [], wall: null });
  }

  /** The place of a body as if it were anchored now, or at another tick. */
  place(plan, now = this.now) {
    return positionAfter(plan, Number(now - plan.since) * this.tick);
  }

  /** Give a body another velocity, now. */
  turn(body, velocity) {
    this.#anchor(body);
    [this.bodies[body].vx, this.bodies[body].vy] = velocity;
    this.settle("turn", body, -5);
  }

  /** Insert a disc of a radius and a mass at a place, now. Return its number, or null where there is no room. */
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

  /** Process events up to the tick `end`, or until the clock of the page says `deadline`. Return whether all have. */
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

  /** An event {kind, a, b} happens now: at a wall b is its number. */
  happen({ kind, a, b }) {
    this.#anchor(a);
    if (kind === "disc") this.#anchor(b);
    if (kind === "wall") this.bodies[a][b > -3 ? "vx" : "vy"] *= -1;
    if (kind === "disc") this.#exchange(a, b);
    this.settle(kind, a, b);
  }

  /** The first event to come: by its tick, then clock, walls, pairs, then by bodies. */
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

  /** Write down an event of the present tick, and compute what its bodies meet next. */
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

  /** Compute what a body meets on its plan. */
  #plan(body) {
    const own = this.bodies[body];
    own.wall = own.there ? this.#wallOf(own) : null;
    this.bodies.forEach((other, at) => {
      if (at === body) return;
      const [a, b] = at < body ? [other, own] : [own, other];
      const isBarred = a.flight >> 1 === b.flight >> 1; // they have met, and nobody has had another plan since (rule 7)
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

  /** Rule 5: the tick of contact, or null. What surely is none is left out in doubles first. */
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
    const end = after + 1n; // a visit that is over by then is none
    return after < FAR && gap + (2n * nears + square * end) * end < 0n ? since + after : null;
  }

  /** Rule 9: two bodies that are anchored exchange momentum. */
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

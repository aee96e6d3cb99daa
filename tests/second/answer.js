// Rules 7 to 11, 8r to 9r and 7s: the events of a scene, one by one.
//
// A scene is {bodies, commands, responses, shaped, arena, periods, gravity, start, unit, until, end}: bodies {x, y, vx, vy, ax, ay, r, m, shape, kind}, with r as in
// rules 3 and 3s and m perhaps Infinity; commands and responses as in commands.js and responses.js; `shaped`, true unless all bodies are discs; an arena [W, H] or null;
// the periods of x and y, null for an axis that is not periodic; a gravity, a start time, and a unit, a time and an exact end, or null for each. All numbers are doubles.

import { anchor, largest, makePlan, tickLength, tickOf, unit, wrap } from "./clock.js";
import { inOrder } from "./commands.js";
import { nearest, whole } from "./exact.js";
import { exchange, gripped, speedAlong, takenAlong } from "./exchange.js";
import { hasRoom, overlaps } from "./overlaps.js";
import { isBetween, isSlow, leastAtWall, leastSpeed, offPressed, onSupport, pairSupports, stands, wallSpeed, wallSupport } from "./rest.js";
import { goThrough, mayPass, offWall, OUTWARD, pairResponse, returned, softened, stopped, wallResponse } from "./responses.js";
import { sha256 } from "./sha256.js";
import { alongFace, difference, shapeGap, shapeNormal } from "./shapes.js";
import { FAR } from "./signs.js";
import { imageTick, partTick, throughImage, touchTick } from "./touching.js";
import { leaveEnds, wallTick } from "./walls.js";

const CLOCK = 1;
const COMMAND = 2;
const WALL = 3;
const PAIR = 4;
const PART = 5;
const LEDGE = 0; // in place of a wall's number: a body leaves its support
const SPAN = 1n << 61n;
const BEAT = 1n << 53n;
const HARDLY_ANY = 1n << 20n; // ticks

const STILL = { vx: 0, vy: 0 };
const isHeldBy = ({ held }, support) => held.some(({ number }) => number === support);
const isSame = (one, two) => one.vx === two.vx && one.vy === two.vy;

/** A scene in progress: `events` runs all events; then `ended` is "end", or "no room" or "jam" if the answer ends before. */
export class Run {
  constructor(scene) {
    const { bodies, commands, start, periods } = scene;
    this.scene = scene;
    this.periodic = periods.some((period) => period !== null);
    this.span = this.periodic ? BEAT : SPAN; // rules 8 and 8p
    this.shaped = scene.shaped;
    this.e = unit(scene);
    this.q = tickLength(this.e);
    this.accelerated = largest([...bodies, ...commands], scene.gravity).some((most) => most > 0);
    const masses = [...bodies, ...commands.filter(({ what }) => what === "insertion")].map(({ m }) => m);
    this.alike = masses.every((m) => m === masses[0]);
    this.commands = inOrder(commands, start, this.q, bodies.length);
    this.commanded = 0; // the number of commands so far
    this.now = 0n;
    this.contacts = 0; // the number of contacts in the present tick
    this.crowd = { since: 0n, contacts: 0 }; // the number of contacts since a tick
    this.ended = null;
    this.bodies = new Map(); // by number: a body with its plan, its pairs, its wall {tick, wall} or null, and `last`, the C of rule 11
    this.pairs = new Set();
    bodies.forEach((body, number) => this.enter(number, body, makePlan(body.x, body.y, body.vx, body.vy, 0n, 0n, 0n, body.ax, body.ay)));
  }

  /** The tick of a time. */
  tickOf(time) {
    return tickOf(time, this.scene.start, this.q);
  }

  /** Yields all events, up to a time or, without one, to the end of the scene: {what, tick, a, b}; at an end of a passing, a > b. */
  *events(until = null) {
    const { tick, contacts } = until === null && this.scene.end ? this.scene.end : { tick: this.tickOf(until ?? this.scene.until), contacts: Infinity };
    for (const pair of [...this.pairs].sort(byNumbers)) yield* this.beginOverlaps(pair);
    for (;;) {
      const event = this.next();
      const isOver = event.tick > tick || (event.tick === tick && event.class >= WALL && this.contactsAt(tick) >= contacts);
      if (isOver) this.ended = "end";
      else if (this.isJammed()) this.ended = "jam";
      if (this.ended === null) yield* this.happen(event);
      if (this.ended !== null) return;
    }
  }

  /** The next event: {tick, class} and its subject; its tick is Infinity without a further event. */
  next() {
    let first = { tick: Infinity };
    const consider = (tick, kind, a, b, about) => {
      const later = tick > first.tick || (tick === first.tick && (kind - first.class || a - first.a || b - first.b) >= 0);
      if (!later) first = { tick, class: kind, a, b, ...about };
    };
    for (const body of this.bodies.values()) {
      // A tick j 2^61 with A < (j - 1) 2^61: the first such j is floor(A / 2^61) + 2.
      consider((body.plan.A / this.span + 2n) * this.span, CLOCK, body.number, 0, { body });
      if (body.met) consider(body.met.tick, WALL, body.number, body.met.wall, { body });
      if (body.leaves !== null) consider(body.leaves, WALL, body.number, LEDGE, { body, leaves: true }); // after its walls
    }
    for (const pair of this.pairs) {
      if (pair.met) consider(pair.met.tick, PAIR, pair.a.number, pair.b.number, { pair });
      for (const passing of pair.passings) if (passing.ends !== null) consider(passing.ends, PART, pair.a.number, pair.b.number, { pair, passing });
    }
    const command = this.commands[this.commanded];
    const isWaiting = command && first.tick === command.tick && this.contactsAt(command.tick) < command.contacts;
    if (command && !isWaiting) consider(command.tick, COMMAND, 0, 0, { command });
    return first;
  }

  /** True if bodies meet so often in hardly any time that it may continue without end: further events would not decide it. */
  isJammed() {
    if (this.crowd.contacts < 200 * this.bodies.size + 2000) return false;
    if (this.now - this.crowd.since < HARDLY_ANY) return true;
    this.crowd = { since: this.now, contacts: 0 };
    return false;
  }

  contactsAt(tick) {
    return tick === this.now ? this.contacts : 0;
  }

  *happen({ tick, class: kind, body, command, pair, passing, leaves }) {
    if (tick !== this.now) [this.now, this.contacts] = [tick, 0];
    if (kind === CLOCK) {
      this.write(body, this.present(body));
      yield this.told("clock", body.number, null);
    } else if (kind === COMMAND) {
      yield* this.obey(command);
    } else if (leaves) {
      this.free(body);
      this.freeFrom(body);
      yield this.told("leaving", body.number, null);
    } else if (kind === WALL) {
      const { wall } = body.met;
      const response = wallResponse(this.scene.responses, body.kind);
      const [until, held] = [body.plan, body.held];
      const plan = this.free(body);
      const slow = isSlow(response, wallSpeed(plan, wall));
      if (!slow || !this.settles(wallSupport(body, wall), new Map([[body, held]]), response)) {
        const least = leastAtWall(response, until, wall, this.q, this.mayRest, -wallSpeed(plan, wall), this.since(body.last));
        const [ox, oy] = offWall(plan, wall, response, this.share(response, body.last));
        const off = takenAlong({ vx: ox, vy: oy }, STILL, OUTWARD[wall], response);
        const isHop = least !== null && wallSpeed({ vx: off[0], vy: off[1] }, wall) < least;
        const [vx, vy] = isHop ? offPressed(off, wall, least) : off;
        this.write(body, { ...plan, vx, vy });
      }
      body.last = tick;
      this.freeFrom(body, until);
      yield this.told("wall", body.number, wall);
    } else if (kind === PART) {
      yield this.end(pair, passing);
    } else if (mayPass(pair.response) && goThrough(pair.response, pair.a, pair.b, this.normal(pair).normal)) {
      yield this.begin(pair, pair.met);
    } else {
      yield this.collide(pair);
    }
  }

  *obey(command) {
    const { what, body: number, x, y, vx, vy, ax, ay } = command;
    const body = this.bodies.get(number);
    this.commanded += 1;
    if (what === "turn") {
      this.write(body, { ...this.free(body), vx, vy });
      this.freeFrom(body);
    } else if (what === "acceleration") {
      body.whole = [ax, ay];
      this.free(body);
      if (body.m < Infinity) this.freeFrom(body);
    } else if (what === "kind") {
      if (!this.setKind(body, command.kind)) return;
    } else if (what === "insertion") {
      yield* this.insert(what, number, command, makePlan(x, y, vx, vy, this.now, 0n, 0n, ax, ay));
      return;
    } else if (what === "move") {
      const now = this.present(body);
      const plan = makePlan(x, y, now.vx, now.vy, this.now, 0n, 0n, ...body.whole);
      if (this.hasRoom({ ...body, x, y }, plan, body)) yield* this.remove(body);
      yield* this.insert(what, number, { ...body, x, y }, plan);
      this.freeFrom(body);
      return;
    } else {
      yield* this.remove(body);
      this.freeFrom(body);
    }
    yield this.told(what, number, null);
  }

  /** True if a body {x, y, and a body's fields} with a plan has room, beside all others or all but one. */
  hasRoom(command, plan, but = null) {
    const { arena, periods, responses } = this.scene;
    const others = [...this.bodies.values()].filter((each) => each !== but && !mayPass(pairResponse(responses, each.kind, command.kind)));
    const there = others.map((other) => ({ ...other, plan: this.present(other) }));
    return hasRoom(command, wrap(plan, periods), there, arena, periods, this.shaped);
  }

  /** Inserts or moves a body: it begins to pass the bodies that it overlaps and may pass. Without room the answer ends. */
  *insert(what, number, command, plan) {
    if (!this.hasRoom(command, plan)) {
      this.ended = "no room";
      return;
    }
    const { pairs } = this.enter(number, command, plan);
    yield this.told(what, number, null);
    for (const pair of pairs.sort(byNumbers)) yield* this.beginOverlaps(pair);
  }

  /** Removes a body, after the ends of its passings. */
  *remove(body) {
    for (const pair of body.pairs.sort(byNumbers)) for (const passing of [...pair.passings]) yield this.end(pair, passing);
    this.bodies.delete(body.number);
    for (const pair of body.pairs) {
      this.pairs.delete(pair);
      const other = pair.a === body ? pair.b : pair.a;
      other.pairs = other.pairs.filter((each) => each !== pair);
    }
  }

  /** Gives a body another kind; returns true if it may have that now (rule 11k). */
  setKind(body, kind) {
    const responses = body.pairs.map(({ a, b }) => pairResponse(this.scene.responses, kind, (a === body ? b : a).kind));
    if (body.pairs.some(({ passings }, i) => passings.length > 0 && !mayPass(responses[i]))) {
      this.ended = "no room";
      return false;
    }
    body.kind = kind;
    body.pairs.forEach((pair, i) => (pair.response = responses[i]));
    this.free(body);
    this.freeFrom(body);
    return true;
  }

  /** Gives two bodies that meet new plans. */
  collide(pair) {
    const { a, b, response, met } = pair;
    const [untilA, untilB, held] = [a.plan, b.plan, new Map([a, b].map((body) => [body, body.held]))];
    const meeting = this.normal(pair);
    const [planA, planB] = [this.free(a), this.free(b)];
    const { normal } = meeting;
    const C = a.last > b.last ? a.last : b.last;
    const speed = speedAlong(planA, planB, normal);
    const slow = isSlow(response, speed);
    const until = new Map([[a, untilA], [b, untilB]]);
    if (!slow || !this.settles(pairSupports(a, b, meeting, met, (f, m) => stands(held.get(f), until.get(f), m)), held, response)) {
      const k = this.share(response, C);
      let all = k === null ? stopped(planA, planB, a.m, b.m) : exchange(planA, planB, a.m, b.m, this.alike, normal, 0.5 * (1 + k) * speed);
      all = gripped({ vx: all[0], vy: all[1] }, { vx: all[2], vy: all[3] }, a.m, b.m, this.alike, normal, response);
      const [one, two] = [{ vx: all[0], vy: all[1] }, { vx: all[2], vy: all[3] }];
      const least = leastSpeed(response, untilA, untilB, one, two, normal, this.q, this.mayRest, -speed, this.since(C));
      const isHop = least !== null && speedAlong(one, two, normal) < least;
      if (isHop) all = exchange(one, two, a.m, b.m, this.alike, normal, 0.5 * (speedAlong(one, two, normal) - least));
      const [vxa, vya, vxb, vyb] = all;
      this.write(a, { ...planA, vx: vxa, vy: vya });
      this.write(b, { ...planB, vx: vxb, vy: vyb });
    }
    const counted = [a, b].filter(({ m }) => m < Infinity); // rule 11
    for (const body of counted.length ? counted : [a, b]) body.last = this.now;
    pair.justMet = met;
    this.predictPair(pair);
    this.freeFrom(a, untilA, b);
    this.freeFrom(b, untilB, a);
    return this.told("pair", a.number, b.number);
  }

  /** The normal of two bodies that meet now, and its face (rules 9 and 9s). */
  normal({ a, b, M, met }) {
    const [nowA, nowB] = [this.present(a), this.present(b)];
    return shapeNormal(nowA, nowB, this.away(nowA, nowB, met), M, this.q);
  }

  /** The k of a response now, with C the tick of the last contact; null if bodies come to rest. */
  share(response, C) {
    const since = this.since(C);
    return response.name === "stop" ? softened(since, this.q, this.accelerated) : returned(response, since);
  }

  /** True in a scene with a w (rule 11h). */
  get mayRest() {
    return this.accelerated && this.scene.responses.some(({ w }) => w > 0);
  }

  /** The time since the last contact, at a tick. */
  since(C) {
    return nearest(whole(this.now - C)) * this.q;
  }

  /** Releases a body from its supports, with its whole acceleration, and returns its plan (rule 9h). */
  free(body) {
    const [ax, ay] = body.whole;
    body.held = [];
    this.write(body, { ...this.present(body), ax, ay });
    return body.plan;
  }

  /** Releases all that a body holds (rule 9h): at a contact only if an immovable one's velocity differs from its former plan's, or the other does not rest on a movable one now. */
  freeFrom({ number, plan, m }, until = plan, other = null) {
    if (until !== plan && m === Infinity && isSame(until, plan)) return;
    if (other !== null && m < Infinity && isHeldBy(other, number)) return;
    for (const body of this.bodies.values())
      if (isHeldBy(body, number)) {
        this.free(body);
        this.freeFrom(body);
      }
  }

  /** Lets one of some bodies settle on a support, [body, support] each; returns true if one did (rule 9r); `held` has the supports until now, by body. */
  settles(supports, held, response) {
    const { w } = response;
    for (const [body, support] of supports) {
      const { plan, whole } = body;
      const [before, u] = [held.get(body), this.velocity(support)];
      const rel = { vx: plan.vx - u.vx, vy: plan.vy - u.vy };
      const isAlike = before.length === 1 && isSame(this.velocity(before[0]), u);
      if (isAlike && rel.vx * rel.vx + rel.vy * rel.vy <= w * w && isBetween(whole, before[0], support)) {
        body.held = [...before, support];
        this.write(body, { ...plan, ...u, ax: 0, ay: 0 });
        this.holdAgain(support, held);
        return true;
      }
      const rests = onSupport(rel, u, whole, support, this.scene.periods);
      if (rests === null) continue;
      body.held = [support];
      this.write(body, { ...plan, ...rests });
      if (body.leaves === null || body.leaves > this.now) {
        const [vx, vy] = takenAlong(rests, u, support.m, response);
        this.write(body, { ...plan, ...rests, vx, vy });
        this.holdAgain(support, held);
        return true;
      }
      body.held = [];
      this.write(body, plan);
    }
    return false;
  }

  /** Has a movable support held as it was until this event. */
  holdAgain({ number, face }, held) {
    const f = face === null ? null : this.bodies.get(number);
    if (f === null || f.m === Infinity) return;
    f.held = held.get(f);
    this.write(f, { ...f.plan, ax: 0, ay: 0 });
  }

  /** The velocity {vx, vy} of a support. */
  velocity({ number, face }) {
    if (face === null) return STILL;
    const { vx, vy } = this.bodies.get(number).plan;
    return { vx, vy };
  }

  /** The separation of two bodies that meet through the image (m, n), anchored: rule 9p. */
  away(planA, planB, { m, n }) {
    const { periods } = this.scene;
    const turns = [m + planB.kx - planA.kx, n + planB.ky - planA.ky];
    const [right, up] = turns.map((each, axis) => (periods[axis] === null ? 0 : Number(each) * periods[axis]));
    return [planB.x - planA.x + right, planB.y - planA.y + up];
  }

  /** Begins the passings of two bodies that may pass and overlap, at the start or at an insertion. */
  *beginOverlaps(pair) {
    const { a, b, response, M } = pair;
    if (!mayPass(response) || (this.shaped && a.m === Infinity && b.m === Infinity)) return; // rule 11s
    const [planA, planB] = [this.present(a), this.present(b)];
    const isIn = this.shaped && ((apart) => shapeGap(apart, M) < -(1e-12 * (a.r + b.r)));
    const images = overlaps({ r: a.r, plan: planA }, { r: b.r, plan: planB }, this.scene.periods, isIn);
    for (const image of images) yield this.begin(pair, image);
  }

  begin(pair, { m, n }) {
    pair.passings.push({ m, n, begun: this.now, ends: null });
    this.predictPair(pair);
    return this.told("begin", pair.a.number, pair.b.number);
  }

  end(pair, passing) {
    pair.passings.splice(pair.passings.indexOf(passing), 1);
    this.predictPair(pair);
    return this.told("end", pair.b.number, pair.a.number);
  }

  told(what, a, b) {
    const event = { what, tick: this.now, a, b };
    if (isContact(event)) [this.contacts, this.crowd.contacts] = [this.contacts + 1, this.crowd.contacts + 1];
    return event;
  }

  /** Puts a body among the others, anchored at the present tick. */
  enter(number, { r, m, shape, kind }, plan) {
    const body = { number, r, m, shape, kind, plan: wrap(plan, this.scene.periods), pairs: [], met: null, last: -FAR, whole: [plan.ax, plan.ay], held: [], leaves: null };
    for (const other of this.bodies.values()) {
      const [a, b] = other.number < number ? [other, body] : [body, other];
      const pair = { a, b, M: difference(a.shape, b.shape), response: pairResponse(this.scene.responses, a.kind, b.kind), met: null, justMet: null, passings: [] };
      for (const each of [a, b]) each.pairs.push(pair);
      this.pairs.add(pair);
    }
    this.bodies.set(number, body);
    this.predict(body);
    return body;
  }

  /** The plan of a body, anchored at the present tick. */
  present({ plan }) {
    return anchor(plan, this.now, this.q, this.scene.periods);
  }

  /** Gives a body a new plan; then it has just met no other body. */
  write(body, { x, y, vx, vy, A, kx, ky, ax, ay }) {
    body.plan = makePlan(x, y, vx, vy, A, kx, ky, ax, ay);
    for (const pair of body.pairs) pair.justMet = null;
    this.predict(body);
  }

  /** Applies rules 5, 6 and 11 to a body again. */
  predict(body) {
    const { arena, periods } = this.scene;
    body.met = arena && wallTick(body.plan, body.shape.sides, arena, this.q, periods);
    body.leaves = this.leaving(body);
    for (const pair of body.pairs) this.predictPair(pair);
  }

  /** The tick when a body leaves its support (rule 8r), or null. */
  leaving(body) {
    if (body.held.length !== 1 || body.held[0].face === null) return null;
    const [{ number, image, face }] = body.held;
    const { M, a, b } = body.pairs.find((pair) => pair.a.number === number || pair.b.number === number);
    const { ax, ay } = body.plan;
    const u = this.velocity(body.held[0]);
    const [vx, vy] = [body.plan.vx - u.vx, body.plan.vy - u.vy];
    const seen = body === b ? { vx, vy, ax, ay } : { vx: -vx, vy: -vy, ax: -ax, ay: -ay };
    const ticks = leaveEnds(alongFace(this.away(this.present(a), this.present(b), image), M, face, seen), M.strip, this.q);
    return ticks === null ? null : body.plan.A + ticks;
  }

  predictPair(pair) {
    pair.met = this.meeting(pair);
    for (const passing of pair.passings) {
      const tick = this.parting(pair, passing);
      passing.ends = tick !== null && tick <= passing.begun ? passing.begun + 1n : tick;
    }
  }

  /** The contact of two bodies, {tick, m, n} or null. */
  meeting(pair) {
    const { a, b, M, response, justMet, passings } = pair;
    if (this.shaped && a.m === Infinity && b.m === Infinity) return null; // rule 7s
    const holding = [...a.held.filter(({ number }) => number === b.number), ...b.held.filter(({ number }) => number === a.number)];
    const leftOut = [...passings, ...holding.map(({ image }) => image)]; // rules 11 and 5r
    const touch = (course, { m, n }) => touchTick(course, M, justMet?.m === m && justMet.n === n, mayPass(response) ? this.now : course.s);
    const image = { m: 0n, n: 0n };
    if (this.periodic) return imageTick(this.seen(pair, image), this.scene.periods, leftOut, touch);
    const tick = leftOut.length ? null : touch(this.seen(pair, image), image);
    return tick === null ? null : { tick, ...image };
  }

  /** The parting tick of two bodies that pass through an image. */
  parting(pair, image) {
    return partTick(this.seen(pair, image), pair.M, image.begun);
  }

  /** The flight of b relative to a, through an image. */
  seen({ a, b }, image) {
    return throughImage(a.plan, a.r, b.plan, b.r, this.q, this.scene.periods, image);
  }
}

/** Yields the contacts of a run, as far as its events go: {epoch, tick, a, b}, epoch and tick BigInts. */
export function* contacts(run, until = null) {
  for (const event of run.events(until)) if (isContact(event)) yield entry(event);
}

/** True if an event is in the answer. */
export function isContact({ what }) {
  return ["wall", "pair", "begin", "end"].includes(what);
}

/** The entry of a contact in the answer. */
export function entry({ tick, a, b }) {
  return { epoch: tick >> 52n, tick: tick & ((1n << 52n) - 1n), a, b };
}

const IN_BLOCK = 24 * 4096;

/** The fingerprint of a list of contacts: a chain over blocks of 4,096. */
export function fingerprint(list) {
  const bytes = new DataView(new ArrayBuffer(24 * list.length));
  list.forEach(({ epoch, tick, a, b }, i) => {
    bytes.setBigInt64(24 * i, epoch, true);
    bytes.setBigInt64(24 * i + 8, tick, true);
    bytes.setInt32(24 * i + 16, a, true);
    bytes.setInt32(24 * i + 20, b, true);
  });
  let digest = new Uint8Array(0);
  let begin = 0;
  for (; bytes.byteLength - begin > IN_BLOCK; begin += IN_BLOCK) {
    const hex = sha256(joined(digest, new Uint8Array(bytes.buffer, begin, IN_BLOCK)));
    digest = Uint8Array.from(hex.match(/../g), (byte) => Number.parseInt(byte, 16));
  }
  return sha256(joined(digest, new Uint8Array(bytes.buffer, begin)));
}

function joined(one, other) {
  const both = new Uint8Array(one.length + other.length);
  both.set(one);
  both.set(other, one.length);
  return both;
}

function byNumbers(one, two) {
  return one.a.number - two.a.number || one.b.number - two.b.number;
}

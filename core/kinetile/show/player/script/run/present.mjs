// Structures that follow from the positions of one moment: they are computed if a page has no recording of them.
//
// The tiling of sweep-tiling is the decomposition of the arena by the lines of the discs, each from its leftmost to its
// rightmost point at the height of its centre (thesis, section 4): a vertical bound goes from either end of a line up
// and down to the next lines. A sweep from left to right keeps the lines that it crosses, ordered by their height. Each
// disc has its bounds and boxes of sweep-and-prune. The failures of certificates do not follow from positions: none is
// shown. A phase sees discs that are wider by a skin. Bounds that tie are in the order of the arrival of their bodies.

import { TICKS, compare, elapsed } from "./clock.mjs";
import { planIn, positionAfter, velocityAfter } from "./plan.mjs";
import { INSERT, MOVE } from "./rows.mjs";
import { ENTRY, SHAPES, Structure } from "./structure.mjs";

const IN_MATRIX = 64; // bodies: the limit of a phase's matrix
const [SEGMENT, BOX, , LINK] = SHAPES.keys();
const LABELS = ["", "L", "R", "x", "y", "both"];
const FIXED = -1;
const [LEFT, RIGHT] = [-1, -2]; // the walls, as ends of tiles

/** The structures that can be computed, by a phase's `drawn_as`: functions that fill a sheet of shapes. */
const CONSTRUCTIONS = {
  tiling: (sheet, scene) => drawTiling(sheet, scene),
  "bounds x": (sheet, scene) => drawBounds(sheet, scene, 0),
  "bounds y": (sheet, scene) => drawBounds(sheet, scene, 1),
  boxes: (sheet, scene) => drawBoxes(sheet, scene),
};

/** The present structure of one run, recomputed for another moment. */
export class Present {
  /** `how`: a name of `CONSTRUCTIONS`; nothing is computed without an arena, with shapes or with periodic axes. */
  constructor({ drawn_as: how, skin }, bodies, held) {
    const plain = held.arena && !held.shapes.length && held.periods.every((period) => period === 0);
    const reach = bodies.radius.map((r) => (r || 0) + skin);
    const tie = Math.max(2 ** -46 * Math.max(...(held.arena ?? [0])), skin);
    Object.assign(this, { draw: plain ? CONSTRUCTIONS[how] : null, bodies, held, reach, tie, roles: Object.keys(held.looks) });
  }

  /** True if there is a matrix. */
  get hasMatrix() {
    return this.draw === CONSTRUCTIONS.boxes && this.bodies.x.length <= IN_MATRIX;
  }

  /** The structure of a motion at a moment, after a number of events, with places {x, y} of the bodies; null without one. */
  at(moment, done, motion, places) {
    if (!this.draw) return null;
    const { bodies, reach, tie, held: { arena, unit } } = this;
    const key = [...moment, done].join();
    if (this.key !== key) {
      this.key = key;
      const those = [...motion.plans.there.keys()].filter((body) => motion.plans.there[body]);
      const sheet = new Sheet(this.roles, those.length, this.held.pairs, bodies.mass);
      const isFirst = [0, 1].map((axis) => orderOf(axis, places, motion, moment, unit, axis ? tie : 2 ** -46 * Math.max(...arena)));
      this.draw(sheet, { those, places: [places.x, places.y], radius: reach, arena, isFirst });
      this.found = sheet.structure();
    }
    return this.found;
  }
}

/**
 * A comparison of two bodies, with the offsets of their bounds along an axis: true if the first bound is before the
 * second. Bounds closer than `tie` are compared by their plans, as certificates are: by the tick when one passes the
 * other; if neither does, by the order before the last change of their plans; at last R before L, then by number.
 */
function orderOf(axis, places, motion, moment, unit, tie) {
  const { rows, bodies, flights } = motion;
  const planOf = (body, flight) => {
    const [from, at, row] = flight < 0 ? [bodies, body, body] : [rows, flight, flight >> 1];
    const since = [from.epoch[row], from.tick[row]];
    return { row: flight >> 1, plan: planIn(from, at), since, before: flight < 0 || rows.kind[row] === INSERT || rows.kind[row] === MOVE ? null : rows.before[flight] };
  };
  const flown = ({ since }, time) => elapsed(time, ...since, unit);
  const edge = (one, offset, time) => positionAfter(one.plan, flown(one, time))[axis] + offset;
  const speed = (one, time) => velocityAfter(one.plan, flown(one, time))[axis];
  return (one, first, other, second) => {
    const apart = places["xy"[axis]][other] + second - (places["xy"[axis]][one] + first);
    if (Math.abs(apart) > tie) return apart > 0;
    let [p, q, now] = [planOf(one, flights[one]), planOf(other, flights[other]), moment];
    for (;;) {
      const since = compare(p.since, q.since) > 0 ? p.since : q.since;
      const [gap, rate] = [edge(q, second, since) - edge(p, first, since), speed(q, since) - speed(p, since)];
      if (rate !== 0) return (rate > 0) === (Math.floor((-gap / rate) * (TICKS / unit)) <= elapsed(now, ...since, TICKS));
      const back = [p.row >= q.row && p.before !== null, q.row >= p.row && q.before !== null];
      if (axis || !(back[0] || back[1])) return gap !== 0 && !axis ? gap > 0 : first === second || first * second > 0 ? one < other : first > 0;
      if (back[0]) p = planOf(one, p.before);
      if (back[1]) q = planOf(other, q.before);
      now = since;
    }
  };
}

/** Shapes of one moment, each of two points, in columns: some ten for each body, again in every frame. */
class Sheet {
  constructor(roles, bodies, paired, mass) {
    const room = 8 * bodies + 64;
    Object.assign(this, { roles, paired, mass });
    this.count = 0;
    this.columns = { shape: new Uint8Array(room), role: new Uint8Array(room), label: new Uint8Array(room), body: new Int32Array(4 * room), offset: new Float64Array(4 * room) };
  }

  /** Adds a shape from x, y to x, y: the body (-1: fixed) and the offset of each. */
  add(shape, role, label, xBody, x, yBody, y, otherXBody, otherX, otherYBody, otherY) {
    if (this.count === this.columns.shape.length) this.#grow();
    const { count, columns: { body, offset } } = this;
    this.columns.shape[count] = shape;
    this.columns.role[count] = this.roles.indexOf(role);
    this.columns.label[count] = LABELS.indexOf(label);
    const at = 4 * count;
    [body[at], body[at + 1], body[at + 2], body[at + 3]] = [xBody, yBody, otherXBody, otherYBody];
    [offset[at], offset[at + 1], offset[at + 2], offset[at + 3]] = [x, y, otherX, otherY];
    this.count += 1;
  }

  /** Adds a line between two bodies, if lines are drawn and one body is movable, or an entry of the matrix. */
  pair(a, b, role = "pair", shape = LINK, label = "") {
    if (shape === LINK && (!this.paired || Math.min(this.mass[a], this.mass[b]) === Infinity)) return;
    const [low, high] = [Math.min(a, b), Math.max(a, b)];
    this.add(shape, role, label, low, 0, low, 0, high, 0, high, 0);
  }

  structure() {
    const { count } = this;
    const columns = Object.fromEntries(Object.entries(this.columns).map(([name, column]) => [name, column.subarray(0, (column.length / this.columns.shape.length) * count)]));
    const never = new Float64Array(count).fill(NaN);
    return new Structure({ ...columns, size: new Uint8Array(count).fill(4), first: new Uint8Array(count), last: new Float64Array(count).fill(Infinity), fresh: new Uint8Array(count), epoch: never, tick: never }, LABELS, this.roles, Infinity);
  }

  #grow() {
    for (const [name, column] of Object.entries(this.columns)) {
      this.columns[name] = new column.constructor(2 * column.length);
      this.columns[name].set(column);
    }
  }
}

/** The place of a body in a list of bodies by height: before the first that is not lower. */
function rank(lines, body, isLower) {
  let [low, high] = [0, lines.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (lines[middle] !== body && isLower(lines[middle], 0, body, 0)) low = middle + 1;
    else high = middle;
  }
  return low;
}

function drawTiling(sheet, { those, places: [, y], radius, arena: [width, height], isFirst: [isLeft, isLower] }) {
  const ends = new Int32Array(2 * those.length);
  those.forEach((body, at) => {
    [ends[2 * at], ends[2 * at + 1]] = [2 * body, 2 * body + 1];
  });
  const offsetOf = (end) => (end & 1 ? radius[end >> 1] : -radius[end >> 1]);
  ends.sort((one, other) => (isLeft(one >> 1, offsetOf(one), other >> 1, offsetOf(other)) ? -1 : 1));
  const lines = []; // the lines that the sweep crosses, from below
  const since = [LEFT]; // the left ends of the tile below each line, and of the tile above the last
  const pairs = new Set();
  const close = (at, right) => {
    const [low, high] = [lines[at - 1] ?? FIXED, lines[at] ?? FIXED];
    const left = since[at];
    sheet.add(
      BOX, "tile", "",
      left < 0 ? FIXED : left >> 1, left < 0 ? 0 : offsetOf(left), low, 0,
      right < 0 ? FIXED : right >> 1, right < 0 ? width : offsetOf(right), high, high < 0 ? height : 0,
    );
    if (low >= 0 && high >= 0) pairs.add(Math.min(low, high) * y.length + Math.max(low, high));
  };
  const bounds = new Int32Array(2 * ends.length); // the lines at which the bound of an end ends, below and above
  ends.forEach((end, nth) => {
    const body = end >> 1;
    let at = rank(lines, body, isLower);
    if (end & 1) {
      if (lines[at] !== body) at = lines.indexOf(body); // another body of the same height
      close(at, end);
      close(at + 1, end);
      lines.splice(at, 1);
      since.splice(at, 2, end);
    } else {
      close(at, end);
      lines.splice(at, 0, body);
      since.splice(at, 1, end, end);
    }
    bounds[2 * nth] = lines[at - 1] ?? FIXED;
    bounds[2 * nth + 1] = (end & 1 ? lines[at] : lines[at + 1]) ?? FIXED;
  });
  for (let at = lines.length; at >= 0; at -= 1) close(at, RIGHT);
  ends.forEach((end, nth) => {
    const [low, high, body, offset] = [bounds[2 * nth], bounds[2 * nth + 1], end >> 1, offsetOf(end)];
    sheet.add(SEGMENT, "bound", end & 1 ? "R" : "L", body, offset, low, 0, body, offset, high, high < 0 ? height : 0);
  });
  for (const pair of pairs) sheet.pair(Math.floor(pair / y.length), pair % y.length);
}

function drawBounds(sheet, { those, radius, arena }, axis) {
  const add = (role, label, one, foot, other, head) => {
    if (axis) sheet.add(SEGMENT, role, label, ...foot, ...one, ...head, ...other);
    else sheet.add(SEGMENT, role, label, ...one, ...foot, ...other, ...head);
  };
  const foot = [FIXED, 0];
  add("axis", "xy"[axis], foot, foot, [FIXED, arena[axis]], foot);
  for (const body of those) {
    add("bound", "L", [body, -radius[body]], foot, [body, -radius[body]], [body, 0]);
    add("bound", "R", [body, radius[body]], foot, [body, radius[body]], [body, 0]);
  }
}

function drawBoxes(sheet, { those, places: [x], radius, isFirst }) {
  for (const body of those) {
    const r = radius[body];
    sheet.add(BOX, "bound", "", body, -r, body, -r, body, r, body, r);
  }
  const isBefore = (axis, a, b) => isFirst[axis](a, -radius[a], b, radius[b]);
  const near = (axis, a, b) => isBefore(axis, a, b) && isBefore(axis, b, a);
  const sorted = [...those].sort((a, b) => x[a] - radius[a] - (x[b] - radius[b]));
  const withMatrix = those.length <= IN_MATRIX;
  sorted.forEach((a, at) => {
    for (let next = at + 1; next < sorted.length; next += 1) {
      const b = sorted[next];
      const [onX, onY] = [near(0, a, b), near(1, a, b)];
      if (!onX && !withMatrix) break;
      if (onX && onY) sheet.pair(a, b);
      if (withMatrix && (onX || onY)) sheet.pair(a, b, onX && onY ? "pair" : "bound", ENTRY, onX && onY ? "both" : onX ? "x" : "y");
    }
  });
}

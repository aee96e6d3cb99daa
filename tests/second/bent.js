// Rules 2a, 5a, 6a, 7a, 8r and 11a: bodies with accelerations. Everything is decided by the signs of a polynomial at whole ticks; null is "none".
//
// A polynomial is the list of its coefficients, BigInts, from that of n^0 on. Between two zeros of its derivative it is monotone.

import { BOTTOM, FAR, LEFT, RIGHT, dot } from "./contact.js";
import { add, exact, minus, multiply, sign, square, subtract } from "./exact.js";

const HALF = { n: 1n, e: -1 };
const TWO = { n: 1n, e: 1 };

/** The acceleration of a body: its own, or else that of gravity, or none if it is immovable. */
export function acceleration({ own, m }, gravity) {
  const [ax, ay] = own ?? (m === Infinity ? [0, 0] : gravity);
  return { ax, ay };
}

/** The largest |ax| and |ay| of gravity, and of all bodies and commands (rule 3a). */
export function largest(all, gravity) {
  return ["ax", "ay"].map((key, axis) => Math.max(Math.abs(gravity[axis]), ...all.map((each) => Math.abs(each[key] ?? 0))));
}

/** Says what is wrong with a scene that has accelerations (rule 2a). */
export function checkBent({ gravity, arena, periods, bodies, commands, until }) {
  const every = [...bodies, ...commands.filter(({ what }) => what === "insertion")];
  const [Ax, Ay] = largest([...bodies, ...commands], gravity);
  if (Ax === 0 && Ay === 0) return;
  if (arena === null && until === null) throw new Error("A body is accelerated, and there is no arena, and no end.");
  if ([Ax, Ay].some((most, axis) => most !== 0 && periods[axis] !== null)) throw new Error("A body is accelerated along a periodic axis.");
  const massOf = (number) => bodies[number]?.m ?? every.find(({ body }) => body === number)?.m;
  const isMoved = ({ m, body, ax, ay }) => (m ?? massOf(body)) === Infinity && (ax !== 0 || ay !== 0);
  if ([...every, ...commands.filter(({ what }) => what === "acceleration")].some(isMoved)) throw new Error("A body of infinite mass is accelerated.");
}

/** The gap between a wall and a body at a place that reaches r towards it (rule 6s). */
function gap({ x, y }, r, wall, [W, H]) {
  const [place, side] = wall === LEFT || wall === RIGHT ? [x, W] : [y, H];
  const free = wall === LEFT || wall === BOTTOM ? exact(place) : subtract(exact(side), exact(place));
  return subtract(free, exact(r));
}

/** The ticks from its anchor to the contact of a plan that reaches r towards a wall with it (rule 6a). */
export function bentWall(plan, r, wall, arena, q) {
  const [speed, pull] = wall === LEFT || wall === RIGHT ? [plan.vx, plan.ax] : [plan.vy, plan.ay];
  const seen = wall === LEFT || wall === BOTTOM ? (each) => each : minus;
  const bend = multiply(multiply(HALF, exact(pull)), multiply(exact(q), exact(q)));
  return firstFall(whole([gap(plan, r, wall, arena), seen(multiply(exact(speed), exact(q))), seen(bend)]), 0n);
}

/** The tick at which two bodies meet, as `relative` has them, from a tick on; `barred` if they have just met (rules 5a and 7a). */
export function bentTouch(course, q, barred, from) {
  const Q = squareLess(way(course, q), square(course.R));
  const rise = barred && !presses(Q) ? firstRise(Q) : 0n;
  const start = from - course.s;
  const ticks = rise === null ? null : firstFall(Q, start > rise ? start : rise);
  return ticks === null ? null : course.s + ticks;
}

/** The tick at which two bodies part, as `relative` has them, that have begun to pass at a tick (rule 11a). */
export function bentPart(course, q, begun) {
  const start = begun - course.s;
  const Q = squareLess(way(course, q), square(course.R));
  const ticks = firstFall(Q.map((each) => -each), start > 0n ? start : 0n);
  return ticks === null ? null : course.s + ticks;
}

/** What makes d(n), the separation at s + n: d(n) = d + step n + bend n^2. */
export function way({ d, v, a }, q) {
  const bend = a.map((each) => multiply(multiply(HALF, each), square(exact(q))));
  return [d, v.map((each) => multiply(each, exact(q))), bend];
}

/** |d(n)|^2 - c. */
export function squareLess([d, step, bend], c) {
  const twice = (one, other) => multiply(TWO, dot(one, other));
  return whole([subtract(dot(d, d), c), twice(d, step), add(dot(step, step), twice(d, bend)), twice(step, bend), dot(bend, bend)]);
}

/** Exact numbers as whole ones, all times the same power of two. */
export function whole(numbers) {
  const lowest = Math.min(...numbers.map(({ e }) => e));
  return numbers.map(({ n, e }) => n << BigInt(e - lowest));
}

/** The ticks from an anchor until a body is beyond an end of a face by more than w (rule 8r): there its first and second corner are u and u2 before it, as it flies along with s and is accelerated by c. */
export function leaveEnds({ u, u2, s, c }, w, q) {
  const [step, bend] = [multiply(exact(s), exact(q)), multiply(multiply(HALF, exact(c)), square(exact(q)))];
  const ends = [[add(exact(u), w), step, bend], [subtract(w, exact(u2)), minus(step), minus(bend)]];
  const found = ends.map((p) => firstFall(whole(p), 0n)).filter((n) => n !== null);
  return found.length ? found.sort(inOrder)[0] : null;
}

/** The first n from `start` on with p(n + 1) < min(0, p(n)). */
function firstFall(p, start) {
  const ends = pieces(p, start);
  for (let i = 1; i < ends.length; i += 1) {
    const [low, high] = [ends[i - 1], ends[i]];
    if (at(p, high) < 0n && at(p, high) < at(p, low)) return lastBefore((n) => at(p, n + 1n) < 0n, low - 1n, high - 1n) + 1n;
  }
  return null;
}

/** Whether p does not rise from 0 to 1, and falls more from 1 to 2. */
function presses(p) {
  const [zero, one, two] = [0n, 1n, 2n].map((n) => at(p, n));
  return one <= zero && two - one < one - zero;
}

/** The first n from 0 on with p(n + 1) > p(n). */
function firstRise(p) {
  const ends = pieces(p, 0n);
  const rising = ends.findIndex((end, i) => i + 1 < ends.length && at(p, ends[i + 1]) > at(p, end));
  return rising < 0 ? null : ends[rising];
}

/** The first n from `start` on, before `end`, for which something holds that depends on no more than the signs of some polynomials at n and at n + 1. */
export function firstWhere(holds, polynomials, start, end = FAR) {
  const changes = polynomials.flatMap((p) => signChanges(p, start, end));
  const every = [start, ...changes.flatMap((n) => [n - 1n, n])].filter((n) => n >= start && n < end);
  return every.sort(inOrder).find(holds) ?? null;
}

export function inOrder(one, two) {
  return one < two ? -1 : one > two ? 1 : 0;
}

/** Each n after `start`, up to `end`, at which p has another sign than at n - 1. */
export function signChanges(p, start, end = FAR) {
  const signAt = (n) => sign({ n: at(p, n) });
  return pieces(p, start, end).flatMap((high, i, ends) => {
    const [low, here, there] = [ends[i - 1] ?? high, signAt(ends[i - 1] ?? high), signAt(high)];
    if (here === there) return [];
    return [(n) => signAt(n) !== here, (n) => signAt(n) === there].map((holds) => lastBefore(holds, low, high) + 1n);
  });
}

/** p(n + 1) - p(n). */
export function growth(p) {
  const next = [...p];
  p.forEach((_, i) => {
    for (let j = p.length - 2; j >= i; j -= 1) next[j] += next[j + 1];
  });
  return next.slice(0, -1).map((each, i) => each - p[i]);
}

/** Whole numbers from `start` to `end`, in their order: between two neighbours p is monotone, or they are 1 apart. */
function pieces(p, start, end = FAR) {
  if (p.length < 3 || start >= end) return start < end ? [start, end] : [];
  const derivative = p.slice(1).map((each, i) => each * BigInt(i + 1));
  const ends = pieces(derivative, start, end);
  const zeros = ends.flatMap((high, i) => {
    const low = ends[i - 1] ?? high;
    const [here, there] = [at(derivative, low), at(derivative, high)];
    if (here === 0n || there === 0n || here > 0n === there > 0n) return [high];
    const last = lastBefore((n) => here > 0n !== at(derivative, n) > 0n || at(derivative, n) === 0n, low, high);
    return [last, last + 1n, high];
  });
  return zeros.filter((each, i) => i === 0 || each > zeros[i - 1]);
}

/** The last whole number before that for which something holds; it does from there to `high`, and not at `low`. */
function lastBefore(holds, low, high) {
  while (high - low > 1n) {
    const middle = (low + high) >> 1n;
    [low, high] = holds(middle) ? [low, middle] : [middle, high];
  }
  return low;
}

export function at(p, n) {
  return p.reduceRight((value, each) => value * n + each, 0n);
}

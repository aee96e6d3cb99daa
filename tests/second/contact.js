// Rules 5, 6 and 11: when two bodies meet or part, and when a body meets a wall. Everything here is exact; null is "none".

import { add, exact, floorLaterRoot, floorQuotient, floorRoot, minus, multiply, sign, subtract, whole } from "./exact.js";
import { bentWall } from "./bent.js";
import { place, velocityAt } from "./clock.js";

export const FAR = 1n << 62n;
const LONGEST = 1n << 54n; // the ticks for which a plan is kept, where an axis is periodic
export const LEFT = -1;
export const RIGHT = -2;
export const BOTTOM = -3;
export const TOP = -4;

/** How body 2 flies as seen from body 1: the later anchor s, the separation d and the relative velocity v at it, the relative acceleration a, and the sum R of the radii. */
export function relative(plan1, r1, plan2, r2, q) {
  const s = plan1.A > plan2.A ? plan1.A : plan2.A;
  const [x1, y1] = place(plan1, s, q);
  const [x2, y2] = place(plan2, s, q);
  const d = [subtract(x2, x1), subtract(y2, y1)];
  const [[vx1, vy1], [vx2, vy2]] = [velocityAt(plan1, s, q), velocityAt(plan2, s, q)];
  const a = [subtract(plan2.exact.ax, plan1.exact.ax), subtract(plan2.exact.ay, plan1.exact.ay)];
  return { s, d, v: [subtract(vx2, vx1), subtract(vy2, vy1)], a, R: add(exact(r1), exact(r2)) };
}

/** The tick at which two bodies with these plans and radii meet. */
export function pairTick(plan1, r1, plan2, r2, q) {
  return firstTouch(relative(plan1, r1, plan2, r2, q), q);
}

/** How body 2 flies as seen from body 1, its place being that of the image (m, n) (rule 5p). */
export function throughImage(plan1, r1, plan2, r2, q, periods, { m, n }) {
  const { d, ...course } = relative(plan1, r1, plan2, r2, q);
  const [right, up] = [shift(m + plan2.kx - plan1.kx, periods[0]), shift(n + plan2.ky - plan1.ky, periods[1])];
  return { ...course, d: [add(d[0], right), add(d[1], up)] };
}

function shift(turns, period) {
  return period === null ? exact(0) : multiply(whole(turns), exact(period));
}

/**
 * The tick at which two bodies meet through an image, and the image: {tick, m, n} (rule 5p). The bodies are in the order of their numbers;
 * `leftOut` has the images {m, n} that are not asked, and ticks before `from` are none. What no plan lives to see is null too. `touch` says when
 * two meet as `relative` has them, through an image, and each body is within its r from its place.
 *
 * Images are asked that come within reach in a time h after s, and if none of them is met by then, in twice that time.
 */
export function imageTick(plan1, r1, plan2, r2, q, periods, leftOut = [], from = -FAR, touch = firstTouch) {
  const { d: here, ...course } = throughImage(plan1, r1, plan2, r2, q, periods, { m: 0n, n: 0n });
  const { s, v, R } = course;
  const asked = new Map(); // the tick of an image, by its numbers
  for (let h = 1n << 49n; h <= LONGEST; h *= 2n) {
    const [ms, ns] = [0, 1].map((axis) => {
      if (periods[axis] === null) return [0n];
      const flown = multiply(v[axis], multiply(whole(h + 1n), exact(q)));
      const [low, high] = sign(flown) < 0 ? [add(here[axis], flown), here[axis]] : [here[axis], add(here[axis], flown)];
      const P = exact(periods[axis]); // -R <= d + m P <= R at some time
      const found = [];
      for (let m = -floorQuotient(add(high, R), P); m <= floorQuotient(subtract(R, low), P); m += 1n) found.push(m);
      return found;
    });
    let first = null;
    for (const m of ms) {
      for (const n of ns) {
        if (leftOut.some((image) => image.m === m && image.n === n)) continue;
        if (!asked.has(`${m} ${n}`)) {
          asked.set(`${m} ${n}`, touch({ ...course, d: [add(here[0], shift(m, periods[0])), add(here[1], shift(n, periods[1]))] }, q, { m, n }));
        }
        const tick = asked.get(`${m} ${n}`);
        if (tick !== null && tick >= from && tick <= s + h && (first === null || tick < first.tick)) first = { tick, m, n };
      }
    }
    if (first !== null) return first;
  }
  return null;
}

/** The tick at which two bodies meet, as `relative` has them. */
export function firstTouch({ s, d, v, R }, q) {
  const { B, Q, vv, D } = discriminant({ d, v, R });
  if (sign(B) >= 0) return null;
  if (sign(Q) <= 0) return s;
  if (sign(D) <= 0) return null;
  const ticks = floorRoot(minus(B), D, multiply(vv, exact(q)));
  return ticks >= FAR ? null : s + ticks;
}

/** The tick at which two bodies part, as `relative` has them (rule 11). */
export function lastTouch({ s, d, v, R }, q) {
  const { B, Q, vv, D } = discriminant({ d, v, R });
  if (sign(Q) > 0 && (sign(B) >= 0 || sign(D) <= 0)) return s;
  if (sign(vv) === 0) return null;
  const ticks = floorLaterRoot(minus(B), D, multiply(vv, exact(q)));
  return ticks >= FAR ? null : s + ticks;
}

/** A time z after s, |d + v z|^2 - R^2 = vv z^2 + 2 B z + Q; its zeros are (-B - sqrt(D)) / vv and (-B + sqrt(D)) / vv. */
export function discriminant({ d, v, R }) {
  const [B, vv] = [dot(d, v), dot(v, v)];
  const Q = subtract(dot(d, d), multiply(R, R));
  return { B, Q, vv, D: subtract(multiply(B, B), multiply(vv, Q)) };
}

/**
 * The tick at which a body meets a wall of the arena [W, H], and the wall's number: {tick, wall}; there are none at the ends of periodic axes.
 * The sides are what the body has in the place of r for left, right, bottom and top (rule 6s).
 */
export function wallTick(plan, sides, [W, H], q, periods = [null, null]) {
  const { x, y, vx, vy } = plan.exact;
  const [left, right, bottom, top] = sides.map(exact);
  let first = null;
  const met = (wall, ticks) => {
    if (ticks !== null && (first === null || plan.A + ticks < first.tick)) first = { tick: plan.A + ticks, wall };
  };
  const consider = (wall, gap, speed) => {
    const ticks = sign(gap) <= 0 ? 0n : floorQuotient(gap, multiply(speed, exact(q)));
    if (ticks < FAR) met(wall, ticks);
  };
  const bent = (wall, i) => met(wall, bentWall(plan, sides[i], wall, [W, H], q));
  if (plan.ax !== 0) bent(LEFT, 0);
  else if (periods[0] === null && plan.vx < 0) consider(LEFT, subtract(x, left), minus(vx));
  if (plan.ax !== 0) bent(RIGHT, 1);
  else if (periods[0] === null && plan.vx > 0) consider(RIGHT, subtract(subtract(exact(W), x), right), vx);
  if (plan.ay !== 0) bent(BOTTOM, 2);
  else if (periods[1] === null && plan.vy < 0) consider(BOTTOM, subtract(y, bottom), minus(vy));
  if (plan.ay !== 0) bent(TOP, 3);
  else if (periods[1] === null && plan.vy > 0) consider(TOP, subtract(subtract(exact(H), y), top), vy);
  return first;
}

export function dot([x1, y1], [x2, y2]) {
  return add(multiply(x1, x2), multiply(y1, y2));
}

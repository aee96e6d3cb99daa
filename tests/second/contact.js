// Rules 5 and 6: when two bodies meet, and when a body meets a wall. Everything here is exact; null is "none".

import { add, exact, floorQuotient, floorRoot, minus, multiply, sign, subtract } from "./exact.js";
import { place } from "./clock.js";

const FAR = 1n << 62n;
export const LEFT = -1;
export const RIGHT = -2;
export const BOTTOM = -3;
export const TOP = -4;

/** The tick at which two bodies with these plans and radii meet. */
export function pairTick(plan1, r1, plan2, r2, q) {
  const s = plan1.A > plan2.A ? plan1.A : plan2.A;
  const [x1, y1] = place(plan1, s, q);
  const [x2, y2] = place(plan2, s, q);
  const d = [subtract(x2, x1), subtract(y2, y1)];
  const v = [subtract(plan2.exact.vx, plan1.exact.vx), subtract(plan2.exact.vy, plan1.exact.vy)];
  const R = add(exact(r1), exact(r2));

  const B = dot(d, v);
  if (sign(B) >= 0) return null;
  const Q = subtract(dot(d, d), multiply(R, R));
  if (sign(Q) <= 0) return s;
  // A time z after s, |d + v z|^2 - R^2 = vv z^2 + 2 B z + Q; its first zero is (-B - sqrt(B^2 - vv Q)) / vv.
  const vv = dot(v, v);
  const D = subtract(multiply(B, B), multiply(vv, Q));
  if (sign(D) <= 0) return null;
  const ticks = floorRoot(minus(B), D, multiply(vv, exact(q)));
  return ticks >= FAR ? null : s + ticks;
}

/** The tick at which a body meets a wall of the arena [W, H], and the wall's number: {tick, wall}. */
export function wallTick(plan, r, [W, H], q) {
  const { x, y, vx, vy } = plan.exact;
  const low = (place) => subtract(place, exact(r));
  const high = (side, place) => subtract(subtract(exact(side), place), exact(r));
  let first = null;
  const consider = (wall, gap, speed) => {
    const ticks = sign(gap) <= 0 ? 0n : floorQuotient(gap, multiply(speed, exact(q)));
    if (ticks < FAR && (first === null || plan.A + ticks < first.tick)) first = { tick: plan.A + ticks, wall };
  };
  if (plan.vx < 0) consider(LEFT, low(x), minus(vx));
  if (plan.vx > 0) consider(RIGHT, high(W, x), vx);
  if (plan.vy < 0) consider(BOTTOM, low(y), minus(vy));
  if (plan.vy > 0) consider(TOP, high(H, y), vy);
  return first;
}

function dot([x1, y1], [x2, y2]) {
  return add(multiply(x1, x2), multiply(y1, y2));
}

// Rules 9r and 9h: rest. A support of a body is {number, m, image, face}: a body or a wall, the unit normal from it to the body, and for a body the image and the face of the contact.

import { speedAlong } from "./exchange.js";
import { OUTWARD } from "./responses.js";

const part = ([x, y], [mx, my]) => x * mx + y * my;

/** A vector less its part along a unit normal. */
function across([x, y], [mx, my]) {
  const s = part([x, y], [mx, my]);
  return [x - s * mx, y - s * my];
}

/** The possible supports of a body at a wall, or of one of two bodies that meet with this normal: [body, support] each. */
export function wallSupport(body, number) {
  return [[body, { number, m: OUTWARD[number].map((each) => -each), image: null, face: null }]];
}

export function pairSupports(a, b, { normal, face }, image, mayHold) {
  const reversed = normal.map((each) => -each);
  const both = [[a, { number: b.number, m: reversed, image, face }, b], [b, { number: a.number, m: normal, image, face }, a]];
  return both.filter(([body, { m }, f]) => face !== null && body.m < Infinity && (f.m === Infinity || mayHold(f, m)));
}

/** True if a movable body with these supports and this plan until now may hold one that it meets with the normal m. */
export function stands(held, { ax, ay }, [mx, my]) {
  return held.length === 1 && ax === 0 && ay === 0 && held[0].m[0] === mx && held[0].m[1] === my;
}

/** True if two bodies meet so slowly that rule 9r replaces a restitution. */
export function isSlow({ w = 0 }, speed) {
  return w > 0 && !(speed < -w);
}

export function wallSpeed({ vx, vy }, wall) {
  return -part([vx, vy], OUTWARD[wall]);
}

/** The velocity and the present acceleration {vx, vy, ax, ay} that a support with a velocity gives a body with this relative velocity, or null if the body may not settle on it. */
export function onSupport({ vx, vy }, u, whole, { m }, periods) {
  const [x, y] = across([vx, vy], m);
  const [ax, ay] = across(whole, m);
  const isAlongPeriod = [ax, ay].some((each, axis) => each !== 0 && periods[axis] !== null);
  return part(whole, m) < 0 && !isAlongPeriod ? { vx: u.vx + x, vy: u.vy + y, ax, ay } : null;
}

/** True if two supports hold a body between them. */
export function isBetween(whole, one, other) {
  return part(across(whole, one.m), other.m) < 0 && part(across(whole, other.m), one.m) < 0;
}

/** The least duration of the flight after a contact (rule 11h). */
const lasting = ({ t = 0 }, q) => (t > 0 ? t : 2 ** 38 * q);

/** The least parting speed of two bodies, with the plans that they had and the velocities that they have now, or null; `mayRest`: in a scene with a w. */
export function leastSpeed(response, planA, planB, one, two, n, q, mayRest, closing, since) {
  const [rx, ry] = [planB.ax - planA.ax, planB.ay - planA.ay];
  if (!mayRest && rx === 0 && ry === 0) return null;
  const t = lasting(response, q);
  const size = Math.abs(one.vx) + Math.abs(one.vy) + (Math.abs(two.vx) + Math.abs(two.vy)) + t * (Math.abs(rx) + Math.abs(ry));
  const h = 0.5 * t * -part([rx, ry], n);
  return Math.max(mayRest ? h : loaded(h, response, closing, since), 2 ** -44 * size);
}

/** The same for a body and a wall. */
export function leastAtWall(response, { ax, ay }, wall, q, mayRest, closing, since) {
  const least = 0.5 * lasting(response, q) * part([ax, ay], OUTWARD[wall]);
  if (!(least > 0)) return null;
  return mayRest ? least : loaded(least, response, closing, since);
}

/** The least parting speed h after a contact `since` the last one, at a closing speed: more under a load. */
function loaded(h, { t = 0 }, closing, since) {
  if (!(h > 0 && t > 0 && since <= t)) return h;
  const most = Math.min(128 * h, 2 * closing);
  return Math.max(h, most * since <= closing * t ? most : (closing * t) / since);
}

/** The velocity of a body that parts from a wall with a speed. */
export function offPressed([vx, vy], wall, least) {
  const [nx, ny] = OUTWARD[wall];
  const h = vx * nx + vy * ny + least;
  return [vx - h * nx, vy - h * ny];
}

// Rules 9r and 9h: rest. What holds a body is {number, m, image, face}: a body or a wall, the unit normal from it to the body, and of a body the image and the face at which they met.

import { speedAlong } from "./exchange.js";
import { OUTWARD } from "./responses.js";

const part = ([x, y], [mx, my]) => x * mx + y * my;

/** What is left of a vector without its part along a unit normal. */
function across([x, y], [mx, my]) {
  const s = part([x, y], [mx, my]);
  return [x - s * mx, y - s * my];
}

/** What could hold a body at a wall, or one of two bodies that meet with this normal: [body, support] each. */
export function wallSupport(body, number) {
  return [[body, { number, m: OUTWARD[number].map((each) => -each), image: null, face: null }]];
}

export function pairSupports(a, b, { normal, face }, image) {
  const isFixed = ({ m, plan }) => m === Infinity && plan.vx === 0 && plan.vy === 0;
  const reversed = normal.map((each) => -each);
  const both = [[a, { number: b.number, m: reversed, image, face }, b], [b, { number: a.number, m: normal, image, face }, a]];
  return both.filter(([body, , f]) => face !== null && isFixed(f) && body.m < Infinity);
}

/** Whether two meet so slowly that rule 9r has something else for them than a restitution. */
export function isSlow({ w = 0 }, speed) {
  return w > 0 && !(speed < -w);
}

export function wallSpeed({ vx, vy }, wall) {
  return -part([vx, vy], OUTWARD[wall]);
}

/** The velocity and the present acceleration {vx, vy, ax, ay} that a support gives a body, or null if it is not one on which it may settle. */
export function onSupport({ vx, vy }, whole, { m }, periods) {
  const [x, y] = across([vx, vy], m);
  const [ax, ay] = across(whole, m);
  const isAlongPeriod = [ax, ay].some((each, axis) => each !== 0 && periods[axis] !== null);
  return part(whole, m) < 0 && !isAlongPeriod ? { vx: x, vy: y, ax, ay } : null;
}

/** Whether two supports hold a body between them. */
export function isBetween(whole, one, other) {
  return part(across(whole, one.m), other.m) < 0 && part(across(whole, other.m), one.m) < 0;
}

/** Whether b and a, or a body and a wall, are pressed together by the accelerations that they had. */
export function arePressed(planA, planB, n) {
  return part([planB.ax - planA.ax, planB.ay - planA.ay], n) < 0;
}

export function isPressedTo(wall, { ax, ay }) {
  return part([ax, ay], OUTWARD[wall]) > 0;
}

/** The velocity with which a body parts from a wall with speed w. */
export function offPressed({ vx, vy }, wall, w) {
  const [nx, ny] = OUTWARD[wall];
  const h = vx * nx + vy * ny + w;
  return [vx - h * nx, vy - h * ny];
}

/** The speed of an exchange after which two part with speed w. */
export function pressedSpeed(planA, planB, normal, w) {
  return 0.5 * (speedAlong(planA, planB, normal) - w);
}

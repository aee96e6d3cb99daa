// Rules 2g to 9g, and 11g: the frames in which bodies fly straight while walls are bent. A gravity is [gx, gy], or null.

import { anchor, makePlan } from "./clock.js";
import { BOTTOM, LEFT, RIGHT, TOP } from "./contact.js";
import { add, exact, floorLaterRoot, floorQuotient, floorRoot, minus, multiply, nearest, sign, subtract, whole } from "./exact.js";

const LONGEST = 53; // of the powers of two that a frame's ticks may be
const HALF = { n: 1n, e: -1 };

/** Says what is wrong with a scene that has a gravity (rule 2g). */
export function checkGravity({ gravity: [gx, gy], arena, periods, bodies, commands, responses, shaped }) {
  if (gx === 0 && gy === 0) throw new Error("gravity is [0, 0]; leave it out.");
  if (arena === null) throw new Error("There is a gravity, and no arena.");
  if ([gx, gy].some((g, axis) => g !== 0 && periods[axis] !== null)) throw new Error("There is a gravity along a periodic axis.");
  const every = [...bodies, ...commands.filter(({ what }) => what === "insertion")];
  if (shaped || every.some(({ m }) => m === Infinity)) throw new Error("With a gravity all bodies are discs of finite mass.");
  if (responses.some(({ between, name }) => between.includes("wall") && name !== "elastic")) throw new Error("With a gravity all walls are elastic.");
  const towards = ({ x, y, r }, wall) => sign(gap([exact(x), exact(y)], r, wall, arena)) <= 0;
  const stands = ({ x, y, r, vx, vy }) =>
    (gx < 0 && vx === 0 && towards({ x, y, r }, LEFT)) ||
    (gx > 0 && vx === 0 && towards({ x, y, r }, RIGHT)) ||
    (gy < 0 && vy === 0 && towards({ x, y, r }, BOTTOM)) ||
    (gy > 0 && vy === 0 && towards({ x, y, r }, TOP));
  if (every.some(stands)) throw new Error("A body stands on a wall towards which gravity points.");
}

/** The ticks of a frame, F (rule 3g). */
export function frameTicks([gx, gy], arena, q) {
  const sum = add(exact(Math.abs(gx)), exact(Math.abs(gy)));
  const most = multiply(HALF, exact(Math.min(...arena)));
  for (let k = LONGEST; k >= 0; k -= 1) {
    const time = multiply(whole(1n << BigInt(k)), exact(q));
    if (sign(subtract(multiply(sum, multiply(time, time)), most)) <= 0) return 1n << BigInt(k);
  }
  throw new Error("Gravity is so large that a frame of one tick is too long.");
}

/** The time since the first tick of the frame of tick T, tau. */
export function sinceFrame(T, F, q) {
  return nearest(whole(T % F)) * q;
}

/** The velocity in the frame of what has a velocity in the room. */
export function velocityInFrame({ vx, vy }, [gx, gy], tau) {
  return { vx: gx === 0 ? vx : vx - gx * tau, vy: gy === 0 ? vy : vy - gy * tau };
}

/** The place in the frame of what has a place in the room. */
export function placeInFrame({ x, y }, [gx, gy], tau) {
  return { x: gx === 0 ? x : x - gx * (0.5 * (tau * tau)), y: gy === 0 ? y : y - gy * (0.5 * (tau * tau)) };
}

/** The plan of the frame that begins at tick T, for one of the frame before (rule 8g). */
export function nextFrame(plan, T, [gx, gy], F, q, periods) {
  const { x, y, vx, vy, A, kx, ky } = anchor(plan, T, q, periods);
  const D = nearest(whole(F)) * q;
  const moved = (place, g) => (g === 0 ? place : place + g * (0.5 * D * D));
  const sped = (speed, g) => (g === 0 ? speed : speed + g * D);
  return makePlan(moved(x, gx), moved(y, gy), sped(vx, gx), sped(vy, gy), A, kx, ky);
}

/** The velocity [vx, vy] after a contact with an elastic wall (rule 9g). */
export function offBentWall({ vx, vy }, wall, [gx, gy], tau) {
  const turned = (speed, g) => (g === 0 ? -speed : 2 * -(g * tau) - speed);
  return wall === LEFT || wall === RIGHT ? [turned(vx, gx), vy] : [vx, turned(vy, gy)];
}

/** The number of ticks from its anchor to the contact of a plan of radius r with a wall along an axis with gravity g, or null; its frame begins at T0 (rule 6g). */
export function bentWall(plan, r, wall, arena, q, g, T0) {
  const { x, y, vx, vy } = plan.exact;
  const isAcross = wall === LEFT || wall === RIGHT;
  const bend = multiply(HALF, multiply(exact(g), multiply(exact(q), exact(q))));
  const n = whole(plan.A - T0);
  // After z ticks the place in the room is there + speed z + bend z^2.
  const there = add(isAcross ? x : y, multiply(bend, multiply(n, n)));
  const speed = add(multiply(isAcross ? vx : vy, exact(q)), multiply(whole(2n), multiply(bend, n)));
  const isLow = wall === LEFT || wall === BOTTOM;
  const [a, b] = isLow ? [bend, speed] : [minus(bend), minus(speed)];
  const c = gap([there, there], r, wall, arena);
  if (sign(c) <= 0 && (sign(b) || sign(a)) < 0) return 0n;
  const D = subtract(multiply(b, b), multiply(whole(4n), multiply(a, c)));
  const twice = multiply(whole(2n), a);
  if (sign(a) < 0) return sign(D) <= 0 ? floorQuotient(b, minus(twice)) : floorLaterRoot(b, D, minus(twice));
  return sign(c) <= 0 || sign(b) >= 0 || sign(D) <= 0 ? null : floorRoot(minus(b), D, twice);
}

/** The gap between a wall and a body at a place. */
function gap([x, y], r, wall, [W, H]) {
  const isAcross = wall === LEFT || wall === RIGHT;
  const place = isAcross ? x : y;
  const isLow = wall === LEFT || wall === BOTTOM;
  return subtract(isLow ? place : subtract(exact(isAcross ? W : H), place), exact(r));
}

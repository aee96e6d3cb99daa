// Rules 3, 3a, 4 and 4a: ticks, and plans that are anchored at them.

import { add, exact, floorQuotient, multiply, nearest, nearestQuotient, square, subtract, whole } from "./exact.js";

/** The e of a scene, whose unit of time is U = 2^-e. */
export function unit({ bodies, commands, arena, unit: told = null, gravity = [0, 0] }) {
  let e = told === null ? 0 : -100;
  if (told !== null) {
    while (e < 900 && powerOfTwo(-e) !== told) e += 1;
    if (powerOfTwo(-e) !== told) throw new Error(`unit is ${told}, no power of two from 2^-900 to 2^100.`);
    return e;
  }
  if (bodies.length === 0 && !arena) return 0;
  const fast = [...bodies, ...commands].filter(({ vx }) => vx !== undefined);
  let S = Math.max(0, ...fast.map(({ vx, vy }) => vx * vx + vy * vy));
  const [Ax, Ay] = largest([...bodies, ...commands], gravity);
  const far = arena ? 0 : Math.max(...bodies.map(({ x, y }) => Math.max(Math.abs(x), Math.abs(y)))) + Math.max(...bodies.map(({ r }) => r));
  const [W, H] = arena ?? [far, far];
  if (Ax || Ay) S += 2 * (Ax * W + Ay * H); // rule 3a
  const L = Math.max(W, H);
  const c = (Math.sqrt(S) / L) * (1 - powerOfTwo(-20));
  while (e < 900 && !(c < powerOfTwo(e))) e += 1;
  return e;
}

/** The largest |ax| and |ay| of gravity, and of all bodies and commands (rule 3a). */
export function largest(all, gravity) {
  return ["ax", "ay"].map((key, axis) => Math.max(Math.abs(gravity[axis]), ...all.map((each) => Math.abs(each[key] ?? 0))));
}

/** The length of a tick, q = U * 2^-52, for U = 2^-e. */
export function tickLength(e) {
  return powerOfTwo(-e - 52);
}

/** The tick of a time. */
export function tickOf(time, start, q) {
  return floorQuotient(subtract(exact(time), exact(start)), exact(q));
}

/**
 * A flight plan: doubles x, y, vx, vy and the tick A when its body is at (x, y); the periods that were taken off (rule 4p); and its
 * acceleration (rule 4a).
 */
export function makePlan(x, y, vx, vy, A, kx = 0n, ky = 0n, ax = 0, ay = 0) {
  return { x, y, vx, vy, A, kx, ky, ax, ay, exact: { x: exact(x), y: exact(y), vx: exact(vx), vy: exact(vy), ax: exact(ax), ay: exact(ay) } };
}

/** The plan with its periods taken off (rule 4p); the period of a walled axis is null. */
export function wrap({ x, y, vx, vy, A, kx, ky, ax, ay }, [width, height]) {
  const [right, up] = [turns(x, width), turns(y, height)];
  return makePlan(moved(x, right, width), moved(y, up, height), vx, vy, A, kx + right, ky + up, ax, ay);
}

/** rem(z, P) of rule 2p; z itself along a walled axis. */
export function rem(z, P) {
  return moved(z, turns(z, P), P);
}

/** The number of periods that rem(z, P) takes off. */
function turns(z, P) {
  return P === null ? 0n : nearestQuotient(exact(z), exact(P));
}

function moved(z, N, P) {
  return P === null ? z : nearest(subtract(exact(z), multiply(whole(N), exact(P))));
}

/** The position of a plan's body at tick T, exactly. */
export function place(plan, T, q) {
  const { x, y, vx, vy, ax, ay } = plan.exact;
  const time = multiply(whole(T - plan.A), exact(q));
  const after = (place, speed, pull) => add(place, multiply(time, add(speed, multiply({ n: 1n, e: -1 }, multiply(pull, time)))));
  return [after(x, vx, ax), after(y, vy, ay)];
}

/** The velocity of the body of a plan at tick T, exactly. */
export function velocityAt(plan, T, q) {
  const { vx, vy, ax, ay } = plan.exact;
  const time = multiply(whole(T - plan.A), exact(q));
  return [add(vx, multiply(ax, time)), add(vy, multiply(ay, time))];
}

/** The flight of a body with a speed and an acceleration in n ticks: the first times n, and the second times n^2, exactly. */
export function carried(speed, pull, q) {
  return [multiply(speed, exact(q)), multiply({ n: 1n, e: -1 }, multiply(pull, square(exact(q))))];
}

/** The plan anchored at tick T. */
export function anchor({ x, y, vx, vy, A, kx, ky, ax, ay }, T, q, periods = [null, null]) {
  const d = nearest(whole(T - A)) * q;
  const [there, up] = [x + (vx * d + 0.5 * ax * (d * d)), y + (vy * d + 0.5 * ay * (d * d))];
  return wrap(makePlan(there, up, vx + ax * d, vy + ay * d, T, kx, ky, ax, ay), periods);
}

/** 2^e as a double, -1022 <= e <= 1023. */
function powerOfTwo(e) {
  return nearest({ n: 1n, e });
}

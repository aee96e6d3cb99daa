// A flight plan: its numbers, and the position of its body. Only these functions compute that in a page: in this order,
// in doubles, so the bits are the run's own.

/** The numbers of a plan at its anchor: place and velocity. */
export const PLAN = ["x", "y", "vx", "vy"];

/** Its acceleration; rows have it only if some body is accelerated. */
export const PULL = ["ax", "ay"];

/** The whole acceleration, also of a held body. */
export const WHOLE = ["wx", "wy"];

/** One plan in columns; without columns of accelerations its body has no acceleration. */
export function planIn({ x, y, vx, vy, ax, ay }, at) {
  return { x: x[at], y: y[at], vx: vx[at], vy: vy[at], ax: ax?.[at], ay: ay?.[at] };
}

/** The position of a plan's body at a time after its anchor: [x, y]. */
export function positionAfter({ x, y, vx, vy, ax = 0, ay = 0 }, time) {
  const square = time * time;
  return [x + (vx * time + (0.5 * ax) * square), y + (vy * time + (0.5 * ay) * square)];
}

/** The velocity of a plan's body at a time after its anchor: [vx, vy]. */
export function velocityAfter({ vx, vy, ax = 0, ay = 0 }, time) {
  return [vx + ax * time, vy + ay * time];
}

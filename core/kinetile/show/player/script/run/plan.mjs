// A flight plan: its numbers, and where it has a body. Only these functions compute that in a page: in this order, in
// doubles, so that the bits are the run's own. With gravity plans are of the room, and bodies fall on parabolas: the same
// bits as those of ``Trajectory``.

/** The numbers of a plan at its anchor: place and velocity. */
export const PLAN = ["x", "y", "vx", "vy"];

/** One plan of those in columns. */
export function planIn({ x, y, vx, vy }, at) {
  return { x: x[at], y: y[at], vx: vx[at], vy: vy[at] };
}

/** Where a plan has its body a time after its anchor, by an acceleration: [x, y]. */
export function positionAfter({ x, y, vx, vy }, time, [right, up] = [0, 0]) {
  const half = 0.5 * time * time;
  return [x + vx * time + right * half, y + vy * time + up * half];
}

/** The velocity that a plan gives its body a time after its anchor: [vx, vy]. */
export function velocityAfter({ vx, vy }, time, [right, up] = [0, 0]) {
  return [vx + right * time, vy + up * time];
}

// Rules 9, 9s, 11 and 11p: overlaps at the start or at an insertion. All of it is in doubles, from plans that are anchored there.

import { rem } from "./clock.js";
import { difference, shapeGap } from "./shapes.js";

const SLACK = 1e-12;

/** True if a body with this plan has room among others, {r, m, shape, plan} each, that it does not pass: rules 9 and 9s. Walls apply to its place as it is written. */
export function hasRoom({ r, m, shape, x: right, y: up }, plan, others, arena, periods, shaped) {
  const { x, y } = plan;
  const ends = arena ? [right, arena[0] - right, up, arena[1] - up] : [];
  if (ends.some((end, i) => periods[i >> 1] === null && end < shape.sides[i] - SLACK * r)) return false;
  return others.every((other) => {
    const [dx, dy] = [rem(other.plan.x - x, periods[0]), rem(other.plan.y - y, periods[1])];
    if (shaped && m === Infinity && other.m === Infinity) return true;
    if (shaped) return !(shapeGap([dx, dy], difference(shape, other.shape)) < -(SLACK * (r + other.r)));
    const reach = r + other.r - SLACK * (r + other.r);
    return !(dx * dx + dy * dy < reach * reach);
  });
}

/**
 * The images {m, n} through which two bodies a < b, {r, plan} each, overlap, at the start or at an insertion. `isIn` tests bodies
 * with shapes and the difference [dx, dy]; false for discs.
 */
export function overlaps(a, b, periods, isIn) {
  const reach = (a.r + b.r) * (1 - SLACK);
  // No period is as short as the reach, and wrapped places are within half of one: more than one period away there is no overlap.
  const [rights, ups] = periods.map((period) => (period === null ? [0] : [-1, 0, 1]));
  const [kx, ky] = [b.plan.kx - a.plan.kx, b.plan.ky - a.plan.ky];
  const found = [];
  for (const right of rights) {
    for (const up of ups) {
      const image = { m: BigInt(right) - kx, n: BigInt(up) - ky };
      const dx = b.plan.x - a.plan.x + right * (periods[0] ?? 0);
      const dy = b.plan.y - a.plan.y + up * (periods[1] ?? 0);
      if (isIn ? isIn([dx, dy]) : dx * dx + dy * dy < reach * reach) found.push(image);
    }
  }
  return found;
}

// Rules 6, 6p, 6s and 8r: the tick when a body meets a wall, or reaches an end of its support. Everything here is exact; null is "none".

import { carried } from "./clock.js";
import { add, exact, minus, subtract } from "./exact.js";
import { firstFall, inOrder, polynomial } from "./signs.js";

/**
 * The tick and the wall of the contact of a body in an arena [W, H]: {tick, wall}; periodic axes have no walls.
 * The sides are the values in place of r for left, right, bottom and top (rule 6s).
 */
export function wallTick(plan, sides, arena, q, periods = [null, null]) {
  const { x, y, vx, vy, ax, ay } = plan.exact;
  let first = null;
  sides.forEach((r, i) => {
    const axis = i >> 1;
    if (periods[axis] !== null) return;
    const path = [[x, ...carried(vx, ax, q)], [y, ...carried(vy, ay, q)]][axis];
    const [free, ...way] = i % 2 ? [subtract(exact(arena[axis]), path[0]), ...path.slice(1).map(minus)] : path;
    const ticks = firstFall(polynomial([subtract(free, exact(r)), ...way]));
    if (ticks !== null && (first === null || plan.A + ticks < first.tick)) first = { tick: plan.A + ticks, wall: -1 - i };
  });
  return first;
}

/** The ticks from an anchor until a body is beyond an end of a face by more than w (rule 8r): its corners are u and u2 before the body, which flies along with speed s and acceleration c. */
export function leaveEnds({ u, u2, s, c }, w, q) {
  const way = carried(exact(s), exact(c), q);
  const ends = [[add(exact(u), w), ...way], [subtract(w, exact(u2)), ...way.map(minus)]];
  return ends.map((gap) => firstFall(polynomial(gap))).filter((n) => n !== null).sort(inOrder)[0] ?? null;
}

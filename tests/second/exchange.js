// Rule 9: the momentum that two bodies exchange; from rule 11, infinite masses and the speed of restitution. All operations on doubles are the rule's, in its order.

import { exact, multiply, nearest, subtract } from "./exact.js";

/** The unit normal along a line. */
export function along(dx, dy) {
  const l = Math.sqrt(dx * dx + dy * dy);
  if (l === 0) throw new Error("Two bodies are at one place when they meet, and no rule says what happens then.");
  return [dx / l, dy / l];
}

/** The speed of rule 9: b moves off from a with it, along a unit normal. */
export function speedAlong(a, b, [nx, ny]) {
  const ux = b.vx - a.vx;
  const uy = b.vy - a.vy;
  const xx = nx * nx;
  const yy = ny * ny;
  const excess = xx - 0.5 + (yy - 0.5) + (E(nx, nx) + E(ny, ny));
  const px = ux * nx;
  const py = uy * ny;
  const sum = px + py;
  const part = sum - px;
  const low = px - (sum - part) + (py - part) + (E(ux, nx) + E(uy, ny));
  return sum + (low - sum * excess);
}

/**
 * The velocities [vxa, vya, vxb, vyb] of two bodies after their contact with this unit normal. `alike`: all masses of the scene are equal;
 * the speed may differ from rule 9's.
 */
export function exchange(a, b, ma, mb, alike, [nx, ny], speed = speedAlong(a, b, [nx, ny])) {
  const ga = alike ? speed : share(ma, mb, speed);
  const gb = alike ? speed : share(mb, ma, speed);
  return [a.vx + ga * nx, a.vy + ga * ny, b.vx - gb * nx, b.vy - gb * ny];
}

/** The velocity [vx, vy] of a body without the share g of its velocity along a face that moves with (ux, uy) and its surface (rule 11). */
export function takenAlong({ vx, vy }, { vx: ux, vy: uy }, [nx, ny], { g = 0, surface: [sx, sy] = [0, 0] }) {
  if (!(g > 0)) return [vx, vy];
  const s = g * ((vx - (ux + sx)) * -ny + (vy - (uy + sy)) * nx);
  return [vx - s * -ny, vy - s * nx];
}

/** The velocities [vxa, vya, vxb, vyb] of two bodies without the share g along the face (rule 11). */
export function gripped(a, b, ma, mb, alike, n, response) {
  const { g = 0 } = response;
  if (ma < Infinity && mb === Infinity) return [...takenAlong(a, b, n, response), b.vx, b.vy];
  if (ma === Infinity && mb < Infinity) return [a.vx, a.vy, ...takenAlong(b, a, n, response)];
  if (!(g > 0)) return [a.vx, a.vy, b.vx, b.vy];
  const t = [-n[1], n[0]];
  return exchange(a, b, ma, mb, alike, t, 0.5 * g * speedAlong(a, b, t));
}

function share(m, o, speed) {
  if (m === Infinity) return o === Infinity ? speed : 0;
  if (o === Infinity) return 2 * speed;
  const both = m + o;
  const part = both - m;
  const low = m - (both - part) + (o - part);
  const f = (2 * o) / both;
  const back = f * both;
  const rest = (2 * o - back - E(f, both) - low * f) / both;
  const taken = f * speed;
  return taken + (E(f, speed) + rest * speed);
}

/** The error of the double a * b: a b - a*b, exact, then rounded. */
export function E(a, b) {
  return nearest(subtract(multiply(exact(a), exact(b)), exact(a * b)));
}

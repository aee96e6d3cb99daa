// Rows from the data of a page: the bits that differ between a row and its prediction from the plans before it.
// recording.py computes the same, operation by operation.

import { elapsed } from "./clock.mjs";
import { PLAN, PULL, WHOLE, planIn, positionAfter, velocityAfter } from "./plan.mjs";

export const KINDS = ["structural", "disc", "wall", "turn", "insert", "remove", "pass", "part", "anchor", "accelerate", "hold", "kind", "move"];
const DISC = 1;
export const INSERT = 4;
const REMOVE = 5;
const PASS = 6;
const PART = 7;
const ANCHOR = 8;
const ACCELERATE = 9;
const HOLD = 10;
export const MOVE = 12;

const word = new BigUint64Array(1);
const double = new Float64Array(word.buffer);

/** The double that differs from a predicted one by these bits. */
function differing(foretold, bits) {
  double[0] = foretold;
  word[0] ^= bits;
  return double[0];
}

/** Running sums, in place, of whole numbers that a double holds exactly. */
function sums(column) {
  for (let row = 1; row < column.length; row += 1) column[row] += column[row - 1];
  return column;
}

/** A copy of the plans of bodies (columns there, epoch, tick, x, y, vx, vy, ax, ay; with periodic axes kx, ky). */
export function copyPlans(bodies) {
  const plans = {};
  for (const name of ["there", "epoch", "tick", ...PLAN, ...PULL, ...WHOLE, "kx", "ky"]) plans[name] = bodies[name].slice();
  return plans;
}

/** True if a row of a kind gives plans to bodies. */
export function givesPlans(kind) {
  return kind !== PASS && kind !== PART;
}

/** True if a row of a kind is not an event: a plan that is anchored again, or that holds or releases a body. */
export function isAside(kind) {
  return kind === ANCHOR || kind === HOLD;
}

/** True if a body is present after an event of a kind. */
export function isThereAfter(kind) {
  return kind === REMOVE ? 0 : 1;
}

/**
 * The rows of a run: columns kind, epoch, tick, a, b, and for flight 2 * row + side (0 for a, 1 for b) place x, y,
 * velocity vx, vy, with accelerated bodies ax, ay, the periods kx, ky that were taken off the place since the body's
 * first one, and `before`, the flight before it of the same body (-1: the plan that it began with).
 */
export function rebuild(bodies, coded, { unit, periods, pull }) {
  const { kind, a, b } = coded;
  const count = kind.length;
  const rows = { count, kind, a, b, epoch: sums(coded.epoch), tick: sums(coded.tick) };
  for (const name of [...PLAN, ...(pull ? [...PULL, ...WHOLE] : []), "kx", "ky"]) rows[name] = new Float64Array(2 * count);
  rows.before = new Int32Array(2 * count).fill(-1);
  const now = copyPlans(bodies);
  const last = new Int32Array(bodies.x.length).fill(-1);
  const sides = ["a", "b"].map((side) => PLAN.map((name) => coded[side + name]));
  for (let row = 0; row < count; row += 1) {
    if (!givesPlans(kind[row])) continue;
    const moment = [rows.epoch[row], rows.tick[row]];
    let lostX = 0;
    let lostY = 0;
    for (let side = 0; side < 2; side += 1) {
      const body = side ? b[row] : a[row];
      if (body < 0) continue;
      const [x, y, vx, vy] = sides[side];
      const flight = 2 * row + side;
      const time = elapsed(moment, now.epoch[body], now.tick[body], unit);
      const gains = side === 1 && kind[row] === DISC && bodies.mass[a[row]] === bodies.mass[b[row]];
      const [endsX, endsY] = velocityAfter(planIn(now, body), time);
      const keepsX = gains ? endsX + lostX : endsX;
      const keepsY = gains ? endsY + lostY : endsY;
      const [fliesX, fliesY] = positionAfter(planIn(now, body), time);
      rows.x[flight] = differing(fliesX, x[row]);
      rows.y[flight] = differing(fliesY, y[row]);
      if (kind[row] === MOVE) now.kx[body] = now.ky[body] = 0;
      else if (kind[row] !== INSERT) {
        if (periods[0]) now.kx[body] += Math.round((fliesX - rows.x[flight]) / periods[0]);
        if (periods[1]) now.ky[body] += Math.round((fliesY - rows.y[flight]) / periods[1]);
      }
      [rows.kx[flight], rows.ky[flight]] = [now.kx[body], now.ky[body]];
      rows.vx[flight] = differing(keepsX, vx[row]);
      rows.vy[flight] = differing(keepsY, vy[row]);
      lostX = endsX - rows.vx[flight];
      lostY = endsY - rows.vy[flight];
      rows.before[flight] = last[body];
      last[body] = flight;
      for (const name of PLAN) now[name][body] = rows[name][flight];
      PULL.forEach((name, axis) => {
        const isGiven = kind[row] === INSERT || kind[row] === MOVE || kind[row] === ACCELERATE;
        if (isGiven || kind[row] === HOLD) now[name][body] = differing(now[name][body], sides[1][axis][row]);
        if (isGiven) now[WHOLE[axis]][body] = now[name][body];
        if (pull) for (const each of [name, WHOLE[axis]]) rows[each][flight] = now[each][body];
      });
      [now.epoch[body], now.tick[body]] = moment;
    }
  }
  return rows;
}

// Where everybody is. Plans in force after a number of rows; from there one goes forward and back, row by row.
// A place is anchor + velocity * elapsed, in this order, in doubles: the same bits as the run's own.

import { elapsed } from "./clock.mjs";
import { copyPlans, givesPlans, isThereAfter } from "./rows.mjs";

/** A place as it is shown: along a periodic axis from 0 to less than the period, which is 0 of another axis. */
export function wrapped(place, period) {
  if (period === 0) return place;
  const rest = place % period;
  const found = rest < 0 ? rest + period : rest;
  return found === period ? 0 : found;
}

/** What is between two places along an axis: to the nearest image of the other. */
export function apartAlong(one, other, period) {
  const apart = other - one;
  return period === 0 ? apart : apart - period * Math.round(apart / period);
}

export class Motion {
  constructor(bodies, rows, unit, periods = [0, 0]) {
    this.periods = periods;
    this.bodies = bodies;
    this.rows = rows;
    this.unit = unit;
    this.done = 0;
    this.plans = copyPlans(bodies);
  }

  /** Go forward or back until so many rows are done. */
  to(count) {
    while (this.done < count) this.#go(this.done++, true);
    while (this.done > count) this.#go(--this.done, false);
  }

  /** The place of a body at a moment, under its plan in force: [x, y]. */
  place(body, moment) {
    const { x, y, vx, vy, epoch, tick } = this.plans;
    const time = elapsed(moment, epoch[body], tick[body], this.unit);
    const [width, height] = this.periods;
    return [wrapped(x[body] + vx[body] * time, width), wrapped(y[body] + vy[body] * time, height)];
  }

  /** The places of all bodies at a moment, into two arrays. */
  places(moment, intoX, intoY) {
    const { x, y, vx, vy, epoch, tick } = this.plans;
    for (let body = 0; body < x.length; body += 1) {
      const time = elapsed(moment, epoch[body], tick[body], this.unit);
      intoX[body] = wrapped(x[body] + vx[body] * time, this.periods[0]);
      intoY[body] = wrapped(y[body] + vy[body] * time, this.periods[1]);
    }
  }

  #go(row, forward) {
    if (!givesPlans(this.rows.kind[row])) return;
    const sides = [this.rows.a[row], this.rows.b[row]];
    sides.forEach((body, side) => {
      if (body < 0) return;
      const flight = 2 * row + side;
      this.#put(body, forward ? flight : this.rows.before[flight]);
    });
  }

  #put(body, flight) {
    const { plans, rows, bodies } = this;
    for (const name of ["x", "y", "vx", "vy"]) {
      plans[name][body] = flight < 0 ? bodies[name][body] : rows[name][flight];
    }
    const row = flight >> 1;
    plans.epoch[body] = flight < 0 ? bodies.epoch[body] : rows.epoch[row];
    plans.tick[body] = flight < 0 ? bodies.tick[body] : rows.tick[row];
    plans.there[body] = flight < 0 ? bodies.there[body] : isThereAfter(rows.kind[row]);
  }
}

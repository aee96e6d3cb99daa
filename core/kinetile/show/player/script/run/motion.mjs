// Positions of all bodies: the plans in force after a number of rows, and steps forward and back, row by row.

import { elapsed } from "./clock.mjs";
import { PLAN, PULL, WHOLE, planIn, positionAfter, velocityAfter } from "./plan.mjs";
import { copyPlans, givesPlans, isThereAfter } from "./rows.mjs";

/** The displayed place: along a periodic axis from 0 to less than the period; the period of another axis is 0. */
export function wrapped(place, period) {
  if (period === 0) return place;
  const rest = place % period;
  const found = rest < 0 ? rest + period : rest;
  return found === period ? 0 : found;
}

/** The difference of two places along an axis, to the nearest image of the other. */
export function apartAlong(one, other, period) {
  const apart = other - one;
  return period === 0 ? apart : apart - period * Math.round(apart / period);
}

const MOST_TURNS = 200; // borders of an axis: a longer flight is drawn up to this one

/** The shifts of the parts of a straight flight into the box, however often it crosses a border: [right, up] of each. */
export function imagesAlong(from, to, periods) {
  const parts = [0, 1];
  periods.forEach((period, axis) => {
    const way = to[axis] - from[axis];
    if (!period || way === 0) return;
    const first = Math.ceil(Math.min(from[axis], to[axis]) / period);
    const count = Math.min(Math.floor(Math.max(from[axis], to[axis]) / period) - first + 1, MOST_TURNS);
    for (let border = first; border < first + count; border += 1) parts.push((border * period - from[axis]) / way);
  });
  parts.sort((one, other) => one - other);
  return parts.slice(1).map((part, at) => periods.map((period, axis) => {
    const middle = from[axis] + 0.5 * (part + parts[at]) * (to[axis] - from[axis]);
    return period ? -Math.floor(middle / period) * period : 0;
  }));
}

export class Motion {
  constructor(bodies, rows, unit, periods = [0, 0]) {
    this.periods = periods;
    this.names = [...PLAN, ...(rows.ax ? [...PULL, ...WHOLE] : []), ...(periods.some((period) => period) ? ["kx", "ky"] : [])];
    this.bodies = bodies;
    this.rows = rows;
    this.unit = unit;
    this.done = 0;
    this.plans = copyPlans(bodies);
    this.flights = new Int32Array(bodies.x.length).fill(-1); // of each body: the number of its plan
  }

  /** Goes forward or back until this number of rows is done. */
  to(count) {
    while (this.done < count) this.#go(this.done++, true);
    while (this.done > count) this.#go(--this.done, false);
  }

  /** The place of a body at a moment, under its plan in force: [x, y]. */
  place(body, moment) {
    return this.#onPlan(body, moment).map((at, axis) => wrapped(at, this.periods[axis]));
  }

  /** The same without wrapping: it may be beyond a border. */
  #onPlan(body, moment) {
    return positionAfter(planIn(this.plans, body), this.#since(body, moment));
  }

  /** The time from the anchor of a body's plan in force to a moment. */
  #since(body, moment) {
    return elapsed(moment, this.plans.epoch[body], this.plans.tick[body], this.unit);
  }

  /**
   * The images of b around a, the nearest first: {apart: [dx, dy], image}, among them all images that a can touch. An image
   * is "m,n", in periods between unwrapped places (rule 5p): it stays the same one however far the two bodies fly.
   */
  images(a, b, moment) {
    const { kx, ky } = this.plans;
    const [one, other] = [a, b].map((body) => this.#onPlan(body, moment));
    const [columns, lines] = [kx, ky].map((taken, axis) => {
      const [period, apart] = [this.periods[axis], other[axis] - one[axis]];
      if (!period) return [[apart, 0]];
      const nearest = -Math.round(apart / period);
      return [nearest - 1, nearest, nearest + 1].map((turn) => [apart + turn * period, turn - taken[b] + taken[a]]);
    });
    const found = columns.flatMap(([dx, m]) => lines.map(([dy, n]) => ({ apart: [dx, dy], image: `${m},${n}` })));
    return found.sort((near, far) => Math.hypot(...near.apart) - Math.hypot(...far.apart));
  }

  /** The velocity of a body at a moment, under its plan in force: [vx, vy]. */
  velocity(body, moment) {
    return velocityAfter(planIn(this.plans, body), this.#since(body, moment));
  }

  /** The acceleration of a body under its plan in force: [ax, ay], or null. */
  pull(body) {
    const { ax, ay } = this.plans;
    return ax[body] || ay[body] ? [ax[body], ay[body]] : null;
  }

  /** The place of a body at a moment under its plan in force, unwrapped from its displayed place at another moment: [x, y]. */
  flown(body, moment, from) {
    const now = this.#onPlan(body, from);
    return this.#onPlan(body, moment).map((then, axis) => {
      const period = this.periods[axis];
      return then - (period && now[axis] - wrapped(now[axis], period));
    });
  }

  /** The places of all bodies at a moment, into arrays x, y; into kx, ky the periods that are taken off them. */
  places(moment, into) {
    const { kx, ky } = this.plans;
    const [width, height] = this.periods;
    for (let body = 0; body < this.plans.x.length; body += 1) {
      const [flownX, flownY] = this.#onPlan(body, moment);
      into.x[body] = wrapped(flownX, width);
      into.y[body] = wrapped(flownY, height);
      if (width) into.kx[body] = kx[body] + Math.round((flownX - into.x[body]) / width);
      if (height) into.ky[body] = ky[body] + Math.round((flownY - into.y[body]) / height);
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
    this.flights[body] = flight;
    for (const name of this.names) {
      plans[name][body] = flight < 0 ? bodies[name][body] : rows[name][flight];
    }
    const row = flight >> 1;
    plans.epoch[body] = flight < 0 ? bodies.epoch[body] : rows.epoch[row];
    plans.tick[body] = flight < 0 ? bodies.tick[body] : rows.tick[row];
    plans.there[body] = flight < 0 ? bodies.there[body] : isThereAfter(rows.kind[row]);
  }
}

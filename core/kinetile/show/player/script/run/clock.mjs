// Exact time. A moment is [epoch, tick]: whole units of the scene's clock since its start, and ticks of 2^-52
// of a unit after that. Both are whole numbers that a double holds exactly, so only functions that say so
// round here.

import { parts } from "./doubles.mjs";

export const TICKS = 2 ** 52;

/** Negative, zero or positive: one moment is before, at or after another. */
export function compare(one, other) {
  return one[0] - other[0] || one[1] - other[1];
}

/** The time since an anchor, in the scene's time, rounded once to a double and then scaled by a power of two. */
export function elapsed(moment, epoch, tick, unit) {
  return ((moment[0] - epoch) * TICKS + (moment[1] - tick)) * (unit / TICKS);
}

/** The moment of a count of ticks since the start (a BigInt). */
export function momentOf(ticks) {
  const epoch = ticks >> 52n;
  return [Number(epoch), Number(ticks - (epoch << 52n))];
}

/** The count of ticks of a moment, as a BigInt. */
export function ticksOf(moment) {
  return (BigInt(moment[0]) << 52n) + BigInt(moment[1]);
}

/** The moment of a time: exactly (time - start) / unit, rounded down to a tick. */
export function momentAt(time, start, unit) {
  const [now, itsPower] = parts(time);
  const [then, thatPower] = parts(start);
  const low = Math.min(itsPower, thatPower);
  const since = (now << BigInt(itsPower - low)) - (then << BigInt(thatPower - low));
  const shift = low + 52 - Math.round(Math.log2(unit));
  return momentOf(shift >= 0 ? since << BigInt(shift) : since >> BigInt(-shift));
}

/** A moment as the scene's time, rounded. */
export function timeOf(moment, start, unit) {
  return start + (moment[0] + moment[1] / TICKS) * unit;
}

/** A moment later (or earlier) by a part of the scene's time, which is rounded to ticks. */
export function later(moment, time, unit) {
  const units = time / unit;
  const whole = Math.floor(units);
  const tick = moment[1] + Math.floor((units - whole) * TICKS);
  return tick < TICKS ? [moment[0] + whole, tick] : [moment[0] + whole + 1, tick - TICKS];
}

/** The moment at a fraction 0 to 1 of the way between two: exact at both ends, whole ticks between. */
export function between(one, other, fraction) {
  if (fraction >= 1) return other;
  const way = ticksOf(other) - ticksOf(one);
  const part = (way * BigInt(Math.floor(fraction * 2 ** 30))) >> 30n;
  return momentOf(ticksOf(one) + part);
}

/** The fraction of a moment between two others, 0 to 1; 0 if these are one. */
export function fractionOf(moment, one, other) {
  const way = elapsed(other, one[0], one[1], 1);
  return way > 0 ? Math.min(Math.max(elapsed(moment, one[0], one[1], 1) / way, 0), 1) : 0;
}

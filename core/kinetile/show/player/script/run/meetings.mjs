// The two coordinates on an axis that a certificate of the structure watches, read from its shape: they are equal when
// it fails. A phase draws only shapes and ticks, so this module searches for a pair that fits the tick; there may be none.

import { apartAlong } from "./motion.mjs";
import { SHAPES } from "./structure.mjs";

/** The greatest distance of the two coordinates at the tick, in parts of the view: a skin and roundings are far less. */
const NEAR = 1e-9;

/** A coordinate of a shape by its place in `body` and `offset`. */
const coordinateOf = (structure, at) => ({ body: structure.body[at], offset: structure.offset[at] });

/** The coordinates of a shape on an axis. */
function sidesOn(structure, shape, axis) {
  const sides = [];
  for (let at = structure.start[shape] + axis; at < structure.start[shape] + structure.size[shape]; at += 2) {
    sides.push(coordinateOf(structure, at));
  }
  return sides;
}

/** The pairs of coordinates on an axis that a shape may watch; for a fixed shape, its sides with its owner's coordinates. */
function pairsOn(structure, shape, axis, owner, radius) {
  const sides = sidesOn(structure, shape, axis);
  const fixed = sides.every(({ body }) => body < 0) && owner >= 0;
  const own = fixed ? [0, -radius, radius].map((offset) => ({ body: owner, offset })) : sides;
  return own.flatMap((one, at) => (fixed ? sides : sides.slice(at + 1)).map((other) => [one, other]));
}

/**
 * The meeting of the certificate of a shape, as it fails at a moment under the plans of a motion: {axis, one, other,
 * gap, slope}. `one` approaches `other` (a coordinate is {body, offset}, body -1: fixed), `gap` is their difference
 * then, and `slope` its change in time. `owner` is the body of the certificate (-1: unknown), and `size` the size of
 * the view. A bound may watch another one: `rivals` are the shapes to search for it. Null if no two coordinates meet
 * then.
 */
export function meetingOf(structure, shape, motion, moment, owner, size, rivals = []) {
  if (["link", "entry"].includes(SHAPES[structure.shape[shape]])) return null;
  const { vx, vy } = motion.plans;
  let [found, least] = [null, NEAR * size];
  for (const [axis, speeds] of [vx, vy].entries()) {
    const place = ({ body, offset }) => (body < 0 ? 0 : motion.place(body, moment)[axis]) + offset;
    const speed = ({ body }) => (body < 0 ? 0 : speeds[body]);
    const others = rivals.flatMap((rival) => sidesOn(structure, rival, axis)).filter(({ body }) => body >= 0);
    const pairs = rivals.length
      ? sidesOn(structure, shape, axis).flatMap((one) => others.map((other) => [one, other]))
      : pairsOn(structure, shape, axis, owner, motion.bodies.radius[owner] || 0);
    for (const [one, other] of pairs) {
      if (motion.pull(one.body) || motion.pull(other.body)) continue; // the watched coordinate is on a chord
      const slope = speed(other) - speed(one);
      const gap = apartAlong(place(one), place(other), motion.periods[axis]);
      if (slope === 0 || !(Math.abs(gap) <= least)) continue;
      least = Math.abs(gap);
      found = slope < 0 ? { axis, one, other, gap, slope } : { axis, one: other, other: one, gap: -gap, slope: -slope };
    }
  }
  return found;
}

/** A coordinate in words: the label of a bound that is drawn there, or the side of the body. */
export function sideInWords(structure, done, { body, offset }, axis) {
  if (body < 0) return `${"xy"[axis]} = ${Number(offset.toPrecision(6))}`;
  const bound = structure.at(done).find((shape) => {
    if (structure.roles[structure.role[shape]] !== "bound" || SHAPES[structure.shape[shape]] !== "segment") return false;
    const ends = [0, 2].map((point) => coordinateOf(structure, structure.start[shape] + point + axis));
    return ends.every((end) => end.body === body && end.offset === offset);
  });
  const label = bound === undefined ? "" : structure.labels[structure.label[bound]];
  if (label) return `${label} of ${body}`;
  if (offset === 0) return `body ${body}`;
  return `${[["left side", "right side"], ["bottom", "top"]][axis][offset > 0 ? 1 : 0]} of ${body}`;
}

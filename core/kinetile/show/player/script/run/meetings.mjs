// What a certificate of the structure watches, read from its shape: two coordinates on an axis that are one when it
// fails. A phase draws only shapes and ticks, so the pair that fits the tick is looked for; none may.

import { apartAlong } from "./motion.mjs";
import { SHAPES } from "./structure.mjs";

/** How near two coordinates have to be at the tick, in parts of the view: a skin and roundings are far less. */
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

/** The pairs of coordinates on an axis that a shape may watch; of a fixed one, those of its owner and its sides. */
function pairsOn(structure, shape, axis, owner, radius) {
  const sides = sidesOn(structure, shape, axis);
  const fixed = sides.every(({ body }) => body < 0) && owner >= 0;
  const own = fixed ? [0, -radius, radius].map((offset) => ({ body: owner, offset })) : sides;
  return own.flatMap((one, at) => (fixed ? sides : sides.slice(at + 1)).map((other) => [one, other]));
}

/**
 * The meeting at which the certificate of a shape fails, at a moment under the plans of a motion: {axis, one, other,
 * gap, slope}, where `one` comes up to `other` (a coordinate is {body, offset}, body -1: fixed), `gap` is what
 * is between them then, and `slope` its change in time. `owner` is the body whose certificate it is (-1: unknown), and
 * `size` that of the view. A bound may watch another one: `rivals` are the shapes among which that is looked for.
 * Null where no two coordinates meet then.
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
      if (motion.pull(one.body) || motion.pull(other.body)) continue; // what is watched is on a chord
      const slope = speed(other) - speed(one);
      const gap = apartAlong(place(one), place(other), motion.periods[axis]);
      if (slope === 0 || !(Math.abs(gap) <= least)) continue;
      least = Math.abs(gap);
      found = slope < 0 ? { axis, one, other, gap, slope } : { axis, one: other, other: one, gap: -gap, slope: -slope };
    }
  }
  return found;
}

/** A coordinate in words: by the label of a bound that is drawn there, or the side of the body. */
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

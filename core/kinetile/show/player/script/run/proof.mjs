// Certificates as formulas: the gap that a certificate watches, as a function of time under the plans in force, and
// the tick of its failure. A certificate of the structure watches two coordinates on an axis (meetings.mjs); a pair
// watches the distance of two discs.

import { elapsed, later, timeOf } from "./clock.mjs";
import { momentOfEvent, seek } from "./events.mjs";
import { meetingOf, sideInWords } from "./meetings.mjs";
import { KINDS } from "./rows.mjs";
import { SHAPES } from "./structure.mjs";

const short = (number) => String(Number(number.toPrecision(5)));
const signed = (number) => `${number < 0 ? "\u2212" : "+"} ${short(Math.abs(number))}`;
const inTime = (moment, { start, unit }) => Number(timeOf(moment, start, unit).toPrecision(10));

/** The bodies of a shape's coordinates, in their order, each once. */
export function bodiesOf(structure, shape) {
  const from = structure.start[shape];
  return [...new Set(structure.body.subarray(from, from + structure.size[shape]))].filter((body) => body >= 0);
}

/** A shape in words: its kind and its bodies. */
export function shapeInWords(structure, shape) {
  const [role, label] = [structure.roles[structure.role[shape]], structure.labels[structure.label[shape]]];
  const those = bodiesOf(structure, shape);
  const named = label && label !== role ? `${role} ${label}` : role;
  if (SHAPES[structure.shape[shape]] === "link") return `${named} ${those.join("-")}`;
  return those.length ? `${named} of ${those.join(", ")}` : named;
}

/**
 * The certificate of a shape in words, at a moment of a run {motion, done, structure}: {title, formula, gap, fails}.
 * `gap` is a function of the time since that moment, `fails` the moment of its root. Both are null without a
 * certificate, or if the shape does not show the watched coordinates; then `formula` says so.
 */
export function proofOf(run, shape, moment, held, owner = -1) {
  const { structure, motion, done } = run;
  if (SHAPES[structure.shape[shape]] === "link") return proofOfPair(run, bodiesOf(structure, shape), moment, held);
  const title = shapeInWords(structure, shape);
  if (Number.isNaN(structure.epoch[shape])) return { title, formula: "nothing is scheduled for it", gap: null, fails: null };
  const fails = [structure.epoch[shape], structure.tick[shape]];
  const size = Math.max(held.box[2] - held.box[0], held.box[3] - held.box[1]);
  const isBound = (each) => structure.roles[structure.role[each]] === "bound";
  const rivals = isBound(shape) ? structure.at(done).filter((each) => each !== shape && isBound(each)) : [];
  const found = meetingOf(structure, shape, motion, fails, owner, size, rivals);
  const when = `fails at ${inTime(fails, held)}`;
  if (!found) return { title, formula: `${when}; its drawing does not show what its certificate watches`, gap: null, fails };
  const since = elapsed(fails, ...moment, held.unit);
  const gap = (time) => found.gap + found.slope * (time - since);
  const [one, other] = [found.one, found.other].map((side) => sideInWords(structure, done, side, found.axis));
  const formula = `${other} \u2212 ${one} = ${short(gap(0))} ${signed(found.slope)} t > 0; ${when}`;
  return { title, formula, gap, fails };
}

/** The same for two bodies: their distance less their radii. Its root is the contact, if the plans do not change. */
export function proofOfPair({ motion, events, done, passing }, [a, b], moment, held) {
  const title = `pair ${a}-${b}`;
  const { radius, outline, x } = motion.bodies;
  if (outline?.[a] || outline?.[b] || !(a < x.length && b < x.length)) {
    return { title, formula: "the gap of two shapes is not one formula", gap: null, fails: null };
  }
  const both = [Math.min(a, b), Math.max(a, b)];
  const [[ux, uy], [vx, vy]] = both.map((body) => motion.velocity(body, moment));
  const [wx, wy, reach] = [vx - ux, vy - uy, radius[a] + radius[b]];
  const [from, to] = both.map((body) => motion.pull(body) ?? [0, 0]);
  const bends = to.map((pull, axis) => 0.5 * (pull - from[axis])); // 0 if both have the same acceleration
  const met = metNext(events, done, a, b);
  const images = motion.images(...both, met ?? moment);
  const isPassing = ({ image }) => passing.holds(done, ...both, image);
  const through = images.filter(isPassing).length;
  const passes = `they are passing through each other${through > 1 ? `, through ${through} images` : ""}`;
  const next = images.find((each) => !isPassing(each)); // the image of the contact: the nearest that does not pass then
  const since = met ? elapsed(met, ...moment, held.unit) : 0;
  const [dx, dy] = [wx, wy].map((speed, axis) => (next ?? images[0]).apart[axis] - (speed + bends[axis] * since) * since);
  const fails = next ? met ?? (bends.some(Number) ? null : rootOf([dx, dy], [wx, wy], reach, moment, held.unit)) : null;
  if (through && !fails) return { title, formula: passes, gap: null, fails: null };
  const gap = (time) => Math.hypot(dx + (wx + bends[0] * time) * time, dy + (wy + bends[1] * time) * time) - reach;
  const square = (place, speed, bend) => `(${short(place)} ${signed(speed)} t${bend ? ` ${signed(bend)} t\u00b2` : ""})\u00b2`;
  const straight = motion.periods.some((period) => period) ? "no contact through the nearest image under these plans" : "no contact under these plans";
  const none = bends.some(Number) ? "no contact is the next event of both" : straight;
  const when = fails ? `contact at ${inTime(fails, held)}${met ? "" : " if nothing comes before"}` : none;
  return { title, formula: `\u221a(${square(dx, wx, bends[0])} + ${square(dy, wy, bends[1])}) \u2212 ${short(reach)} > 0; ${when}${through ? `; ${passes}` : ""}`, gap, fails };
}

/** The moment of the recorded contact of two bodies, if neither gets another plan before it; or null. */
function metNext(events, done, a, b) {
  const [one, other] = [a, b].map((body) => {
    let event = seek(events, done, 1, "all", body);
    while (event >= 0 && KINDS[events.kind[event]] === "structural") event = seek(events, event + 1, 1, "all", body);
    return event;
  });
  return one >= 0 && one === other && ["disc", "pass"].includes(KINDS[events.kind[one]]) ? momentOfEvent(events, one) : null;
}

/** The first contact of two discs in doubles, for a curve; the run's own arithmetic is exact. Null without a contact. */
function rootOf([dx, dy], [wx, wy], reach, moment, unit) {
  const [square, nears, rest] = [wx * wx + wy * wy, -(dx * wx + dy * wy), dx * dx + dy * dy - reach * reach];
  const under = nears * nears - square * rest;
  if (nears <= 0 || under < 0 || rest < 0) return null;
  return later(moment, rest / (nears + Math.sqrt(under)), unit);
}

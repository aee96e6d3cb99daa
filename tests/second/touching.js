// Rules 5, 5p, 5s, 7, 7s, 11 and 11s: the contact of two bodies, with its image, and the parting of two that pass. Everything here is exact; null is "none".

import { carried, place, velocityAt } from "./clock.js";
import { add, dot, exact, floorQuotient, less, multiply, sign, square, subtract, whole } from "./exact.js";
import { nearestFaces } from "./shapes.js";
import { FAR, at, firstWhere, goes, growth, inOrder, polynomial, signChanges, squareLess } from "./signs.js";

const LONGEST = 1n << 54n; // the most ticks of a plan with a periodic axis
const [NEARER, FARTHER] = [-1, 1];

/** The flight of body 2 relative to body 1: the later anchor s, the flight [d, step, bend], with the separation d + step n + bend n^2 at s + n, and the sum of their reaches, by the r of rules 2 and 3s. */
export function relative(plan1, r1, plan2, r2, q) {
  const s = plan1.A > plan2.A ? plan1.A : plan2.A;
  const d = less(place(plan2, s, q), place(plan1, s, q));
  const v = less(velocityAt(plan2, s, q), velocityAt(plan1, s, q));
  const a = less([plan2.exact.ax, plan2.exact.ay], [plan1.exact.ax, plan1.exact.ay]);
  const [[stepX, bendX], [stepY, bendY]] = [0, 1].map((axis) => carried(v[axis], a[axis], q));
  return { s, flight: [d, [stepX, stepY], [bendX, bendY]], reach: add(exact(r1), exact(r2)) };
}

/** The same through the image (m, n) of body 2 (rule 5p). */
export function throughImage(plan1, r1, plan2, r2, q, periods, { m, n }) {
  return shifted(relative(plan1, r1, plan2, r2, q), [m + plan2.kx - plan1.kx, n + plan2.ky - plan1.ky], periods);
}

function shifted({ flight: [d, ...way], ...course }, turns, periods) {
  return { ...course, flight: [d.map((each, axis) => (periods[axis] === null ? each : add(each, multiply(whole(turns[axis]), exact(periods[axis]))))), ...way] };
}

/**
 * The tick and the image of a contact of two bodies: {tick, m, n} (rule 5p). `here` is the flight of the second relative to the first through (0, 0);
 * `leftOut` has the images {m, n} to omit. A tick after the end of every plan is null too. `touch` returns the tick of a flight as from `relative`, through an image.
 *
 * Only images within reach in a time h after s are computed, and without a contact by then, in twice that time.
 */
export function imageTick(here, periods, leftOut, touch) {
  const { s, flight: [d, step], reach } = here;
  const asked = new Map(); // the tick of an image, by its numbers
  for (let h = 1n << 49n; h <= LONGEST; h *= 2n) {
    const [ms, ns] = [0, 1].map((axis) => {
      if (periods[axis] === null) return [0n];
      const flown = multiply(step[axis], whole(h + 1n));
      const [low, high] = sign(flown) < 0 ? [add(d[axis], flown), d[axis]] : [d[axis], add(d[axis], flown)];
      const P = exact(periods[axis]); // -reach <= d + m P <= reach at some time
      const found = [];
      for (let m = -floorQuotient(add(high, reach), P); m <= floorQuotient(subtract(reach, low), P); m += 1n) found.push(m);
      return found;
    });
    let first = null;
    for (const m of ms) {
      for (const n of ns) {
        if (leftOut.some((image) => image.m === m && image.n === n)) continue;
        if (!asked.has(`${m} ${n}`)) asked.set(`${m} ${n}`, touch(shifted(here, [m, n], periods), { m, n }));
        const tick = asked.get(`${m} ${n}`);
        if (tick !== null && tick <= s + h && (first === null || tick < first.tick)) first = { tick, m, n };
      }
    }
    if (first !== null) return first;
  }
  return null;
}

/** The tick of contact of two bodies with a flight as from `relative`, with M their difference, from a tick on; `met` if they have just met. */
export function touchTick({ s, flight, reach }, M, met = false, from = s) {
  if (met && flight[2].every((each) => sign(each) === 0)) return null; // rules 7 and 7s
  const near = squareLess(flight, square(reach)); // each body is within its r from its place
  if (M.faces.length && firstWhere((n) => at(near, n) <= 0n, [near], 0n) === null) return null;
  const seen = features(flight, M);
  const counted = met ? firstCounted(flight, seen, M) : 0n;
  if (counted === null) return null;
  const start = from - s > counted ? from - s : counted;
  const inner = M.faces.length && sign(M.inner) > 0 ? features(flight, { ...M, R: M.inner }) : null;
  const ticks = sign(M.R) > 0 ? firstTouch(seen, inner, near, start) : firstVisit(seen.faces, flight, M, start);
  return ticks === null ? null : s + ticks;
}

/** The parting tick of two bodies with a flight as from `relative` that have begun to pass at a tick (rules 11 and 11s). */
export function partTick({ s, flight }, M, begun) {
  const seen = features(flight, M);
  const start = begun > s ? begun - s : 0n;
  const isOut = (n) => seen.faces.some(({ g, grows }) => goes(FARTHER, g, grows, n));
  const ticks = sign(M.R) > 0 ? firstOfFeatures(FARTHER, seen, start) : firstWhere(isOut, seen.faces.flatMap(({ g, grows }) => [g, grows]), start);
  return ticks === null ? null : s + ticks;
}

/**
 * The faces and corners of M, relative to the body, with polynomials: for a face g, u, u - t.t as `past`, and g^2 - (R |n|)^2 as `rest`, with the strip for R if R = 0;
 * for a corner Q as `rest`, and the faces from it and to it; and the growth of the value that falls at an approach.
 */
function features([d, step, bend], M) {
  const faces = M.faces.map(({ p, next, t, n }) => {
    const along = (axis, from) => [less(d, from), step, bend].map((each) => dot(axis, each));
    const margin = sign(M.R) > 0 ? M.R : M.strip;
    const rest = squareLess(along(n, p).map((each) => [each, exact(0)]), multiply(square(margin), dot(t, t)));
    const [g, u, past] = [along(n, p), along(t, p), along(t, next)].map(polynomial);
    return { p, next, g, u, past, rest, grows: growth(g) };
  });
  const corners = M.corners.map((c) => {
    const rest = squareLess([less(d, c), step, bend], square(M.R));
    return { rest, grows: growth(rest), from: faces.find(({ p }) => p === c), to: faces.find(({ next }) => next === c) };
  });
  return { faces, corners };
}

function isOver({ g, u, past }, n) {
  return at(g, n) >= 0n && at(u, n) >= 0n && at(past, n) <= 0n;
}

/** True if the body is beside a corner; always for the only corner of a point. */
function isBeside({ from, to }, n) {
  return from === undefined || (at(from.u, n) <= 0n && at(to.past, n) >= 0n);
}

function isInside(faces, n) {
  return faces.length > 2 && faces.every(({ g }) => at(g, n) < 0n);
}

/** The first n from a start on with a contact of two bodies with R > 0 that come nearer than R' before they part, or null; `inner` has the features for R'. */
function firstTouch(seen, inner, near, start) {
  for (let from = start; ; ) {
    const begin = firstWithin(seen, near, from);
    if (begin === null || inner === null) return begin;
    const end = firstOfFeatures(FARTHER, seen, begin + 1n);
    const deep = firstWithin(inner, near, begin);
    if (deep !== null && (end === null || deep < end)) return begin;
    if (end === null) return null;
    from = end;
  }
}

/** The first n from a start on when two bodies come within R; never if `near` is above 0 at n + 1. */
function firstWithin(seen, near, start) {
  const { faces } = seen;
  const enters = faces.length > 2 ? firstWhere((n) => isInside(faces, n + 1n) && !isInside(faces, n), faces.map(({ g }) => g), start) : null;
  const touches = firstOfFeatures(NEARER, seen, start, faces.length ? near : [0n]);
  return enters === null || (touches !== null && touches < enters) ? touches : enters;
}

/** The first n from a start on when a face that d(n + 1) is over, or a corner that it and d(n) are beside, comes nearer than R, or goes farther; never if `near` is above 0 at n + 1. */
function firstOfFeatures(side, { faces, corners }, start, near = [0n]) {
  const cuts = [start + 1n, ...[near, ...faces.flatMap(({ g, u, past }) => [g, u, past])].flatMap((p) => signChanges(p, start + 1n))].sort(inOrder);
  for (const [i, low] of cuts.entries()) {
    const high = cuts[i + 1] ?? FAR + 1n; // from low on, before high, it is over or beside the same ones
    if (low === high || at(near, low) > 0n) continue;
    const there = [...faces.filter((face) => isOver(face, low)), ...corners.filter((corner) => isBeside(corner, low))];
    const found = there.map(({ rest, grows, from, to }) => {
      const holds = (n) => goes(side, rest, grows, n) && isBeside({ from, to }, n); // always true for a face
      return firstWhere(holds, [rest, grows, ...(from ? [from.u, to.past] : [])], low - 1n, high - 1n);
    });
    const ticks = found.filter((n) => n !== null).sort(inOrder);
    if (ticks.length) return ticks[0];
  }
  return null;
}

/** The n of rule 5s for R = 0, from a start on: visits one after the other. */
function firstVisit(faces, flight, M, start) {
  const gaps = faces.map(({ g }) => g);
  const isDeep = (n) => faces.every(({ rest }) => at(rest, n) > 0n);
  for (let end = start; end < FAR; ) {
    const begin = firstWhere((n) => isInside(faces, n), gaps, end);
    if (begin === null) return null;
    end = firstWhere((n) => !isInside(faces, n), gaps, begin) ?? FAR;
    if (firstWhere(isDeep, faces.map(({ rest }) => rest), begin, end) === null) continue; // flush
    if (begin > start) return begin - 1n;
    const nearest = nearestFaces(placeAt(flight, begin), M).map((i) => faces[i].grows);
    const fall = firstWhere((n) => nearest.every((grows) => at(grows, n) < 0n), nearest, begin, end - 1n);
    if (fall !== null) return fall;
  }
  return null;
}

/** The first n that counts for two that have just met (rules 7 and 7s), or null. */
function firstCounted(flight, seen, M) {
  const grows = away(flight, seen, M);
  const presses = grows.every((each) => at(each, 0n) <= 0n && at(each, 1n) < at(each, 0n));
  return presses ? 0n : firstWhere((n) => grows.some((each) => at(each, n) > 0n), grows, 0n);
}

/** The growths of Q, or of all e.d (rule 7s): one is above 0 if two bodies that have just met part. */
function away([d, step, bend], { faces, corners }, M) {
  if (faces.length === 0) return [corners[0].grows];
  const isAbove = ({ g }) => at(g, 0n) > 0n;
  const over = faces.find((face) => isAbove(face) && isOver(face, 0n));
  if (sign(M.R) > 0 && over) return [over.grows];
  const beside = corners.findIndex((corner) => isBeside(corner, 0n));
  if (sign(M.R) === 0 || beside < 0 || (faces.length > 2 && !faces.some(isAbove))) return nearestFaces(d, M).map((i) => faces[i].grows);
  const e = less(d, M.corners[beside]);
  return [growth(polynomial([e, step, bend].map((each) => dot(e, each))))];
}

function placeAt([d, step, bend], n) {
  return d.map((each, axis) => add(each, multiply(whole(n), add(step[axis], multiply(whole(n), bend[axis])))));
}

// Rules 5t, 7t and 11t: convex shapes whose bodies are accelerated. A face or a corner of M has polynomials whose signs at whole ticks decide; null is "none".

import { at, bentPart, bentTouch, firstWhere, growth, inOrder, signChanges, squareLess, way, whole } from "./bent.js";
import { dot, FAR } from "./contact.js";
import { add, compare, exact, floorQuotient, minus, multiply, sign, signedSquare, square } from "./exact.js";
import { less } from "./shapes.js";

const TWO = { n: 1n, e: 1 };

/** The tick at which two bodies meet, as `relative` has them, M being their difference, from a tick on; `barred` if they have just met. */
export function bentShapeTouch(course, M, q, barred, from) {
  if (M.corners.length === 1) return bentTouch(fromPoint(course, M), q, barred, from);
  const flight = way(course, q);
  const near = squareLess(flight, square(course.R)); // each body is within its r from its place
  if (firstWhere((n) => at(near, n) <= 0n, [near], 0n) === null) return null;
  const counted = barred ? firstCounted(flight, M) : 0n;
  if (counted === null) return null;
  const start = from - course.s > counted ? from - course.s : counted;
  const reaches = ({ rest, growth }, n) => at(rest, n + 1n) < 0n && at(growth, n) < 0n;
  const ticks = sign(M.R) > 0 ? firstOfFeatures(reaches, features(flight, M), start, near) : firstVisit(features(flight, M).faces, flight, M, start);
  return ticks === null ? null : course.s + ticks;
}

/** The tick at which two bodies part, as `relative` has them, that have begun to pass at a tick (rule 11t). */
export function bentShapePart(course, M, q, begun) {
  if (M.corners.length === 1) return bentPart(fromPoint(course, M), q, begun);
  const seen = features(way(course, q), M);
  const start = begun > course.s ? begun - course.s : 0n;
  const isOut = (n) => seen.faces.some(({ g }) => at(g, n + 1n) > 0n);
  const isFar = ({ rest }, n) => at(rest, n + 1n) > 0n;
  const ticks = sign(M.R) > 0 ? firstOfFeatures(isFar, seen, start) : firstWhere(isOut, seen.faces.map(({ g }) => g), start);
  return ticks === null ? null : course.s + ticks;
}

function fromPoint(course, { corners: [p], R }) {
  return { ...course, d: less(course.d, p), R };
}

/**
 * The faces and corners of M as the body sees them: of a face the polynomials g, u, u - t.t as `past`, and g^2 - (R |n|)^2 as `rest`, with the strip for R if R = 0;
 * of a corner Q as `rest`, and the faces from it and to it.
 */
function features([d, step, bend], M) {
  const faces = M.faces.map(({ p, next, t, n }) => {
    const along = (axis, from) => [less(d, from), step, bend].map((each) => dot(axis, each));
    const [g, u, past] = [along(n, p), along(t, p), along(t, next)];
    const margin = sign(M.R) > 0 ? M.R : M.strip;
    const rest = squareLess(g.map((each) => [each, exact(0)]), multiply(square(margin), dot(t, t)));
    return { p, next, g: whole(g), u: whole(u), past: whole(past), rest, growth: growth(whole(g)) };
  });
  const corners = M.corners.map((c) => {
    const Q = squareLess([less(d, c), step, bend], square(M.R));
    return { rest: Q, growth: growth(Q), from: faces.find(({ p }) => p === c), to: faces.find(({ next }) => next === c) };
  });
  return { faces, corners };
}

function isOver({ g, u, past }, n) {
  return at(g, n) >= 0n && at(u, n) >= 0n && at(past, n) <= 0n;
}

function isBeside({ from, to }, n) {
  return at(from.u, n) <= 0n && at(to.past, n) >= 0n;
}

/**
 * The first n from a start on for which something holds of a face that d(n + 1) is over, or of a corner that it is beside; by the signs of its polynomials.
 * It never holds where `near` is above 0 at n + 1.
 */
function firstOfFeatures(holds, { faces, corners }, start, near = [0n]) {
  const cuts = [start + 1n, ...[near, ...faces.flatMap(({ g, u, past }) => [g, u, past])].flatMap((p) => signChanges(p, start + 1n))].sort(inOrder);
  for (const [i, low] of cuts.entries()) {
    const high = cuts[i + 1] ?? FAR + 1n; // from low on, before high, it is over or beside the same ones
    if (low === high || at(near, low) > 0n) continue;
    const there = [...faces.filter((face) => isOver(face, low)), ...corners.filter((corner) => isBeside(corner, low))];
    const found = there.map((feature) => firstWhere((n) => holds(feature, n), [feature.rest, feature.growth], low - 1n, high - 1n));
    const ticks = found.filter((n) => n !== null).sort(inOrder);
    if (ticks.length) return ticks[0];
  }
  return null;
}

/** The n of rule 5t for R = 0, from a start on: visits one after the other. */
function firstVisit(faces, flight, M, start) {
  const gaps = faces.map(({ g }) => g);
  const isIn = (n) => gaps.every((g) => at(g, n) < 0n);
  const isDeep = (n) => faces.every(({ rest }) => at(rest, n) > 0n);
  for (let end = start; end < FAR; ) {
    const begin = firstWhere(isIn, gaps, end);
    if (begin === null) return null;
    end = firstWhere((n) => !isIn(n), gaps, begin) ?? FAR;
    if (firstWhere(isDeep, faces.map(({ rest }) => rest), begin, end) === null) continue; // flush
    if (begin > start) return begin - 1n;
    const { growth } = faces[nearestFace(placeAt(flight, begin), M)];
    const fall = firstWhere((n) => at(growth, n) < 0n, [growth], begin, end - 1n);
    if (fall !== null) return fall;
  }
  return null;
}

/** The first n that counts for two that have just met (rule 7t). */
function firstCounted([d, step, bend], M) {
  const e = direction(d, M);
  const [once, twice] = [dot(e, add2(step, bend)), multiply(TWO, dot(e, bend))]; // e.(d(n + 1) - d(n)) is once + twice n
  if (sign(twice) < 0 || sign(once) > 0) return 0n;
  return sign(twice) === 0 ? null : floorQuotient(minus(once), twice) + 1n;
}

/** The e of rule 7t. */
function direction(d, M) {
  const { faces, corners } = features([d, [exact(0), exact(0)], [exact(0), exact(0)]], M);
  const isAbove = ({ g }) => at(g, 0n) > 0n;
  const over = faces.findIndex((face) => isAbove(face) && isOver(face, 0n));
  if (sign(M.R) > 0 && over >= 0) return M.faces[over].n;
  const beside = corners.findIndex((corner) => isBeside(corner, 0n));
  if (sign(M.R) > 0 && beside >= 0 && (faces.length === 2 || faces.some(isAbove))) return less(d, M.corners[beside]);
  return M.faces[nearestFace(d, M)].n;
}

/** The number of the face with the largest g / |n| at a place, of several the smallest. */
function nearestFace(d, { faces }) {
  const gaps = faces.map(({ p, n }) => ({ above: signedSquare(dot(n, less(d, p))), below: dot(n, n) }));
  return gaps.reduce((best, gap, i) => (compare(multiply(gap.above, gaps[best].below), multiply(gaps[best].above, gap.below)) > 0 ? i : best), 0);
}

function placeAt([d, step, bend], n) {
  return add2(d, scaled(add2(step, scaled(bend, n)), n));
}

function scaled(vector, n) {
  return vector.map((each) => multiply(each, { n, e: 0 }));
}

function add2([x1, y1], [x2, y2]) {
  return [add(x1, x2), add(y1, y2)];
}

// Rules 5t, 7t and 11t: convex shapes whose bodies are accelerated. A face or a corner of M has polynomials whose signs at whole ticks decide; null is "none".

import { at, bentPart, bentTouch, firstWhere, growth, squareLess, way, whole } from "./bent.js";
import { dot } from "./contact.js";
import { add, compare, exact, floorQuotient, minus, multiply, sign, signedSquare, square, subtract } from "./exact.js";
import { less } from "./shapes.js";

const TWO = { n: 1n, e: 1 };

/** The tick at which two bodies meet, as `relative` has them, M being their difference, from a tick on; `barred` if they have just met. */
export function bentShapeTouch(course, M, q, barred, from) {
  if (M.corners.length === 1) return bentTouch(fromPoint(course, M), q, barred, from);
  const flight = way(course, q);
  const counted = barred ? firstCounted(flight, M) : 0n;
  if (counted === null) return null;
  const start = from - course.s > counted ? from - course.s : counted;
  const ticks = sign(M.R) > 0 ? firstReach(features(flight, M), start) : firstVisit(features(flight, M), flight, M, start);
  return ticks === null ? null : course.s + ticks;
}

/** The tick at which two bodies part, as `relative` has them, that have begun to pass at a tick (rule 11t). */
export function bentShapePart(course, M, q, begun) {
  if (M.corners.length === 1) return bentPart(fromPoint(course, M), q, begun);
  const { faces, corners } = features(way(course, q), M);
  const isOut = (n) => faces.some(({ g }) => at(g, n) > 0n);
  const isFar = (n) => faces.some((face) => isOver(face, n) && at(face.rest, n) > 0n) || corners.some((c) => isBeside(c, n) && at(c.Q, n) > 0n);
  const start = begun > course.s ? begun - course.s : 0n;
  const ticks = firstWhere((n) => (sign(M.R) > 0 ? isFar : isOut)(n + 1n), polynomials(faces, corners), start);
  return ticks === null ? null : course.s + ticks;
}

function fromPoint(course, { corners: [p], R }) {
  return { ...course, d: less(course.d, p), R };
}

/**
 * The faces and corners of M as the body sees them: of a face the polynomials g, u, u - t.t as `past`, g^2 - (R |n|)^2 as `rest`, and g^2 - (w |n|)^2 as `depth`,
 * w being the strip; of a corner Q, and the faces from it and to it.
 */
function features([d, step, bend], M) {
  const faces = M.faces.map(({ p, next, t, n }) => {
    const along = (axis, from) => [less(d, from), step, bend].map((each) => dot(axis, each));
    const squareOfGapLess = (w) => squareLess(along(n, p).map((each) => [each, exact(0)]), multiply(square(w), dot(t, t)));
    const [g, u, past] = [along(n, p), along(t, p), along(t, next)].map(whole);
    return { p, next, g, u, past, rest: squareOfGapLess(M.R), depth: squareOfGapLess(M.strip), growth: growth(g) };
  });
  const corners = M.corners.map((c) => {
    const Q = squareLess([less(d, c), step, bend], square(M.R));
    return { Q, growth: growth(Q), from: faces.find(({ p }) => p === c), to: faces.find(({ next }) => next === c) };
  });
  return { faces, corners };
}

function polynomials(faces, corners) {
  return [...faces.flatMap(({ g, u, past, rest, depth, growth }) => [g, u, past, rest, depth, growth]), ...corners.flatMap(({ Q, growth }) => [Q, growth])];
}

function isOver({ g, u, past }, n) {
  return at(g, n) >= 0n && at(u, n) >= 0n && at(past, n) <= 0n;
}

function isBeside({ from, to }, n) {
  return at(from.u, n) <= 0n && at(to.past, n) >= 0n;
}

/** The n of rule 5t for R > 0, from a start on. */
function firstReach({ faces, corners }, start) {
  const reaches = (n) =>
    faces.some((face) => isOver(face, n + 1n) && at(face.rest, n + 1n) < 0n && at(face.growth, n) < 0n) ||
    corners.some((corner) => isBeside(corner, n + 1n) && at(corner.Q, n + 1n) < 0n && at(corner.growth, n) < 0n);
  return firstWhere(reaches, polynomials(faces, corners), start);
}

/** The n of rule 5t for R = 0, from a start on: visits one after the other. */
function firstVisit({ faces, corners }, flight, M, start) {
  const first = (holds, from) => (from === null ? null : firstWhere(holds, polynomials(faces, corners), from));
  const isIn = (n) => faces.every(({ g }) => at(g, n) < 0n);
  const isDeep = (n) => isIn(n) && faces.every(({ depth }) => at(depth, n) > 0n);
  const isBefore = (n, end) => n !== null && (end === null || n < end);
  for (let end = start; end !== null; ) {
    const begin = first(isIn, end);
    end = first((n) => !isIn(n), begin);
    if (begin === null || !isBefore(first(isDeep, begin), end)) continue; // none, or flush
    if (begin > start) return begin - 1n;
    const { growth } = faces[nearestFace(placeAt(flight, begin), M)];
    const fall = first((n) => at(growth, n) < 0n, begin);
    if (fall !== null && isBefore(fall + 1n, end)) return fall;
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

// Rules 2s, 3s, 5s, 6s, 9s and 11s: bodies of convex shapes. What decides is exact; reaches and directions are doubles.

import { add, compare, exact, floorLaterRoot, floorRoot, minus, multiply, nearest, sign, signedSquare, square, subtract } from "./exact.js";
import { discriminant, dot, FAR, firstTouch } from "./contact.js";
import { along } from "./exchange.js";

const view = new DataView(new ArrayBuffer(8));

/** A shape of a core and r, with its size, the r of rule 3s, and what stands for r at the walls (6s): left, right, bottom and top. */
export function makeShape(core, r) {
  const [xs, ys] = [0, 1].map((axis) => core.map((corner) => corner[axis]));
  const corners = core.map((corner) => corner.map(exact));
  const reaches = (size) => {
    const rest = subtract(exact(size), exact(r));
    return sign(rest) >= 0 && corners.every((c) => compare(square(rest), dot(c, c)) >= 0);
  };
  let size = r + Math.max(...core.map((corner) => Math.hypot(...corner))); // near it, and the steps go to it
  while (!reaches(size)) size = step(size, 1n);
  while (size > 0 && reaches(step(size, -1n))) size = step(size, -1n);
  const extent = r + Math.max(...core.flat().map(Math.abs));
  return { corners, r, size, extent, sides: [r - Math.min(...xs), r + Math.max(...xs), r - Math.min(...ys), r + Math.max(...ys)] };
}

/** Whether all shapes are discs around their places, for which the rules of shapes say nothing. */
export function areDiscs(shapes) {
  return shapes.every(({ corners }) => corners.length === 1 && corners[0].every((each) => sign(each) === 0));
}

/**
 * The difference M of two shapes: its corners and its faces, each in the order of their numbers, and R. A face has its corners p and next, its
 * way t, its normal n, and the normals of the faces before and after it.
 */
export function difference(a, b) {
  const corners = hull(a.corners.flatMap((alpha) => b.corners.map((beta) => less(alpha, beta))));
  const faces = corners.map((p, i) => {
    const next = corners[(i + 1) % corners.length];
    const t = less(next, p);
    return { p, next, t, n: [t[1], minus(t[0])] };
  });
  faces.forEach((face, i) => Object.assign(face, { before: faces.at(i - 1).n, after: faces[(i + 1) % faces.length].n }));
  faces.sort((f, g) => sign(cross(up(g.n), up(f.n))) || isUp(g.n) - isUp(f.n));
  const strip = exact(corners.length > 1 ? 2 ** -39 * (a.extent + b.extent) : 0);
  return { corners, faces: corners.length > 1 ? faces : [], R: add(exact(a.r), exact(b.r)), strip };
}

/** When and at which feature two bodies a < b meet, as `relative` has them, M being their difference: {tick, face} or {tick, corner}, or null. */
export function shapeTouch({ s, d, v }, M, q) {
  if (!reachesBeside(d, v, M, (x) => x) || !reachesBeside(d, v, M, minus)) return null;
  const { faces, corners } = seen(d, v, M);
  const near = nearestFeature(faces, corners, v);
  if (isTouching(near, M.R)) return near.falls ? { tick: s, ...near.feature } : null;

  // Of the members of the union that are entered, faces first, the first with the smallest tick.
  const entered = faces.filter((face) => isEntered(face, v, M)).map(({ face, g, w, margin }) => {
    const ticks = floorRoot(g, margin, multiply(minus(w), exact(q)));
    return { tick: ticks < FAR ? s + ticks : null, face };
  });
  const rounded = corners.map(({ corner, d }) => ({ tick: firstTouch({ s, d, v, R: M.R }, q), corner }));
  const met = [...entered, ...rounded].filter(({ tick }) => tick !== null);
  return met.reduce((first, each) => (first === null || each.tick < first.tick ? each : first), null);
}

/** Whether, on one side of the line of d, a point within R of M is farther from the line than the strip. */
function reachesBeside(d, v, M, turned) {
  const least = multiply(signedSquare(subtract(M.strip, M.R)), dot(v, v));
  return M.corners.some((c) => compare(signedSquare(turned(cross(v, less(c, d)))), least) > 0);
}

/** The faces and corners of M as the body at d sees them. */
function seen(d, v, M) {
  const faces = M.faces.map(({ p, t, n, before, after }, face) => {
    const [g, u, tt] = [dot(n, less(d, p)), dot(t, less(d, p)), dot(t, t)];
    const over = sign(u) >= 0 && compare(u, tt) <= 0;
    return { face, g, u, tt, over, w: dot(n, v), along: dot(t, v), margin: multiply(square(M.R), tt), before, after };
  });
  const corners = M.corners.map((c, corner) => ({ corner, d: less(d, c) }));
  return { faces, corners };
}

/** The tick at which two bodies a < b part (rule 11s), as `relative` has them, or null. */
export function shapePart({ s, d, v }, M, q) {
  const { faces, corners } = seen(d, v, M);
  const roots = corners.map((corner) => discriminant({ d: corner.d, v, R: M.R }));
  const falls = faces.some((face) => isEntered(face, v, M)) || roots.some(({ B, D }) => sign(B) < 0 && sign(D) > 0);
  if (!isTouching(nearestFeature(faces, corners, v), M.R) && !falls) return s;
  if (sign(dot(v, v)) === 0) return null;
  // It leaves M with its margin where it leaves a member of the union for the last time.
  const left = faces.filter(isLeft).map(({ g, w, margin }) => floorLaterRoot(minus(g), margin, multiply(w, exact(q))));
  const rounded = roots.filter(({ D }) => sign(D) >= 0).map(({ B, D, vv }) => floorLaterRoot(minus(B), D, multiply(vv, exact(q))));
  const ticks = [...left, ...rounded].reduce((one, two) => (one > two ? one : two));
  return ticks >= FAR ? null : s + ticks;
}

/** The nearest feature; the distance from it, squared with its sign, as a quotient; and whether the distance falls. */
function nearestFeature(faces, corners, v) {
  const isFlat = faces.length === 2;
  if (faces.length && faces.every(({ g, over }) => sign(g) <= 0 && (over || !isFlat))) {
    const deeper = (f, h) => compare(multiply(signedSquare(f.g), h.tt), multiply(signedSquare(h.g), f.tt)); // g / |n|, squared
    const largest = faces.filter((face) => faces.every((other) => deeper(face, other) >= 0));
    const { face, g, tt } = largest[0];
    return { feature: { face }, distance: [signedSquare(g), tt], falls: largest.every(({ w }) => sign(w) < 0) };
  }
  const face = faces.find(({ g, over }) => over && sign(g) > 0);
  if (face) return { feature: { face: face.face }, distance: [square(face.g), face.tt], falls: sign(face.w) < 0 };
  const { corner, d } = corners.reduce((a, b) => (compare(dot(b.d, b.d), dot(a.d, a.d)) < 0 ? b : a));
  return { feature: { corner }, distance: [dot(d, d), exact(1)], falls: sign(dot(d, v)) < 0 };
}

function isTouching({ distance: [above, below] }, R) {
  return compare(above, multiply(square(R), below)) <= 0;
}

/** Whether g grows to R |n| at a time when the body is over the face. */
function isLeft({ g, u, tt, w, along, margin }) {
  if (sign(w) <= 0) return false;
  const A = subtract(multiply(u, w), multiply(along, g)); // there u is (A + along sqrt(margin)) / w
  const root = minus(multiply(signedSquare(along), margin));
  return compare(signedSquare(A), root) >= 0 && compare(signedSquare(subtract(A, multiply(tt, w))), root) <= 0;
}

/** Whether g falls to R |n| after s where the body is over the face, and sigma falls there. */
function isEntered({ g, u, tt, w, along, margin, before, after }, v, M) {
  if (sign(w) >= 0 || sign(g) <= 0 || compare(square(g), margin) <= 0) return false;
  // There u is (A - along sqrt(margin)) / -w.
  const A = add(multiply(u, minus(w)), multiply(along, g));
  const root = multiply(signedSquare(along), margin);
  const low = compare(signedSquare(A), root);
  const high = compare(signedSquare(subtract(A, multiply(tt, minus(w)))), root);
  if (low < 0 || high > 0) return false;
  if (sign(M.R) > 0) return true;
  // Without a margin, it may pass through a corner along the face beside, or out of it; and there is no inside of a line.
  return M.corners.length > 2 && (low > 0 || sign(dot(before, v)) < 0) && (high < 0 || sign(dot(after, v)) < 0);
}

/** The unit normal along which two bodies a < b that are [dx, dy] apart exchange momentum, after both are anchored, and its face, if it is that of one: rules 9s and 9t. */
export function shapeNormal(a, b, [dx, dy], M, q = 0) {
  // How far a body flies in a tick, in ticks.
  const flown = ({ vx, vy, ax = 0, ay = 0 }) => [[vx, ax], [vy, ay]].map(([speed, pull]) => add(exact(speed), multiply(exact(pull), exact(q / 2))));
  const v = less(flown(b), flown(a));
  const approaching = sign(M.R) === 0 ? M.faces.filter(({ n }) => sign(dot(n, v)) < 0) : [];
  const { way, normal, face } = rounded([dx, dy], M, approaching.length ? approaching : M.faces);
  return way ? { normal: along(...way), face: null } : { normal, face };
}

/** How far apart two bodies that are [dx, dy] apart are, as rule 9s has it for the room of an inserted one: the gap less R. */
export function shapeGap(apart, M) {
  const { way, gap } = rounded(apart, M, M.faces);
  return (way ? Math.sqrt(way[0] * way[0] + way[1] * way[1]) : gap) - nearest(M.R);
}

/** In doubles, how far a body is after the first and the second corner of a face, and the parts of its velocity and acceleration along it (rule 8r). */
export function alongFace([dx, dy], M, face, { vx, vy, ax, ay }) {
  const { normal: [nx, ny], from, next } = rounded([dx, dy], M, [face]);
  return { u: nx * from[1] - ny * from[0], u2: nx * next[1] - ny * next[0], s: nx * vy - ny * vx, c: nx * ay - ny * ax };
}

/** In doubles, the way from the corner of M that counts at [dx, dy], or else the face of these that does: its normal and gap. */
function rounded([dx, dy], M, faces) {
  if (faces.length === 0) return { way: [dx - nearest(M.corners[0][0]), dy - nearest(M.corners[0][1])] };
  const seen = faces.map((face) => {
    const [px, py, nextX, nextY, tx, ty] = [face.p, face.next, face.t].flat().map(nearest);
    const length = Math.sqrt(tx * tx + ty * ty);
    const [nx, ny] = [ty / length, -tx / length];
    return { face, from: [dx - px, dy - py], next: [dx - nextX, dy - nextY], normal: [nx, ny], gap: nx * (dx - px) + ny * (dy - py) };
  });
  const { face, from, next, normal, gap } = seen.reduce((first, each) => (each.gap > first.gap ? each : first));
  const [nx, ny] = normal;
  if (sign(M.R) > 0 && nx * from[1] - ny * from[0] < 0) return { way: from, normal, from, next };
  if (sign(M.R) > 0 && nx * next[1] - ny * next[0] > 0) return { way: next, normal, from, next };
  return { normal, gap, face, from, next };
}

/** The corners of the hull of some points, anticlockwise from the leftmost, of these the lowest. */
function hull(points) {
  const sorted = [...points].sort(([x1, y1], [x2, y2]) => compare(x1, x2) || compare(y1, y2));
  const chain = (ordered) => {
    const kept = [];
    for (const point of ordered) {
      while (kept.length > 1 && sign(cross(less(kept.at(-1), kept.at(-2)), less(point, kept.at(-1)))) <= 0) kept.pop();
      if (kept.length !== 1 || less(point, kept[0]).some((each) => sign(each) !== 0)) kept.push(point);
    }
    return kept;
  };
  const [lower, upper] = [chain(sorted), chain(sorted.reverse())];
  return lower.length === 1 ? lower : [...lower.slice(0, -1), ...upper.slice(0, -1)];
}

/** Whether a normal points up, or to the right: the first of two opposite ones. */
function isUp([x, y]) {
  return sign(y) > 0 || (sign(y) === 0 && sign(x) > 0);
}

function up(n) {
  return isUp(n) ? n : n.map(minus);
}

/** The double `by` steps from a positive one. */
function step(double, by) {
  view.setFloat64(0, double);
  view.setBigInt64(0, view.getBigInt64(0) + by);
  return view.getFloat64(0);
}

export function less([x1, y1], [x2, y2]) {
  return [subtract(x1, x2), subtract(y1, y2)];
}

function cross([x1, y1], [x2, y2]) {
  return subtract(multiply(x1, y2), multiply(y1, x2));
}

// Rules 2s, 3s, 5s, 6s, 8r and 9s: bodies of convex shapes. Decisions are exact; reaches and directions are doubles.

import { carried } from "./clock.js";
import { add, compare, dot, exact, less, minus, multiply, nearest, sign, signedSquare, square, subtract } from "./exact.js";
import { along } from "./exchange.js";

const view = new DataView(new ArrayBuffer(8));

/** A shape of a core and r, with its size, the r of rule 3s, and the values in place of r at the walls (6s): left, right, bottom and top. */
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

/** True if all shapes are discs around their places, which need no rules of shapes. */
export function areDiscs(shapes) {
  return shapes.every(({ corners }) => corners.length === 1 && corners[0].every((each) => sign(each) === 0));
}

/**
 * The difference M of two shapes: its corners and its faces, each in the order of their numbers, and R. A face has its corners p and next, its
 * way t and its normal n.
 */
export function difference(a, b) {
  const corners = hull(a.corners.flatMap((alpha) => b.corners.map((beta) => less(alpha, beta))));
  const faces = corners.map((p, i) => {
    const next = corners[(i + 1) % corners.length];
    const t = less(next, p);
    return { p, next, t, n: [t[1], minus(t[0])] };
  });
  faces.sort((f, g) => sign(cross(up(g.n), up(f.n))) || isUp(g.n) - isUp(f.n));
  const strip = corners.length > 1 ? 2 ** -39 * (a.extent + b.extent) : 0;
  return { corners, faces: corners.length > 1 ? faces : [], R: add(exact(a.r), exact(b.r)), strip: exact(strip), inner: exact(a.r + b.r - strip) };
}

/** The numbers of the faces of M with the largest g / |n| at a place. */
export function nearestFaces(d, { faces }) {
  const gaps = faces.map(({ p, n }) => ({ above: signedSquare(dot(n, less(d, p))), below: dot(n, n) }));
  const isNearer = (one, other) => compare(multiply(one.above, other.below), multiply(other.above, one.below)) > 0;
  return [...gaps.keys()].filter((i) => !gaps.some((gap) => isNearer(gap, gaps[i])));
}

/** The unit normal of the exchange of momentum of two bodies a < b with the difference [dx, dy], both anchored, and its face, if it has one (rule 9s). */
export function shapeNormal(a, b, [dx, dy], M, q = 1) {
  const flown = ({ vx, vy, ax = 0, ay = 0 }) => [[vx, ax], [vy, ay]].map(([speed, pull]) => add(...carried(exact(speed), exact(pull), q))); // in a tick
  const v = less(flown(b), flown(a));
  const approaching = sign(M.R) === 0 ? M.faces.filter(({ n }) => sign(dot(n, v)) < 0) : [];
  const { way, normal, face } = rounded([dx, dy], M, approaching.length ? approaching : M.faces);
  return way ? { normal: along(...way), face: null } : { normal, face };
}

/** The gap less R of two bodies with the difference [dx, dy], as in rule 9s for the room of an inserted body. */
export function shapeGap(apart, M) {
  const { way, gap } = rounded(apart, M, M.faces);
  return (way ? Math.sqrt(way[0] * way[0] + way[1] * way[1]) : gap) - nearest(M.R);
}

/** In doubles, the distances of a body after the first and the second corner of a face, and the parts of its velocity and acceleration along it (rule 8r). */
export function alongFace([dx, dy], M, face, { vx, vy, ax, ay }) {
  const { normal: [nx, ny], from, next } = rounded([dx, dy], M, [face]);
  return { u: nx * from[1] - ny * from[0], u2: nx * next[1] - ny * next[0], s: nx * vy - ny * vx, c: nx * ay - ny * ax };
}

/** In doubles, the way from the corner of M that counts at [dx, dy], or else the face of these that counts: its normal and gap. */
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

/** The corners of the hull of some points, anticlockwise from the leftmost, the lowest if there are several. */
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

/** True if a normal points up, or to the right: the first of two opposite ones. */
function isUp([x, y]) {
  return sign(y) > 0 || (sign(y) === 0 && sign(x) > 0);
}

function up(n) {
  return isUp(n) ? n : n.map(minus);
}

/** The double that is `by` steps from a positive one. */
function step(double, by) {
  view.setFloat64(0, double);
  view.setBigInt64(0, view.getBigInt64(0) + by);
  return view.getFloat64(0);
}

function cross([x1, y1], [x2, y2]) {
  return subtract(multiply(x1, y2), multiply(y1, x2));
}

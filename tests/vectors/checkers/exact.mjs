// The tick of contact of two discs or convex shapes, exactly: rules 5 and 5s of kinetile's specification.

/**
 * The tick of contact of a and b, in ticks of 2^-(52 + e), as a BigInt or a Number, or null. A body has its core's
 * corners (a disc: its centre), its radius, its place at [x, y], its velocity, and the tick of its place.
 *
 * This one is exact: lengths, and the way in a tick, are whole numbers of one size.
 */
export function timeOfImpact(e, a, b) {
  const [extentA, extentB] = [a, b].map(({ core, radius }) => radius + Math.max(...core.flat().map(Math.abs)));
  const strip = 2 ** -39 * (extentA + extentB);
  const inner = a.radius + b.radius - strip;
  const lengths = [strip, inner, ...[a, b].flatMap(({ core, radius, at }) => [...core.flat(), radius, ...at])];
  const size = Math.max(...lengths.map(places), ...[...a.v, ...b.v].map((z) => places(z) + 52 + e));
  const whole = (z) => scaled(z, size);
  const since = a.anchor > b.anchor ? a.anchor : b.anchor;
  const pace = (body) => body.v.map((z) => scaled(z, size - 52 - e));
  const here = (body) => body.at.map((z, i) => whole(z) + pace(body)[i] * (since - body.anchor));
  const [d, v] = [less(here(b), here(a)), less(pace(b), pace(a))];
  // b's place, relative to a's, meets the hull of all differences of corners, grown by r
  const corners = hull(a.core.flatMap((p) => b.core.map((q) => less(p.map(whole), q.map(whole)))));
  // among whole n each condition on d holds in one run, and the first n in all runs is sought
  const ways = corners.map((p, i) => less(corners[(i + 1) % corners.length], p));
  const faces = [];
  for (const [k, p] of corners.length > 1 ? corners.entries() : []) {
    const [at, way] = [less(d, p), ways[k]];
    const n = [way[1], -way[0]];
    faces.push({ g: dot(n, at), w: dot(n, v), u: dot(way, at), z: dot(way, v), tt: dot(way, way) });
  }
  const inside = faces.length > 2 ? both(...faces.map(({ g, w }) => below(g, w))) : EMPTY;
  const near = (r) => { // the n when b's place comes nearer than r to a face, or, by falling, to a corner
    const ticks = 0n < inside[0] && inside[0] <= inside[1] ? [inside[0] - 1n] : [];
    for (const { g, w, u, z, tt } of faces) {
      const over = [below(-1n - g, -w), below(-1n - u, -z), below(u - tt - 1n, z)];
      if (w < 0n) ticks.push(...first(below(g - rootAbove(r * r * tt), w), ...over));
    }
    for (const [k, p] of corners.entries()) {
      const [at, after, before] = [less(d, p), ways[k], ways.at(k - 1)];
      const [c, b, a] = [dot(at, at) - r * r, dot(at, v), dot(v, v)];
      const beside = [below(dot(after, at) - 1n, dot(after, v)), below(-1n - dot(before, at), -dot(before, v))];
      beside.push(...beside.map(([low, high]) => [low + 1n, high + 1n])); // a tick before, too
      ticks.push(...first(discBelow(c, b, a), below(2n * b - a, 2n * a), ...beside));
    }
    return ticks;
  };
  let ticks = [];
  if (a.radius + b.radius > 0) { // on a straight path, an approach to within `inner` is before the parting
    if (!faces.length || inner <= 0 || near(whole(inner)).length) ticks = near(whole(a.radius) + whole(b.radius));
  } else {
    const [width, depth] = [whole(strip), ({ g, tt }) => signedSquare(g) * (product / tt)];
    const product = faces.reduce((all, { tt }) => all * tt, 1n);
    const deep = both(inside, ...faces.map(({ g, w, tt }) => below(g + rootAbove(width * width * tt + 1n) - 1n, w)));
    const falls = faces.every((face) => face.w < 0n || faces.some((other) => depth(other) > depth(face)));
    const visited = deep[0] <= deep[1] && (inside[0] > 0n || (falls && inside[1] > 0n));
    ticks = visited ? [inside[0] > 0n ? inside[0] - 1n : 0n] : [];
  }
  const tick = ticks.reduce((one, other) => (other < one ? other : one), FAR);
  return tick < FAR ? since + tick : null;
}

const FAR = 1n << 62n;
const EMPTY = [1n, 0n];
const dot = ([x, y], [p, q]) => x * p + y * q;
const less = ([x, y], [p, q]) => [x - p, y - q];
const signedSquare = (a) => (a < 0n ? -a * a : a * a);
const floorDivide = (a, b) => (a < 0n && a % b ? a / b - 1n : a / b);

/** The first and the last n, from 0 on, with c + b n < 0. */
function below(c, b) {
  if (b === 0n) return c < 0n ? [0n, FAR] : EMPTY;
  return b < 0n ? [largest(floorDivide(c, -b) + 1n, 0n), FAR] : [0n, floorDivide(-c - 1n, b)];
}

/** The first and the last n, from 0 on, with c + 2 b n + a n^2 < 0. */
function discBelow(c, b, a) {
  const m = b * b - a * c;
  if (a === 0n || m <= 0n) return EMPTY; // a body at rest does not fall, either
  const root = rootAbove(m);
  return [largest(floorDivide(-b - root, a) + 1n, 0n), -floorDivide(b - root, a) - 1n];
}

const largest = (a, b) => (a > b ? a : b);
const both = (...runs) => runs.reduce(([a, b], [c, d]) => [largest(a, c), b < d ? b : d]);

/** [n], n + 1 being the first in all runs; [] without one. */
function first(...runs) {
  const [low, high] = both([1n, FAR], ...runs);
  return low <= high ? [low - 1n] : [];
}

/** The root of m, rounded up, by Newton's iteration from above. */
function rootAbove(m) {
  if (m === 0n) return 0n;
  let root = 1n << BigInt(2 * m.toString(16).length);
  for (let next = root - 1n; next < root; next = (root + m / root) >> 1n) root = next;
  return root * root < m ? root + 1n : root;
}

function hull(points) {
  const order = (p, q) => (p[0] < q[0] || (p[0] === q[0] && p[1] < q[1]) ? -1 : p[0] === q[0] && p[1] === q[1] ? 0 : 1);
  const sorted = [...points].sort(order).filter((p, i, all) => i === 0 || order(p, all[i - 1]));
  const turn = (p, q, s) => (q[0] - p[0]) * (s[1] - q[1]) - (q[1] - p[1]) * (s[0] - q[0]);
  const chain = (all) => {
    const kept = [];
    for (const p of all) {
      while (kept.length > 1 && turn(kept.at(-2), kept.at(-1), p) <= 0n) kept.pop();
      kept.push(p);
    }
    return kept.slice(0, -1);
  };
  return sorted.length > 1 ? [...chain(sorted), ...chain([...sorted].reverse())] : sorted;
}

const view = new DataView(new ArrayBuffer(8));

/** [n, power] of a double n * 2^power. */
function split(double) {
  view.setFloat64(0, double);
  const [power, n] = [view.getUint16(0) & 0x7ff0, view.getBigUint64(0) & 0xfffffffffffffn];
  const size = power ? n | (1n << 52n) : n;
  return [double < 0 ? -size : size, Math.max(power >> 4, 1) - 1075];
}

/** The most binary places of a double. */
function places(double) {
  return double ? -split(double)[1] : 0;
}

/** A double times 2^bits, which is whole. */
function scaled(double, bits) {
  const [n, power] = split(double);
  return n && n << BigInt(power + bits);
}

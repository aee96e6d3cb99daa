// The time of impact of two discs or convex shapes, exactly: rules 5 and 5s of kinetile's specification.

/**
 * When a and b begin to touch, in ticks of 2^-(52 + e), as a BigInt or a Number, or null. A body has the corners of
 * its core (a disc: its centre), its radius, its place at [x, y], its velocity, and the tick at which it is there.
 *
 * This one is exact: lengths, and what is flown in a tick, are whole numbers of one size.
 */
export function timeOfImpact(e, a, b) {
  const [extentA, extentB] = [a, b].map(({ core, radius }) => radius + Math.max(...core.flat().map(Math.abs)));
  const strip = 2 ** -39 * (extentA + extentB);
  const lengths = [strip, ...[a, b].flatMap(({ core, radius, at }) => [...core.flat(), radius, ...at])];
  const size = Math.max(...lengths.map(places), ...[...a.v, ...b.v].map((z) => places(z) + 52 + e));
  const whole = (z) => scaled(z, size);
  const since = a.anchor > b.anchor ? a.anchor : b.anchor;
  const pace = (body) => body.v.map((z) => scaled(z, size - 52 - e));
  const here = (body) => body.at.map((z, i) => whole(z) + pace(body)[i] * (since - body.anchor));
  const [d, v, r] = [less(here(b), here(a)), less(pace(b), pace(a)), whole(a.radius) + whole(b.radius)];
  // b's place, seen from a's, flies past the hull of all differences of corners, grown by r
  const corners = hull(a.core.flatMap((p) => b.core.map((q) => less(p.map(whole), q.map(whole)))));
  // who leaves all of it on one side of the way, but for a strip, does not meet it
  const beyond = signedSquare((corners.length > 1 ? whole(strip) : 0n) - r) * dot(v, v);
  const sides = corners.map((p) => less(d, p)).map(([x, y]) => signedSquare(x * v[1] - y * v[0]));
  if (sides.every((side) => side <= beyond) || sides.every((side) => -side <= beyond)) return null;
  const faces = corners.map((p, i) => {
    const t = less(corners[(i + 1) % corners.length], p);
    const [n, at, tt] = [[t[1], -t[0]], less(d, p), dot(t, t)];
    const [g, u, w, z] = [dot(n, at), dot(t, at), dot(n, v), dot(t, v)]; // across and along it, and how they grow
    return { g, u, w, z, tt, isOver: 0n <= u && u <= tt };
  });
  if (corners.length === 1) faces.pop();

  if (faces.length && faces.every(({ g, isOver }) => g <= 0n && (faces.length > 2 || isOver))) {
    const least = faces.reduce((f, h) => (h.g * h.g * f.tt < f.g * f.g * h.tt ? h : f));
    return faces.every((f) => f.w < 0n || f.g * f.g * least.tt !== least.g * least.g * f.tt) ? since : null;
  }
  const discs = corners.map((p) => less(d, p)).map((at) => ({ gap: dot(at, at) - r * r, growth: dot(at, v) }));
  const over = faces.find(({ g, isOver }) => g > 0n && isOver);
  const near = over
    ? { gap: over.g * over.g - r * r * over.tt, growth: over.w }
    : discs.reduce((one, other) => (other.gap < one.gap ? other : one));
  if (near.gap <= 0n) return near.growth < 0n ? since : null;

  const ticks = [];
  if (r) {
    const vv = dot(v, v);
    for (const { gap, growth } of discs) {
      const m = growth * growth - vv * gap;
      if (growth < 0n && m > 0n) ticks.push(floorDivide(-growth - rootAbove(m), vv));
    }
    for (const { g, u, w, z, tt } of faces) {
      // it comes to within r of the line where -w u is A - z sqrt(m)
      const [m, A] = [r * r * tt, z * g - u * w];
      const isOver = signedSquare(A + tt * w) <= signedSquare(z) * m && signedSquare(z) * m <= signedSquare(A);
      if (w < 0n && g > 0n && g * g > m && isOver) ticks.push(floorDivide(g - rootAbove(m), -w));
    }
  } else if (faces.length > 2 && faces.every(({ g, w }) => w || g < 0n)) {
    const entries = faces.filter(({ w }) => w < 0n);
    const last = entries.length ? entries.reduce((f, h) => (h.g * -f.w > f.g * -h.w ? h : f)) : null;
    const stays = (f) => f.w <= 0n || last.g * f.w < -f.g * -last.w;
    if (last && last.g >= 0n && faces.every(stays)) ticks.push(last.g / -last.w);
  }
  const tick = ticks.length ? ticks.reduce((one, other) => (other < one ? other : one)) : FAR;
  return tick < FAR ? since + tick : null;
}

const FAR = 1n << 62n;
const dot = ([x, y], [p, q]) => x * p + y * q;
const less = ([x, y], [p, q]) => [x - p, y - q];
const signedSquare = (a) => (a < 0n ? -a * a : a * a);
const floorDivide = (a, b) => (a < 0n && a % b ? a / b - 1n : a / b);

/** The root of m > 0, rounded up, by Newton's iteration from above. */
function rootAbove(m) {
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

/** How many binary places a double has at most. */
function places(double) {
  return double ? -split(double)[1] : 0;
}

/** A double times 2^bits, which is whole. */
function scaled(double, bits) {
  const [n, power] = split(double);
  return n && n << BigInt(power + bits);
}

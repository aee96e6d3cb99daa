// node doubles.js [FAULT]: an engine in floating point for `kinetile conform --command`, which answers whole runs (--within D), single casts
// (--ask casts) and candidate pairs (--ask pairs) of discs. FAULT is "late", "light" or "narrow", which the kit must find.
import { createInterface } from "node:readline";

const fault = process.argv[2];
const place = (one, t) => [one.x + one.vx * (t - one.t), one.y + one.vy * (t - one.t)];
const disc = ({ position: [x, y], velocity: [vx, vy], radius, mass = 1, ...more }) => {
  if (radius === undefined || mass === "inf" || Object.keys(more).length) throw new Error("it takes discs that can move");
  return { x, y, vx, vy, r: radius, m: mass, t: 0, last: null };
};

// How long after time t two discs meet; Infinity: never.
function wait(one, two, t) {
  const [x, y] = place(one, t), [z, w] = place(two, t);
  const [dx, dy, vx, vy] = [z - x, w - y, two.vx - one.vx, two.vy - one.vy];
  const b = dx * vx + dy * vy, c = dx * dx + dy * dy - (one.r + two.r) ** 2, a = vx * vx + vy * vy;
  if (b >= 0 || (one.last === two && two.last === one)) return Infinity;
  if (c <= 0) return 0;
  const under = b * b - a * c;
  if (under <= 0) return Infinity;
  return fault === "late" ? (-b + Math.sqrt(under)) / a : c / (-b + Math.sqrt(under));
}

// The walls that a disc flies at, each with how long after time t it meets it.
function* walls(one, t, [width, height]) {
  const [x, y] = place(one, t);
  for (const [v, low, high, wall] of [[one.vx, x, width - x, -1], [one.vy, y, height - y, -3]])
    if (v) yield [Math.max(0, ((v < 0 ? low : high) - one.r) / Math.abs(v)), v < 0 ? wall : wall - 1];
}

function run({ bodies = [], arena, until, start = 0, ...more }) {
  if (Object.keys(more).length || bodies.length > 150) throw new Error("it takes at most 150 discs, in an arena or none");
  const all = bodies.map(disc), contacts = [];
  for (const one of all) one.t = start;
  for (let t = start; ; ) {
    let next = [Infinity];
    all.forEach((one, a) => {
      for (let b = a + 1; b < all.length; b++) {
        const dt = wait(one, all[b], t);
        if (dt < next[0]) next = [dt, a, b];
      }
      if (arena) for (const [dt, wall] of walls(one, t, arena)) if (dt < next[0]) next = [dt, a, wall];
    });
    const [dt, a, b] = next;
    if (!(t + dt <= until)) return contacts;
    t += dt;
    contacts.push([t, a, b]);
    const met = b < 0 ? [all[a]] : [all[a], all[b]];
    for (const one of met) [[one.x, one.y], one.t, one.last] = [place(one, t), t, null];
    if (b < 0) {
      const axis = b < -2 ? "vy" : "vx";
      met[0][axis] = -met[0][axis];
      continue;
    }
    const [one, two] = met, [x, y] = [two.x - one.x, two.y - one.y];
    const along = ((two.vx - one.vx) * x + (two.vy - one.vy) * y) / (x * x + y * y);
    const share = fault === "light" ? 1 : (2 * two.m) / (one.m + two.m), back = 2 - share;
    [one.vx, one.vy, two.vx, two.vy] = [one.vx + share * along * x, one.vy + share * along * y, two.vx - back * along * x, two.vy - back * along * y];
    [one.last, two.last] = [two, one];
  }
}

// All pairs whose boxes meet, from left to right.
function pairs({ discs, boxes }) {
  const all = boxes ?? discs.map(([n, x, y, r]) => [n, x - r, y - r, x + r, y + r]), found = [];
  all.sort((one, two) => one[1] - two[1]);
  all.forEach(([n, , down, right, up], at) => {
    for (const [m, left, low, , high] of all.slice(at + 1)) {
      if (fault === "narrow" ? left >= right : left > right) break;
      if (low <= up && down <= high) found.push([n, m]);
    }
  });
  return found;
}

function answer(line) {
  try {
    if ("moment" in line) return { pairs: pairs(line) };
    if (!("cast" in line)) return { contacts: run(line) };
    const time = wait(...line.cast.map(disc), 0);
    return { time: time <= line.until ? time : null };
  } catch (error) {
    return { refused: error.message };
  }
}

for await (const line of createInterface({ input: process.stdin })) console.log(JSON.stringify(answer(JSON.parse(line))));

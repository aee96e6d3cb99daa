// Checks a time of impact against the vectors: node check.mjs [--exact] [FILE ...]
// Put your engine's call in place of timeOfImpact: it has the parameters of the imported one.
// README.md describes the files and the errors.

import { readdirSync, readFileSync } from "node:fs";
import { basename, dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

import { timeOfImpact } from "./exact.mjs";

/** The double that a text such as "-0x1.8p-4" writes. */
function double(text) {
  const [, minus, digit, rest = "", power] = /^(-?)0x([01])(?:\.([0-9a-f]*))?p([+-]\d+)$/.exec(text);
  const size = Number(`0x${digit}${rest}`); // below 2^53
  const last = Number(power) - 4 * rest.length; // in two steps, since 2^last may be subnormal, or too large
  const value = size * 2 ** (last >> 1) * 2 ** (last - (last >> 1));
  return minus ? -value : value;
}

/** A body from the rows of discs ([x, y, vx, vy, radius, anchor]) and of shapes ([core, radius, plan]). */
function body(row) {
  const [core, radius, plan] = row.length === 3 ? row : [[["0x0p+0", "0x0p+0"]], row[4], [...row.slice(0, 4), row[5]]];
  const [x, y, vx, vy] = plan.slice(0, 4).map(double);
  return { core: core.map((p) => p.map(double)), radius: double(radius), at: [x, y], v: [vx, vy], anchor: BigInt(plan[4]) };
}

/** [grade, e, a, b, the tick or null] of all questions of a file. */
function questions(file) {
  const text = readFileSync(file, "utf8");
  if (!file.endsWith(".txt")) {
    const tick = (answer) => (answer === null ? null : BigInt(answer));
    const rows = Object.values(JSON.parse(text).families).flat();
    return rows.map(([e, a, b, answer]) => ["clear", e, body(a), body(b), tick(answer)]);
  }
  return text.trim().split("\n").map((line) => {
    const [grade, , e, tick, ...words] = line.split(" ");
    const [a, b] = [words.slice(0, 5), words.slice(5)].map((row) => body([...row, "0"]));
    return [grade, Number(e), a, b, tick === "-" ? null : BigInt(tick)];
  });
}

const folder = dirname(dirname(fileURLToPath(import.meta.url)));
const words = process.argv.slice(2);
const all = words.includes("--exact");
let files = words.filter((word) => word !== "--exact");
if (files.length === 0) {
  const discs = readdirSync(join(folder, "contacts")).map((name) => join("contacts", name));
  files = [...discs, "shapes.json", "discs.txt"].map((name) => join(folder, name));
}
let wrong = 0;
for (const file of files) {
  const counts = {};
  for (const [grade, e, a, b, right] of questions(file)) {
    const time = timeOfImpact(e, a, b);
    const found = typeof time === "number" ? BigInt(Math.floor(time)) : time;
    const kind = found === right ? "right" : found === null ? "hits missed" : right === null ? "misses hit" : "ticks wrong";
    counts[grade] ??= { right: 0, "hits missed": 0, "misses hit": 0, "ticks wrong": 0 };
    counts[grade][kind] += 1;
    if (kind !== "right" && (all || grade === "exact" || (grade === "clear" && kind !== "ticks wrong"))) wrong += 1;
  }
  for (const [grade, row] of Object.entries(counts)) {
    const told = Object.entries(row).map(([kind, count]) => `${count} ${kind}`);
    console.log(`${basename(file)}, ${grade}: ${told.join(", ")}`);
  }
}
process.exitCode = wrong ? 1 : 0;

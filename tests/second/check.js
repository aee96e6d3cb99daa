// node check.js DIR: answers all questions of the vectors in DIR, and prints the number of equal answers of each family.

import { existsSync, readdirSync, readFileSync } from "node:fs";
import { basename, join } from "node:path";

import { entry, fingerprint, isContact, Run } from "./answer.js";
import { anchor, makePlan, tickLength, tickOf, unit } from "./clock.js";
import { nearest } from "./exact.js";
import { along, exchange } from "./exchange.js";
import { readScene } from "./scene.js";
import { difference, makeShape, shapeNormal } from "./shapes.js";
import { relative, touchTick } from "./touching.js";
import { wallTick } from "./walls.js";

const SHOWN = 5; // the number of wrong answers that are printed
const RUNS = ["runs", "rules"]; // the folders of whole runs
const ZERO = "0x0.0p+0";
const HAPPENING = ["clock", "turn", "acceleration", "kind", "move", "wall", "pair", "insertion", "removal", "leaving", "begin", "end"];

const velocity = ([vx, vy]) => ({ vx, vy });
const moving = ([x, y, vx, vy]) => ({ x, y, vx, vy });
const shapeOf = ([core, r]) => makeShape(core.map((corner) => corner.map(double)), double(r));
const planOf = ([x, y, vx, vy], anchor, [ax = 0, ay = 0] = []) => makePlan(...[x, y, vx, vy].map(double), BigInt(anchor), 0n, 0n, ax, ay);
const discOf = ([x, y, vx, vy, r, anchor, ...pull]) => ({ shape: shapeOf([[[ZERO, ZERO]], r]), plan: planOf([x, y, vx, vy], anchor, pull.map(double)) });
const bodyOf = ([core, r, plan]) => ({ shape: shapeOf([core, r]), plan: planOf(plan, plan[4]) });

function met(e, a, b, justMet = false) {
  return touchTick(relative(a.plan, a.shape.size, b.plan, b.shape.size, tickLength(e)), difference(a.shape, b.shape), justMet)?.toString() ?? null;
}

function metWall(e, sides, { shape, plan }) {
  const found = wallTick(plan, shape.sides, sides.map(double), tickLength(e));
  return found && [found.tick.toString(), found.wall];
}

/** The answers to a row, in the form of its last field; a list of answers if there are several ways. */
const ASK = {
  contacts: (e, one, two) => ASK.accelerated_contacts(e, false, one, two),
  walls: (e, sides, body) => [metWall(e, sides, discOf(body))],
  accelerated_contacts(e, justMet, ...bodies) {
    const [a, b] = bodies.map(discOf);
    return [met(e, a, b, justMet), met(e, b, a, justMet)];
  },
  accelerated_places(e, plan, to) {
    const { x, y, vx, vy } = anchor(discOf(plan).plan, BigInt(to), tickLength(e));
    return [[x, y, vx, vy]];
  },
  exchanges(masses, a, b) {
    const [ma, mb] = masses ? masses.map(double) : [1, 1];
    const [planA, planB] = [moving(a.map(double)), moving(b.map(double))];
    return [exchange(planA, planB, ma, mb, masses === null, along(planB.x - planA.x, planB.y - planA.y))];
  },
  places(e, plan, from, to) {
    const { x, y } = anchor(planOf(plan, from), BigInt(to), tickLength(e));
    return [[x, y]];
  },
  units(arena, bodies, turns) {
    const read = ([x, y, vx, vy, r]) => ({ x, y, vx, vy, r });
    return [unit({ arena: arena?.map(double), bodies: bodies.map((b) => read(b.map(double))), commands: turns.map((t) => velocity(t.map(double))) })];
  },
  shapes: (e, a, b) => [met(e, bodyOf(a), bodyOf(b))],
  shape_sizes: (core, r) => [shapeOf([core, r]).size],
  shape_walls: (e, sides, body) => [metWall(e, sides, bodyOf(body))],
  shape_exchanges(masses, a, b) {
    const [ma, mb] = masses ? masses.map(double) : [1, 1];
    const [planA, planB] = [moving(a[2].map(double)), moving(b[2].map(double))];
    const away = [planB.x - planA.x, planB.y - planA.y];
    return [exchange(planA, planB, ma, mb, masses === null, shapeNormal(planA, planB, away, difference(shapeOf(a), shapeOf(b))).normal)];
  },
  times: (e, start, time) => [tickOf(double(time), double(start), tickLength(e)).toString()],
  scenes(name, scene) {
    try {
      return [Boolean(new Run(readScene(numbers(scene))))];
    } catch {
      return [false];
    }
  },
};

/** The answer of a whole run, in the form of its fields. */
function answerRun({ scene, contacts }) {
  const run = new Run(readScene(numbers(scene)));
  const happened = [...run.events()];
  const list = happened.filter(isContact).map(entry);
  const counts = HAPPENING.map((each) => [each, happened.filter(({ what }) => what === each).length]);
  return {
    e: run.e,
    end: run.tickOf(run.scene.until).toString(),
    ended: run.ended,
    happened: Object.fromEntries(counts),
    count: list.length,
    fingerprint: fingerprint(list),
    contacts: list.slice(0, contacts.length).map(({ epoch, tick, a, b }) => [epoch.toString(), tick.toString(), a, b]),
  };
}

/** The double that a text such as "-0x1.8000000000000p-4" writes. */
function double(text) {
  const [, minus, digit, rest, power] = /^(-?)0x([01])\.?([0-9a-f]*)p([+-]\d+)$/.exec(text);
  const value = nearest({ n: BigInt(`0x${digit}${rest}`), e: Number(power) - 4 * rest.length });
  return minus ? -value : value;
}

/** A value with all its texts of doubles read. */
function numbers(value) {
  if (typeof value === "string") return /^-?0x/.test(value) ? double(value) : value;
  if (Array.isArray(value)) return value.map(numbers);
  if (typeof value !== "object" || value === null) return value;
  return Object.fromEntries(Object.entries(value).map(([key, each]) => [key, numbers(each)]));
}

/** True if an answer is the written one. */
function same(found, wanted) {
  if (typeof found === "number" && typeof wanted === "string") return found === double(wanted);
  if (typeof wanted !== "object" || wanted === null || typeof found !== "object" || found === null) return found === wanted;
  const keys = Object.keys(wanted);
  return keys.length === Object.keys(found).length && keys.every((key) => same(found[key], wanted[key]));
}

/** {family: [[question, found, wanted]]} of a file. */
function askFile(rule, file) {
  const told = JSON.parse(readFileSync(file, "utf8"));
  if (RUNS.includes(rule)) {
    const asked = told.runs.map((run) => {
      const { e, end, ended = "end", count, fingerprint, contacts } = run;
      const happened = Object.fromEntries(HAPPENING.map((each) => [each, run.happened[each] ?? 0]));
      return [run.name, attempt(() => answerRun(run)), { e, end, ended, happened, count, fingerprint, contacts }];
    });
    return { [`${rule}, ${basename(file, ".json")}`]: asked };
  }
  const families = Object.entries(told.families).map(([family, rows]) => {
    const asked = rows.flatMap((row) => {
      const [question, wanted] = [row.slice(0, -1), row.at(-1)];
      return [attempt(() => ASK[rule](...question))].flat().map((found) => [question, found, wanted]);
    });
    return [`${rule}, ${family}`, asked];
  });
  return Object.fromEntries(families);
}

/** A question that cannot be answered is one wrong answer; the others are still computed. */
function attempt(ask) {
  try {
    return ask();
  } catch (error) {
    return `no answer: ${error.message}`;
  }
}

/** [rule, file] of all vectors in a folder. */
function vectors(folder) {
  const files = (rule, where) => readdirSync(where).filter((name) => name.endsWith(".json")).sort().map((name) => [rule, join(where, name)]);
  const single = files(null, folder).map(([, file]) => [basename(file, ".json"), file]);
  const rooms = ["contacts", ...RUNS].filter((room) => existsSync(join(folder, room)));
  return [...rooms.flatMap((room) => files(room, join(folder, room))), ...single];
}

function main([folder, ...more]) {
  if (folder === undefined || more.length) throw new Error("Say node check.js DIR.");
  const found = vectors(folder);
  if (found.length === 0) throw new Error(`There are no vectors in ${folder}.`);
  const wrong = [];
  let all = 0;
  for (const [rule, file] of found) {
    if (!RUNS.includes(rule) && !(rule in ASK)) throw new Error(`${file}: no such questions are known here.`);
    for (const [family, asked] of Object.entries(askFile(rule, file))) {
      const failed = asked.filter(([, answer, wanted]) => !same(answer, wanted));
      process.stdout.write(`${asked.length - failed.length} of ${asked.length} hold: ${family}\n`);
      wrong.push(...failed.map((each) => [family, ...each]));
      all += asked.length;
    }
  }
  for (const [family, question, answer, wanted] of wrong.slice(0, SHOWN)) {
    process.stdout.write(`\n${family}: ${text(question)}\n  found  ${text(answer)}\n  wanted ${text(wanted)}\n`);
  }
  process.stdout.write(`${all - wrong.length} of ${all} hold\n`);
  if (wrong.length || all === 0) process.exitCode = 1;
}

function text(value) {
  const whole = JSON.stringify(value);
  return whole.length > 1000 ? `${whole.slice(0, 1000)} ...` : whole;
}

try {
  main(process.argv.slice(2));
} catch (error) {
  process.stderr.write(`${error.message}\n`);
  process.exitCode = 1;
}

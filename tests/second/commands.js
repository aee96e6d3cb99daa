// Rules 2, 2a, 11k and 11m: commands: turns, moves, other accelerations and kinds, insertions and removals, the numbers of new bodies, and the order of all commands.
//
// A command is {what, body, time, at}: `at` is {tick, contacts}, or null. A turn also has vx and vy, another acceleration ax and ay, another kind that, a move x and y, an insertion all of these and a body's fields.

import { tickOf } from "./clock.js";
import { readKind } from "./responses.js";
import { makeShape } from "./shapes.js";
import { count, keys, mass, moment, number, pair, positive } from "./tables.js";

/** The acceleration of a body: its own, or else gravity, or 0 if it is immovable. */
export function acceleration({ own, m }, gravity) {
  const [ax, ay] = own ?? (m === Infinity ? [0, 0] : gravity);
  return { ax, ay };
}

/** The shape of a body: one of the scene's, or the disc of its radius. */
export function bodyShape(table, shapes, m, name) {
  if (!("shape" in table)) return makeShape([[0, 0]], positive(table.radius, `${name}.radius`));
  if ("radius" in table) throw new Error(`${name} has a shape and a radius.`);
  if (!Number.isInteger(table.shape) || !(table.shape in shapes)) {
    throw new Error(`${name}.shape is ${JSON.stringify(table.shape)}, and there are ${shapes.length} shapes.`);
  }
  const shape = shapes[table.shape];
  if (shape.r === 0 && shape.corners.length < 3 && m < Infinity) throw new Error(`${name} is a segment, and its mass is not infinite.`);
  return shape;
}

/** The commands of these tables, after the turns in the tables of the n bodies; `kind` is the kind of bodies inserted without one. */
export function readCommands(tables, turns, n, shapes, kind, start, gravity) {
  turns.sort((s, t) => s.time - t.time || s.body - t.body); // the sort leaves equals as they are
  const commands = [...turns, ...tables.map((table, i) => readCommand(table, shapes, kind, gravity, `commands[${i}]`))];
  const early = commands.find(({ time }) => time < start);
  if (early) throw new Error(`A command is at the time ${early.time}, before the start, ${start}.`);
  const inserted = commands.filter(({ what }) => what === "insertion");
  let next = Math.max(n, ...inserted.map(({ body }) => (body ?? -1) + 1));
  for (const command of inserted) command.body ??= next++;
  return commands;
}

/** The commands in their order, each with its tick and the number of contacts of the tick before it; n bodies are present at the start. */
export function inOrder(commands, start, q, n) {
  const placed = commands.map((each) => ({ ...each, ...(each.at ?? { tick: tickOf(each.time, start, q), contacts: 0 }) }));
  const byTick = (s, t) => (s.tick === t.tick ? s.contacts - t.contacts : s.tick < t.tick ? -1 : 1);
  const sorted = placed.sort(commands.some(({ at }) => at) ? byTick : (s, t) => s.time - t.time);
  const there = new Set(Array(n).keys());
  const used = new Set(there);
  for (const { what, body } of sorted) {
    if (what === "insertion" && used.has(body)) throw new Error(`A body is inserted with the number ${body}, which another has or had.`);
    if (what !== "insertion" && !there.has(body)) throw new Error(`A ${what} is of body ${body}, which is not there then.`);
    used.add(body);
    if (what === "insertion") there.add(body);
    if (what === "removal") there.delete(body);
  }
  return sorted;
}

/** A turn that is written with its body. */
export function readTurn(table, body, name) {
  keys(table, ["time", "velocity"], name);
  const [vx, vy] = pair(table.velocity, `${name}.velocity`);
  return { what: "turn", body, time: number(table.time, `${name}.time`), at: null, vx, vy };
}

function readCommand(table, shapes, kind, gravity, name) {
  keys(table, ["time", "at", "turn", "velocity", "accelerate", "acceleration", "insert", "remove", "set-kind", "kind", "move", "position"], name);
  const time = number(table.time, `${name}.time`);
  const at = "at" in table ? moment(table.at, `${name}.at`) : null;
  if ("remove" in table) return { what: "removal", body: count(table.remove, `${name}.remove`), time, at };
  if ("insert" in table) return { what: "insertion", time, at, ...readInserted(table.insert, shapes, kind, gravity, `${name}.insert`) };
  if ("set-kind" in table) {
    return { what: "kind", body: count(table["set-kind"], `${name}.set-kind`), time, at, kind: readKind(table.kind, `${name}.kind`) };
  }
  if ("move" in table) {
    const [x, y] = pair(table.position, `${name}.position`);
    return { what: "move", body: count(table.move, `${name}.move`), time, at, x, y };
  }
  if ("accelerate" in table) {
    const [ax, ay] = pair(table.acceleration, `${name}.acceleration`);
    return { what: "acceleration", body: count(table.accelerate, `${name}.accelerate`), time, at, ax, ay };
  }
  return { ...readTurn({ time, velocity: table.velocity }, count(table.turn, `${name}.turn`), name), at };
}

function readInserted(table, shapes, kind, gravity, name) {
  keys(table, ["position", "velocity", "radius", "shape", "mass", "acceleration", "kind", "body", "name"], name);
  const [x, y] = pair(table.position, `${name}.position`);
  const [vx, vy] = pair(table.velocity ?? [0, 0], `${name}.velocity`);
  const m = mass(table.mass, `${name}.mass`);
  const shape = bodyShape(table, shapes, m, name);
  const body = "body" in table ? count(table.body, `${name}.body`) : null;
  const own = "acceleration" in table ? pair(table.acceleration, `${name}.acceleration`) : null;
  const read = readKind(table.kind ?? kind, `${name}.kind`);
  return { body, x, y, vx, vy, r: shape.size, m, shape, kind: read, ...acceleration({ own, m }, gravity) };
}

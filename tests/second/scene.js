// Rules 2, 2a and 2s: a scene from the tables of a scene file, read from TOML or written as JSON. A mistake becomes a sentence.

import { largest } from "./clock.js";
import { acceleration, bodyShape, readCommands, readTurn } from "./commands.js";
import { lowestKind, readKind, readResponses } from "./responses.js";
import { areDiscs, makeShape } from "./shapes.js";
import { keys, list, mass, moment, number, pair, positive } from "./tables.js";

const RUN = ["until", "end", "broad-phase", "narrow-phases", "options"];
const TOP_LEVEL = ["arena", "periodic", "gravity", "start", "unit", "kinds", "responses", "shapes", "bodies", "commands", ...RUN];

/** The scene of these tables, for `Run` and `contacts`, with `until` (null if left out). The method of a search (phases, options) is not a part of it. */
export function readScene(tables) {
  if ("recipe" in Object(tables)) throw new Error("A recipe is kinetile's; write the scene with its bodies.");
  keys(tables, TOP_LEVEL, "The scene");
  const arena = "arena" in tables ? pair(tables.arena, "arena").map((side) => positive(side, "a side of the arena")) : null;
  const start = number(tables.start ?? 0, "start");
  const until = "until" in tables ? number(tables.until, "until") : null;
  const end = "end" in tables ? moment(tables.end, "end") : null;
  const unit = "unit" in tables ? number(tables.unit, "unit") : null;
  const kinds = list(tables.kinds ?? [], "kinds").map((kind) => readKind(kind, "kinds"));
  const responses = readResponses(list(tables.responses ?? [], "responses"));
  const periodic = readPeriodic(tables.periodic ?? "", arena);
  const periods = ["x", "y"].map((axis, i) => (periodic.includes(axis) ? arena[i] : null));
  const shapes = list(tables.shapes ?? [], "shapes").map(readShape);
  const gravity = "gravity" in tables ? pair(tables.gravity, "gravity") : [0, 0];
  const bodies = [];
  const turns = [];
  list(tables.bodies ?? [], "bodies").forEach((table, body) => {
    const name = `bodies[${body}]`;
    keys(table, ["position", "velocity", "radius", "shape", "mass", "acceleration", "kind", "turns", "name"], name);
    const [x, y] = pair(table.position, `${name}.position`);
    const [vx, vy] = pair(table.velocity ?? [0, 0], `${name}.velocity`);
    const m = mass(table.mass, `${name}.mass`);
    const kind = readKind(table.kind ?? kinds[0] ?? 0, `${name}.kind`);
    const shape = bodyShape(table, shapes, m, name);
    const r = shape.size;
    const own = "acceleration" in table ? pair(table.acceleration, `${name}.acceleration`) : null;
    bodies.push({ x, y, vx, vy, r, m, shape, kind, ...acceleration({ own, m }, gravity) });
    list(table.turns ?? [], `${name}.turns`).forEach((turn, i) => turns.push(readTurn(turn, body, `${name}.turns[${i}]`)));
  });
  const written = list(tables.commands ?? [], "commands");
  const inserted = written.map((table) => Object(Object(table).insert).kind);
  const kind = kinds[0] ?? bodies[0]?.kind ?? inserted.find((each) => each !== undefined) ?? lowestKind(responses) ?? 0;
  const commands = readCommands(written, turns, bodies.length, shapes, kind, start, gravity);
  const every = [...bodies, ...commands.filter(({ what }) => what === "insertion")];
  const shaped = !areDiscs([...every.map(({ shape }) => shape), ...shapes]);
  const widest = Math.max(0, ...every.map(({ r }) => r)); // rules 2p and 2s
  if (periods.some((period) => period !== null && (shaped ? 4 : 2) * widest >= period)) {
    throw new Error(`The size of a body is ${widest}, and twice that is less than ${shaped ? "half a period" : "a period"}.`);
  }
  phases(tables["narrow-phases"], [shaped ? "convex" : "disc", ...(arena !== null && periodic !== "xy" ? ["wall"] : [])]);
  const scene = { bodies, commands, responses, shaped, arena, periods, gravity, start, unit, until, end };
  checkAccelerations(scene);
  return scene;
}

function readPeriodic(axes, arena) {
  if (!["", "x", "y", "xy"].includes(axes)) throw new Error(`periodic is ${JSON.stringify(axes)}, not "x", "y" or "xy".`);
  if (axes && arena === null) throw new Error("periodic axes are those of an arena, and there is none.");
  return axes;
}

function readShape(table, i) {
  const name = `shapes[${i}]`;
  const read = (...known) => keys(table, ["kind", ...known], name);
  const point = (key) => pair(table[key], `${name}.${key}`);
  const size = (key) => positive(table[key], `${name}.${key}`);
  switch (Object(table).kind) {
    case "disc":
      read("radius");
      return makeShape([[0, 0]], size("radius"));
    case "box": {
      read("width", "height");
      const [x, y] = [size("width") / 2, size("height") / 2];
      return makeShape([[-x, -y], [x, -y], [x, y], [-x, y]], 0);
    }
    case "capsule":
      read("from", "to", "radius");
      return makeShape([point("from"), point("to")], size("radius"));
    case "segment":
      read("from", "to");
      return makeShape([point("from"), point("to")], 0);
    case "polygon": {
      read("corners", "radius");
      const corners = list(table.corners, `${name}.corners`).map((corner) => pair(corner, `${name}.corners`));
      if (corners.length < 1 || corners.length > 8) throw new Error(`${name} has ${corners.length} corners, not 1 to 8.`);
      return makeShape(corners, (table.radius ?? 0) === 0 && corners.length > 1 ? 0 : size("radius"));
    }
    default:
      throw new Error(`${name}.kind is ${JSON.stringify(Object(table).kind)}, not disc, box, capsule, segment or polygon.`);
  }
}

function phases(names, wanted) {
  if (names === undefined) return;
  if ([...list(names, "narrow-phases")].sort().join() === wanted.join()) return;
  throw new Error(`narrow-phases is ${JSON.stringify(names)}; in the specification bodies meet each other, and the walls where there are any.`);
}

/** Checks a scene with accelerations (rule 2a). */
function checkAccelerations({ gravity, arena, periods, bodies, commands, until }) {
  const every = [...bodies, ...commands.filter(({ what }) => what === "insertion")];
  const [Ax, Ay] = largest([...bodies, ...commands], gravity);
  if (Ax === 0 && Ay === 0) return;
  if (arena === null && until === null) throw new Error("A body is accelerated, and there is no arena, and no end.");
  if ([Ax, Ay].some((most, axis) => most !== 0 && periods[axis] !== null)) throw new Error("A body is accelerated along a periodic axis.");
  const massOf = (number) => bodies[number]?.m ?? every.find(({ body }) => body === number)?.m;
  const isMoved = ({ m, body, ax, ay }) => (m ?? massOf(body)) === Infinity && (ax !== 0 || ay !== 0);
  if ([...every, ...commands.filter(({ what }) => what === "acceleration")].some(isMoved)) throw new Error("A body of infinite mass is accelerated.");
}

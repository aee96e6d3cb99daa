// Drawings of the scene: bodies, structure, plans. Lines that look alike are one path: a canvas is quick with few long
// paths, and slow with many short ones.

import { HUGE, SMALL, addArea, addBody, addLine, boxOf, fillSmall } from "./paper.mjs";
import { GROUPS } from "../run/events.mjs";
import { KINDS } from "../run/rows.mjs";
import { SHAPES } from "../run/structure.mjs";

const MANY = 300; // shapes that look alike: more have lines a pixel wide, which are far quicker

export const CROWDED = 3000; // shapes of a structure: more are drawn only around a body, where one is selected

const GROUP_OF = KINDS.map((kind) => Object.keys(GROUPS).find((group) => group !== "all" && GROUPS[group].includes(kind)));

/** The group of a kind of event, by its number: it has the colour of the group. */
export function groupOf(kind) {
  return GROUP_OF[kind];
}

/** The colours of all bodies: of their kinds; without kinds of their speeds, or the colour of immovable ones; null: absent. */
export function coloursOf({ kind, mass }, there, speed, { colours: { kinds, speeds, fixed }, pace }) {
  const last = speeds.length - 1;
  return Array.from(there, (isThere, body) => {
    if (!isThere) return null;
    if (kind) return kinds[(kind[body] ?? 0) % kinds.length];
    return mass[body] === Infinity ? fixed : speeds[Math.min(Math.floor((speed(body) / pace) * speeds.length), last)];
  });
}

/** Draws all bodies of a run: bodies {radius, outline}, their places and colours; `marked` ones over the others. */
export function drawBodies(view, bodies, places, colours, theme, marked) {
  const { pen, camera } = view;
  const add = (body) => addBody(view, places.x[body], places.y[body], bodies.radius[body] || 0, bodies.outline[body]); // NaN: unknown
  const layers = new Map([...new Set(colours)].map((colour) => [colour, []]));
  layers.delete(null);
  colours.forEach((colour, body) => {
    if (colour === null || marked.has(body)) return;
    if (bodies.radius[body] * camera.scale >= HUGE) drawBody(view, () => add(body), colour, theme.line, 1);
    else layers.get(colour).push(body);
  });
  const isSmall = (body) => !bodies.outline[body] && !(bodies.radius[body] * camera.scale >= SMALL);
  for (const [filling, those] of layers) {
    const small = those.length > MANY && !pen.isVector ? those.filter(isSmall) : [];
    let seen = 0;
    pen.fillStyle = filling;
    pen.beginPath();
    for (const body of those) if (!small.length || !isSmall(body)) seen += add(body);
    if (seen) pen.fill();
    for (const body of small) {
      if (!add(body)) continue;
      fillSmall(view, places.x[body], places.y[body], bodies.radius[body] || 0);
      seen += 1;
    }
    if (seen) drawEdge(pen, theme.line, 1);
  }
  for (const [body, mark] of marked) {
    if (!colours[body]) continue; // absent, or none of this run
    drawBody(view, () => add(body), colours[body], mark.line, 2.5, mark.fill);
  }
}

function drawEdge(pen, line, width) {
  pen.strokeStyle = line;
  pen.lineWidth = width;
  pen.stroke();
}

/** Draws one body alone; with a `tint` over its colour that keeps its number readable. */
function drawBody({ pen }, add, filling, line, width, tint) {
  pen.beginPath();
  if (!add()) return;
  pen.fillStyle = filling;
  pen.fill();
  drawEdge(pen, line, width);
  if (tint) {
    pen.globalAlpha = 0.4;
    pen.fillStyle = tint;
    pen.fill();
    pen.globalAlpha = 1;
  }
}

/** Draws the numbers of the bodies that have room for them, over all else. */
export function drawNumbers({ pen, camera, width, height }, bodies, places, there, room, pointed) {
  pen.font = "12px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillStyle = "#000";
  const least = room * pen.measureText(String(there.length - 1)).width;
  for (let body = 0; body < there.length; body += 1) {
    const radius = (bodies.room[body] ?? bodies.radius[body]) * camera.scale;
    if (!there[body] || !(radius < HUGE && (2 * radius >= least || body === pointed))) continue;
    const [right, up] = camera.see(places.x[body], places.y[body]);
    if (Math.abs(right) > width / 2 + 20 || Math.abs(up) > height / 2 + 20) continue;
    pen.fillText(String(body), width / 2 + right, height / 2 - up);
  }
}

/**
 * Draws the structure after a number of events: its shapes under the bodies, or over them (`over`). The shapes that fail
 * next and those that the last event created have looks of their own; a rescheduled shape has a wider line. For a crowded
 * structure only the shapes of the body `around` are drawn, unless that is null.
 */
export function drawStructure(view, structure, done, places, { looks, next, fresh, hidden, around, selected }, over) {
  const { pen } = view;
  for (const { role, state, shapes: all } of structure.layers(done)) {
    const shapes = around === null ? all : all.filter((shape) => structure.hangsOn(shape, around));
    if (!shapes.length) continue;
    const own = looks[role];
    if (hidden.has(role)) continue;
    if (own.over !== over) continue;
    const look = { next, fresh }[state] ?? own;
    addShapes(view, structure, shapes, places, look);
    pen.setLineDash(look.dashes);
    pen.strokeStyle = look.colour;
    pen.lineWidth = look.width + (state === "again" ? 1 : 0);
    if (shapes.length > MANY) pen.lineWidth = Math.min(look.width, 1 / devicePixelRatio);
    pen.globalAlpha = look.strength;
    pen.stroke();
    pen.globalAlpha = 1;
    if (selected !== null && look.strength < 1) {
      const chosen = shapes.filter((shape) => structure.hangsOn(shape, selected));
      if (chosen.length) addShapes(view, structure, chosen, places, look);
      if (chosen.length) pen.stroke();
    }
    pen.setLineDash([]);
  }
}

/** Draws the picked shape over the others. */
export function drawPicked(view, structure, shape, places, theme) {
  addShapes(view, structure, [shape], places, { filled: 0.3, colour: theme.groups.structural });
  view.pen.strokeStyle = theme.selected;
  view.pen.lineWidth = 3;
  view.pen.stroke();
}

/** Fills shapes of a kind, with their images, and adds them to a new path. Each is filled alone: a path of many is slow to fill. */
function addShapes(view, structure, shapes, places, look) {
  const { pen } = view;
  const kind = SHAPES[structure.shape[shapes[0]]];
  pen.globalAlpha = look.filled;
  pen.fillStyle = look.colour;
  const moved = (shape, [right, up]) => structure.points(shape, places).map(([x, y]) => [x + right, y + up]);
  if (kind === "polygon") {
    for (const shape of look.filled ? shapes : []) {
      for (const image of structure.images(shape, places)) {
        pen.beginPath();
        addArea(view, moved(shape, image));
        pen.fill();
      }
    }
  }
  pen.beginPath();
  for (const shape of shapes) {
    for (const image of structure.images(shape, places)) {
      if (kind === "polygon") {
        addArea(view, moved(shape, image));
        continue;
      }
      const [right, up] = image;
      const [x, y, otherX, otherY] = corners(structure, shape, places);
      if (kind !== "box") {
        addLine(view, x + right, y + up, otherX + right, otherY + up);
        continue;
      }
      const box = boxOf(view, x + right, y + up, otherX + right, otherY + up);
      if (!box) continue;
      if (look.filled) pen.fillRect(...box);
      pen.rect(...box);
    }
  }
  pen.globalAlpha = 1;
}

/** The coordinates of a shape of two points: x, y, x, y. */
function corners(structure, shape, places) {
  const at = structure.start[shape];
  return [structure.coordinate(shape, at, places), structure.coordinate(shape, at + 1, places), structure.coordinate(shape, at + 2, places), structure.coordinate(shape, at + 3, places)];
}

/** Draws a flight: points from an anchor to the body, in the middle, and on to its future position; of a curve every second piece. */
export function drawFlight(view, points, colour) {
  const { pen } = view;
  const middle = (points.length - 1) / 2;
  const draw = (from, to, step = 1) => {
    for (let at = to; at > from; at -= step) addLine(view, ...points[at - 1], ...points[at]);
  };
  pen.strokeStyle = colour;
  pen.lineWidth = 1.5;
  pen.beginPath();
  draw(0, middle);
  pen.stroke();
  const isCurved = middle > 1;
  pen.setLineDash(isCurved ? [] : [6, 4]); // dashes would start again with each piece
  pen.beginPath();
  draw(middle, 2 * middle, isCurved ? 2 : 1);
  pen.stroke();
  pen.setLineDash([]);
}

/** Draws the edge of a body at its future position. */
export function drawOutline(view, x, y, radius, outline, colour) {
  const { pen } = view;
  pen.strokeStyle = colour;
  pen.lineWidth = 1.5;
  pen.setLineDash([6, 4]);
  pen.beginPath();
  if (addBody(view, x, y, radius, outline)) pen.stroke();
  pen.setLineDash([]);
}

/** Draws a sentence in the corner of the picture, over all else. */
export function drawNote({ pen }, text, theme) {
  pen.font = "12px system-ui, sans-serif";
  pen.textAlign = "left";
  pen.textBaseline = "top";
  pen.fillStyle = theme.paper;
  pen.fillRect(0, 0, pen.measureText(text).width + 16, 24);
  pen.fillStyle = theme.text;
  pen.fillText(text, 8, 6);
}

/** Draws the arena's walls; they clip all later drawings, until the pen is restored. */
export function drawWalls(view, [width, height], colour) {
  const { pen } = view;
  pen.beginPath();
  addArea(view, [[0, 0], [width, 0], [width, height], [0, height]]);
  pen.strokeStyle = colour;
  pen.lineWidth = 2;
  pen.stroke();
  pen.save();
  pen.clip();
}

// The proof lens: the item under the pointer in words; and the certificate of the picked item as a formula and as a
// graph of the gap over time, from now to a little after the tick of its failure.

import { prepare } from "./paper.mjs";
import { $ } from "./tables.mjs";
import { elapsed } from "../run/clock.mjs";
import { seek } from "../run/events.mjs";
import { bodiesOf, proofOf, proofOfPair, shapeInWords } from "../run/proof.mjs";
import { SHAPES } from "../run/structure.mjs";

const TOUCH = 5; // pixels from a line
const SAMPLES = 80;

/** The identity of a shape, without the failure of its certificate. */
const lookOf = (structure, shape) => JSON.stringify({ ...structure.plain(shape), fails: null });

/** The distance from the origin to the segment between two points. */
function toSegment([ax, ay], [bx, by]) {
  const [dx, dy] = [bx - ax, by - ay];
  const part = Math.min(Math.max(-(ax * dx + ay * dy) / (dx * dx + dy * dy || 1), 0), 1);
  return Math.hypot(ax + part * dx, ay + part * dy);
}

/** Twice the signed area of a polygon, and true if the origin is inside: its edges cross the half-line to the right an odd number of times. */
export function areaAround(corners) {
  let [area, inside] = [0, false];
  corners.forEach(([ax, ay], at) => {
    const [bx, by] = corners[(at + 1) % corners.length];
    area += ax * by - bx * ay;
    if (ay > 0 !== by > 0 && ax + (ay / (ay - by)) * (bx - ax) > 0) inside = !inside;
  });
  return [Math.abs(area), inside];
}

export class Lens {
  /** `picked`: a shape of the run `at`, by its identity, or null. */
  constructor(player) {
    Object.assign(this, { player, picked: null });
  }

  pick(at, shape) {
    this.picked = null;
    if (shape === null) return;
    const { structure } = this.#run(at);
    this.picked = { at, role: structure.role[shape], body: bodiesOf(structure, shape)[0], look: lookOf(structure, shape), title: shapeInWords(structure, shape) };
  }

  /** The picked shape in a pane, with its present certificate; null if it is not present. */
  shapeOf(at, structure, done) {
    const { picked } = this;
    if (picked?.at !== at) return null;
    const isIt = (shape) => structure.role[shape] === picked.role && bodiesOf(structure, shape)[0] === picked.body && lookOf(structure, shape) === picked.look;
    return structure.at(done).find(isIt) ?? null;
  }

  /**
   * The shape at a place of a pane, in pixels right of and above its middle: a shape that fails next, if its line or edge
   * is near, because other lines are beside it; or the nearest line; or the smallest area; or null.
   */
  shapeAt(at, [right, up]) {
    const { player } = this;
    const run = player.playback.runs[at];
    const structure = player.structureOf(run);
    if (!structure || !player.structured || !player.isDrawnAt([right, up])) return null;
    const places = player.placesOf(run);
    const around = player.around(structure, run.done);
    const failing = new Set(structure.failing(run.done));
    const near = { next: [null, TOUCH], line: [null, TOUCH], area: [null, Infinity] };
    const take = (name, shape, size) => size < near[name][1] && (near[name] = [shape, size]);
    for (const shape of structure.at(run.done)) {
      const kind = SHAPES[structure.shape[shape]];
      if (kind === "entry" || player.hidden.has(structure.roles[structure.role[shape]])) continue;
      if (around !== null && !structure.hangsOn(shape, around)) continue;
      const points = structure.points(shape, places);
      for (const [aside, above] of structure.images(shape, places)) {
        let corners = points.map(([x, y]) => player.camera.see(x + aside, y + above)).map(([x, y]) => [x - right, y - up]);
        if (kind === "box") corners = [corners[0], [corners[1][0], corners[0][1]], corners[1], [corners[0][0], corners[1][1]]];
        const isLine = kind === "link" || kind === "segment";
        if (isLine) take("line", shape, toSegment(...corners));
        else {
          const [size, inside] = areaAround(corners);
          if (inside) take("area", shape, size);
        }
        if (failing.has(shape)) corners.forEach((corner, nth) => take("next", shape, toSegment(corner, corners[(nth + 1) % corners.length])));
      }
    }
    return near.next[0] ?? near.line[0] ?? near.area[0];
  }

  /** The item at a place of a pane, in words; empty without one. */
  nameAt(canvas, point) {
    const { player } = this;
    const at = player.panes.indexOf(canvas);
    const body = player.bodyAt(canvas, point);
    if (body !== null) return `${player.held.kinds[player.held.kind[body]] ?? "body"} ${body}`;
    const shape = this.shapeAt(at, point);
    if (shape === null) return "";
    const { title, formula } = proofOf(this.#run(at), shape, player.playback.moment, player.held);
    return `${title}: ${formula}`;
  }

  /** The proof of the picked item, or the one of a selected body that fails first; null without both. */
  proof() {
    const { player, picked } = this;
    const { moment } = player.playback;
    const run = this.#run(picked?.at ?? 0);
    if (picked) {
      const shape = run.structure ? this.shapeOf(picked.at, run.structure, run.done) : null;
      if (shape !== null) return proofOf(run, shape, moment, player.held);
      return { title: picked.title, formula: "it is not there now", gap: null, fails: null };
    }
    const body = player.selected;
    if (body === null || !run.motion.plans.there[body]) return null;
    const [shape] = run.structure?.failing(run.done, body) ?? [];
    if (shape !== undefined) return proofOf(run, shape, moment, player.held, body);
    const event = seek(run.events, run.done, 1, "contacts", body);
    return event < 0 ? null : proofOfPair(run, [run.events.a[event], run.events.b[event]], moment, player.held);
  }

  /** A run with its structure now. */
  #run(at) {
    const run = this.player.playback.runs[at];
    return { ...run, structure: this.player.structureOf(run) };
  }

  /** Shows the picked item in words, and draws its graph. */
  tell() {
    const proof = this.proof();
    $("proof").hidden = proof === null;
    if (!proof) return;
    $("proof-name").textContent = `Certificate: ${proof.title}`;
    $("formula").textContent = proof.formula;
    $("lens").hidden = proof.gap === null;
    if (proof.gap) this.#graph(proof);
  }

  #graph({ gap, fails }) {
    const { theme, playback, held, speed } = this.player;
    const { pen, width, height } = prepare($("lens"), devicePixelRatio);
    const root = fails ? elapsed(fails, ...playback.moment, held.unit) : null;
    const until = root > 0 ? 1.3 * root : 10 * speed;
    const values = Array.from({ length: SAMPLES + 1 }, (_, at) => gap((at * until) / SAMPLES));
    const [low, high] = [Math.min(0, ...values), Math.max(0, ...values)];
    const place = (time, value) => [8 + (time / until) * (width - 16), 16 + (1 - (value - low) / (high - low || 1)) * (height - 40)];
    const zero = place(0, 0)[1];
    pen.clearRect(0, 0, width, height);
    pen.fillStyle = theme.line;
    pen.fillRect(0, zero, width, 1);
    pen.strokeStyle = theme.groups.contacts;
    pen.lineWidth = 2;
    pen.beginPath();
    values.forEach((value, at) => (at ? pen.lineTo(...place((at * until) / SAMPLES, value)) : pen.moveTo(...place(0, value))));
    pen.stroke();
    pen.fillStyle = theme.text;
    pen.textBaseline = "top";
    pen.textAlign = "left";
    pen.fillText("gap, from now on", 8, 1);
    if (root === null) return;
    const [x] = place(Math.max(root, 0), 0);
    pen.fillStyle = theme.groups.structural;
    pen.beginPath();
    pen.arc(x, zero, 5, 0, 2 * Math.PI);
    pen.fill();
    pen.fillStyle = theme.text;
    pen.textAlign = "right";
    pen.fillText(`0 in ${root.toPrecision(4)}`, Math.min(x + 30, width - 4), height - 16);
  }
}

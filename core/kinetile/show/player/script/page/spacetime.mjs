// A run in space and time: one coordinate of the bodies to the right, time upwards. A body is a band between its two
// bounds, which cross where sweep-and-prune swaps, and have a kink at a contact. The same drawing as by space_time.py,
// for a run that plays.

import { Backdrop } from "./paper.mjs";
import { between, elapsed, fractionOf } from "../run/clock.mjs";
import { Motion } from "../run/motion.mjs";
import { KINDS, givesPlans, isThereAfter } from "../run/rows.mjs";

const SHEET = 1500; // rows of a run that are drawn together: more would be indistinguishable
const PARTS = 16; // straight pieces of a parabola

/** The extents of a body below and above its place along an axis (0: x, 1: y). */
function reachAlong(bodies, body, axis) {
  const outline = bodies.outline[body];
  if (!outline) return [bodies.radius[body] || 0, bodies.radius[body] || 0];
  const side = outline.map((corner) => corner[axis]);
  return [-Math.min(...side), Math.max(...side)];
}

/** The contact point as a part of the way between two bodies: for discs by their radii, for other shapes the half. */
function partOf({ outline, radius }, a, b) {
  const whole = radius[a] + radius[b];
  return outline[a] || outline[b] || !(whole > 0) ? 0.5 : radius[a] / whole;
}

export class SpaceTime {
  /** `axis`: "x" or "y", or "" without a drawing. */
  constructor(canvas, player) {
    Object.assign(this, { canvas, player, axis: "" });
  }

  /** Draws along an axis. */
  show(axis) {
    this.axis = axis;
    this.canvas.hidden = !axis;
  }

  /** The drawn rows of the first run, and the moments of their beginning and end. */
  sheet() {
    const { playback, runs: [{ rows }] } = this.player;
    const { done } = playback.runs[0].motion;
    const first = Math.min(Math.floor(done / SHEET), Math.floor(Math.max(rows.count - 1, 0) / SHEET)) * SHEET;
    const last = Math.min(first + SHEET, rows.count);
    const moment = (row) => [rows.epoch[row], rows.tick[row]];
    const begin = first > 0 ? moment(first - 1) : playback.begin;
    return { first, last, begin, end: last < rows.count ? moment(last - 1) : playback.end };
  }

  /** Pieces of bands {body, since, until, from, to}: times from the beginning of a sheet, places at both ends; and contacts. */
  pieces({ first, last, begin, end }) {
    const { bodies, held, runs: [{ rows }] } = this.player;
    const motion = new Motion(bodies, rows, held.unit, [0, 0]);
    motion.to(first);
    const { plans } = motion;
    const which = this.axis === "x" ? 0 : 1;
    const since = (moment) => elapsed(moment, begin[0], begin[1], held.unit);
    const pieces = [];
    const met = [];
    const began = new Map();
    const start = (body, moment) => plans.there[body] && began.set(body, moment);
    const close = (body, moment) => {
      const from = began.get(body);
      if (!from) return;
      const parts = motion.pull(body)?.[which] ? PARTS : 1;
      const stops = Array.from({ length: parts + 1 }, (_, at) => between(from, moment, at / parts));
      for (let at = 0; at < parts; at += 1) {
        const [begin, end] = [stops[at], stops[at + 1]];
        pieces.push({ body, since: since(begin), until: since(end), from: motion.place(body, begin)[which], to: motion.place(body, end)[which] });
      }
    };
    bodies.x.forEach((_, body) => start(body, begin));
    for (let row = first; row < last; row += 1) {
      if (!givesPlans(rows.kind[row])) continue;
      const moment = [rows.epoch[row], rows.tick[row]];
      const both = [rows.a[row], rows.b[row]].filter((body) => body >= 0);
      both.forEach((body) => close(body, moment));
      motion.to(row + 1);
      both.forEach((body) => (isThereAfter(rows.kind[row]) ? start(body, moment) : began.delete(body)));
      if (KINDS[rows.kind[row]] === "disc") met.push([since(moment), ...both.map((body) => motion.place(body, moment)[which]), partOf(bodies, ...both)]);
    }
    for (const body of began.keys()) close(body, end);
    return { pieces, met };
  }

  draw(theme) {
    if (!this.axis) return;
    const { player } = this;
    const sheet = this.sheet();
    const { rows } = player.runs[0];
    if (this.rows !== rows) Object.assign(this, { rows, backdrop: new Backdrop() });
    const key = [sheet.first, sheet.last, this.axis, player.selected].join(" ");
    const { pen, width, height } = this.backdrop.show(this.canvas, theme, key, (view) => this.#bands(view, sheet, theme));
    pen.fillStyle = theme.now;
    pen.fillRect(0, height * (1 - fractionOf(player.playback.moment, sheet.begin, sheet.end)) - 1, width, 2);
  }

  #bands({ pen, width, height }, sheet, theme) {
    const { bodies, held, selected } = this.player;
    const which = this.axis === "x" ? 0 : 1;
    const { pieces, met } = this.pieces(sheet);
    const [low, high] = held.arena ? [0, held.arena[which]] : [held.box[which], held.box[which + 2]];
    const whole = elapsed(sheet.end, ...sheet.begin, held.unit) || 1;
    const period = held.periods[which];
    const point = (place, time) => [((place - low) / (high - low || 1)) * width, height * (1 - time / whole)];
    const near = (place) => (period ? place - period * Math.floor((place - low) / period) : place);
    for (const { body, since, until, from, to } of pieces) {
      const [below, above] = reachAlong(bodies, body, which);
      const left = near(from);
      const far = period ? Math.ceil(Math.abs(to - from) / period) + 1 : 0;
      for (let turn = -far; turn <= far; turn += 1) {
        const [one, other] = [left + turn * period, left + (to - from) + turn * period];
        const corners = [point(one - below, since), point(one + above, since), point(other + above, until), point(other - below, until)];
        pen.beginPath();
        corners.forEach(([x, y], at) => (at ? pen.lineTo(x, y) : pen.moveTo(x, y)));
        pen.fillStyle = body === selected ? theme.selected : theme.groups.contacts;
        pen.globalAlpha = body === selected ? 0.35 : 0.15;
        pen.fill();
        pen.globalAlpha = 1;
        pen.beginPath();
        pen.moveTo(...corners[0]);
        pen.lineTo(...corners[3]);
        pen.moveTo(...corners[1]);
        pen.lineTo(...corners[2]);
        pen.strokeStyle = theme.groups.contacts;
        pen.lineWidth = 1;
        pen.stroke();
      }
    }
    pen.fillStyle = theme.groups.structural;
    for (const [time, one, other, part] of met) {
      const apart = other - one - (period ? period * Math.round((other - one) / period) : 0);
      const [x, y] = point(near(one + part * apart), time);
      pen.beginPath();
      pen.arc(x, y, 3, 0, 2 * Math.PI);
      pen.fill();
    }
  }

  /** The moment's fraction of the whole recording at a height of the canvas, 0 at its top. */
  timeAt(part) {
    const { playback, held } = this.player;
    const sheet = this.sheet();
    const [from, to] = [sheet.begin, sheet.end].map((moment) => elapsed(moment, ...playback.begin, held.unit));
    return (to + (from - to) * part) / (elapsed(playback.end, ...playback.begin, held.unit) || 1);
  }
}

// The state of the page: playing, selection, view; and the drawing of it.

import { Camera, gapOf, nearest } from "./camera.mjs";
import { CROWDED, coloursOf, drawBodies, drawFlight, drawNote, drawNumbers, drawOutline, drawPicked, drawStructure, drawWalls, groupOf } from "./drawing.mjs";
import { Lens, areaAround } from "./lens.mjs";
import { drawMatrix } from "./matrix.mjs";
import { prepare } from "./paper.mjs";
import { Race } from "./race.mjs";
import { SpaceTime } from "./spacetime.mjs";
import { BodyTable, countUp, tell } from "./tables.mjs";
import { Timeline, lanesOf } from "./timeline.mjs";
import { Trial } from "./trial.mjs";
import { between, compare, elapsed, later, momentAt, timeOf } from "../run/clock.mjs";
import { GROUPS, momentOfEvent, seek } from "../run/events.mjs";
import { apartAlong, imagesAlong, wrapped } from "../run/motion.mjs";
import { Playback } from "../run/playback.mjs";
import { KINDS } from "../run/rows.mjs";
import { Sentences } from "../run/sentences.mjs";

/** The greatest speed of time, in parts of the initial speed: a whole recording within a frame. */
const FASTEST = 2 ** 12;

/** Lines of a drawn parabola, from an anchor to now, and from now on. */
const CURVED = 48;

/** The least speed: in a recording of one unit of the clock, a frame is a few ticks. */
const SLOWEST = 2 ** -40;

/** The colours of the style sheet. */
export function readTheme() {
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(`--${name}`).trim();
  const groups = Object.fromEntries(Object.keys(GROUPS).map((group) => [group, colour(group)]));
  const names = ["line", "text", "selected", "now", "wall", "paper"];
  return { groups, ...Object.fromEntries(names.map((name) => [name, colour(name)])) };
}

/** The box of points [x, y]: left, bottom, right, top. */
function boxAround(points) {
  const [x, y] = [0, 1].map((axis) => points.map((point) => point[axis]));
  return [Math.min(...x), Math.min(...y), Math.max(...x), Math.max(...y)];
}

/** The state of the page, the actions of a reader, and the drawing. */
export class Player {
  constructor(held, { bodies, runs }) {
    Object.assign(this, { held, selected: held.select, follows: false, structured: true, pointed: null });
    Object.assign(this, { playing: 0, evenly: false, group: "all", hidden: new Set() });
    this.camera = new Camera();
    this.speed = held.speed;
    this.theme = readTheme();
    this.panes = [...document.querySelectorAll("canvas.stage")];
    this.matrices = [...document.querySelectorAll("canvas.matrix")];
    this.matrices.forEach((canvas, at) => {
      canvas.hidden = !(runs[at].structure?.hasMatrix ?? runs[at].present.hasMatrix);
    });
    this.lens = new Lens(this);
    this.hold(bodies, runs);
    this.trial = new Trial(this);
    this.bodyTable = new BodyTable(this);
    this.spaceTime = new SpaceTime(document.getElementById("spacetime"), this);
    this.fit();
    if (held.open) this.playback.seek(held.open);
  }

  /** Sets the runs to be played, from the page's content or computed in it, until a moment. */
  hold(bodies, runs, end = this.held.end) {
    const { held } = this;
    bodies.outline = held.shape.map((shape) => held.shapes[shape]?.outline ?? null);
    bodies.kind = held.kinds.length ? held.kind : null;
    bodies.room = held.shape.map((shape) => held.shapes[shape]?.room ?? 0);
    Object.assign(this, { bodies, runs });
    this.playback = new Playback(bodies, runs, { ...held, end });
    this.sentences = runs.map((run, at) => new Sentences(run, this.playback.runs[at].events, bodies, held));
    const [x, y, kx, ky] = Array.from({ length: 4 }, () => new Float64Array(bodies.x.length));
    this.places = { x, y, kx, ky, periods: held.periods.some((period) => period) ? held.periods : null };
    this.counts = this.playback.runs.map(({ events }) => countUp(events));
    this.lanes = lanesOf(this.counts.map((count) => count.total));
    this.timeline = new Timeline(document.getElementById("timeline"), this.playback, this.lanes);
    this.race = new Race(document.getElementById("race"), this);
  }

  /** Fits a box to the panes; one of them may be smaller. */
  fit(box = this.held.box) {
    const [width, height] = ["clientWidth", "clientHeight"].map((size) => Math.min(...this.panes.map((canvas) => canvas[size])));
    this.camera.fit(box, width, height);
  }

  /** After a change of the window's size, fits a fitted box again; any other view stays. */
  resized() {
    if (this.camera.box) this.fit(this.camera.box);
    this.changed();
  }

  /** The time as a double; for a typed moment, the typed time, which may lie within its tick. */
  time() {
    const { moment } = this.playback;
    if (this.typed && compare(this.typed.moment, moment) === 0) return this.typed.time;
    return timeOf(moment, this.held.start, this.held.unit);
  }

  // Actions of a reader

  toggle() {
    this.playing = this.playing ? 0 : performance.now();
    this.say(this.playing ? "playing" : "paused");
    this.told = 0; // at once
    if (this.playing && compare(this.playback.moment, this.playback.end) === 0) this.playback.seek(this.playback.begin);
    this.changed();
  }

  step(direction, ofBody = false) {
    this.playing = 0;
    const body = ofBody ? this.selected : null;
    const found = this.playback.step(direction, this.group, body);
    if (found) this.arrive();
    else this.say("no such event");
    this.changed();
  }

  /** After a jump to a moment, describes it, unless time runs on from it. */
  arrive() {
    if (!this.playing) this.say(this.momentInWords());
    this.changed();
  }

  /** The present moment in words. */
  momentInWords() {
    const { playback } = this;
    const at = playback.runs.findIndex((each) => playback.current(each) >= 0);
    if (at >= 0) {
      const event = playback.current(playback.runs[at]);
      const isOwn = playback.runs.length > 1 && KINDS[playback.runs[at].events.kind[event]] === "structural";
      return `${isOwn ? `${this.held.runs[at].label}: ` : ""}${this.sentences[at].of(event)}, time ${this.time()}`;
    }
    const where = this.between();
    return where === "the beginning" ? where : `${where}, time ${this.time()}`;
  }

  /** The position of a moment without an event, in words. */
  between() {
    const { moment, begin, end } = this.playback;
    if (compare(moment, begin) === 0) return "the beginning";
    return compare(moment, end) === 0 ? "the end" : "between events";
  }

  /** Goes to just after an event of the first run. */
  jump(event) {
    this.playback.jump(0, event);
    this.arrive();
  }

  /** Makes time pass faster or slower, by a power of two, within bounds. */
  hasten(factor) {
    const { speed } = this.held;
    this.speed = Math.min(Math.max(this.speed * factor, SLOWEST * speed), FASTEST * speed);
    this.changed();
  }

  /** Goes to a written time, exactly: to the tick that it rounds down to. */
  goTo(text) {
    const time = Number(text);
    if (text.trim() === "" || !Number.isFinite(time)) return this.say(`${text} is no time`);
    this.typed = { moment: momentAt(time, this.held.start, this.held.unit), time };
    this.playback.seek(this.typed.moment);
    return this.arrive();
  }

  /** Goes this far from a moment, in parts of the whole time. */
  seekFraction(fraction, from = this.playback.begin) {
    const whole = elapsed(this.playback.end, ...this.playback.begin, this.held.unit);
    this.playback.seek(later(from, fraction * whole, this.held.unit));
    this.arrive();
  }

  select(body) {
    this.selected = body;
    this.lens.pick(0, null);
    this.follows = this.follows && body !== null;
    this.say(body === null ? "no body selected" : `body ${body} selected`);
    this.changed();
  }

  /** Picks the item at a place of a canvas: a body, or a shape of the structure. */
  pickAt(canvas, point) {
    const body = this.bodyAt(canvas, point);
    const at = this.panes.indexOf(canvas);
    const shape = body === null ? this.lens.shapeAt(at, point) : null;
    this.select(body);
    if (shape === null) return;
    this.lens.pick(at, shape);
    this.say(this.lens.proof().title);
  }

  /** Shows the number of the body under the pointer, if any. */
  point(body) {
    if (body !== this.pointed) this.changed();
    this.pointed = body;
  }

  selectNext(direction) {
    const { there } = this.playback.runs[0].motion.plans;
    const n = there.length;
    let body = this.selected ?? (direction > 0 ? -1 : n);
    for (let tries = 0; tries < n; tries += 1) {
      body = (body + direction + n) % n;
      if (there[body]) return this.select(body);
    }
    return undefined;
  }

  /**
   * Moves the view to the event: to the gap between the two bodies of the present event; or to the changes of the
   * structure with it; or to the gap of the selected body's next contact; or to the shapes that fail next.
   */
  lookAtEvent() {
    const [{ motion }] = this.playback.runs;
    const pair = this.pair();
    const box = pair ? null : this.newsBox();
    if (!pair && !box) return this.say("nothing to look at: step to an event, or select a body");
    this.follows = false;
    if (pair) {
      const [[ax, ay], [bx, by]] = pair.map((body) => motion.place(body, this.playback.moment));
      const [dx, dy] = this.apart(...pair);
      const [one, other] = pair.map((body) => this.bodies.outline[body]);
      const part = this.bodies.radius[pair[0]] / Math.hypot(dx, dy);
      if (one) this.camera.look(...this.shown([ax, ay], nearest(one, dx, dy)));
      else if (other) this.camera.look(...this.shown([bx, by], nearest(other, -dx, -dy)));
      else this.camera.look(...this.shown([ax, ay], [dx * part, dy * part]));
    } else {
      const room = 1.2 * Math.max(...this.bodies.radius.filter((radius) => radius > 0), 0); // room for a disc on each side
      this.fit([box[0] - room, box[1] - room, box[2] + room, box[3] + room]);
    }
    return this.changed();
  }

  /** A place plus a small difference, moved by periods to where it is drawn: images end at the borders. */
  shown(place, beside) {
    const { periods } = this.held;
    return [...place.map((at, axis) => (periods[axis] ? at - periods[axis] * Math.floor((at + beside[axis]) / periods[axis]) : at)), ...beside];
  }

  /** The box of the shapes that the present event created, or of those that fail next; or null. */
  newsBox() {
    for (const run of this.playback.runs) {
      const structure = this.structureOf(run);
      const places = this.placesOf(run);
      const corners = (structure?.news(run.done) ?? []).flatMap((shape) => {
        const [left, bottom, right, top] = boxAround(structure.points(shape, places));
        const half = [(right - left) / 2, (top - bottom) / 2];
        const [x, y] = this.shown([left, bottom], half);
        return [[x, y], [x + 2 * half[0], y + 2 * half[1]]];
      });
      if (corners.length) return boxAround(corners);
    }
    return null;
  }

  pair() {
    const run = this.playback.runs[0];
    let event = this.playback.current(run);
    const isPair = (each) => each >= 0 && run.events.b[each] >= 0;
    if (event < 0 && this.selected !== null) event = seek(run.events, run.done, 1, "contacts", this.selected);
    return isPair(event) ? [run.events.a[event], run.events.b[event]] : null;
  }

  say(text) {
    document.getElementById("said").textContent = text;
  }

  // Drawing

  changed() {
    if (!this.waiting) {
      this.waiting = true;
      requestAnimationFrame((now) => this.frame(now));
    }
  }

  frame(now) {
    this.waiting = false;
    if (this.playing) {
      const seconds = Math.min(Math.max(now - this.playing, 0) / 1000, 0.1);
      this.playing = now;
      const more = this.evenly ? this.playback.playEvenly(seconds * this.pace()) : this.playback.play(seconds * this.speed);
      if (!more) {
        this.playing = 0;
        this.say(`the end, time ${this.time()}`);
      }
    }
    if (this.follows && this.selected !== null) {
      this.camera.look(...this.playback.runs[0].motion.place(this.selected, this.playback.moment));
    }
    this.panes.forEach((canvas, at) => this.drawPane(canvas, at));
    this.timeline.draw(this.theme);
    this.spaceTime.draw(this.theme);
    if (!this.playing || now - (this.told ?? 0) > 100) {
      this.told = now;
      tell(this);
      this.lens.tell();
      this.race.tell();
    }
    if (this.playing) this.changed();
  }

  /** The bound that the speed has reached, in words; or an empty text. */
  bound() {
    if (this.speed === FASTEST * this.held.speed) return ", the fastest";
    return this.speed === SLOWEST * this.held.speed ? ", the slowest" : "";
  }

  /** Events a second, if time runs evenly between them. */
  pace() {
    return 2 * (this.speed / this.held.speed);
  }

  /** The places of all bodies in a run now. */
  placesOf(run) {
    run.motion.places(this.playback.moment, this.places);
    return this.places;
  }

  /**
   * The structure of a run now: as recorded, or else as computed; null without both. While time runs, a hidden structure is
   * not computed for its readings alone.
   */
  structureOf(run) {
    if (run.structure && run.done <= run.structure.seen) return run.structure;
    if (this.playing && !this.structured && this.selected === null && !this.lens.picked) return null;
    return run.present.at(this.playback.moment, run.done, run.motion, this.placesOf(run)) ?? run.structure;
  }

  /** True if there is a structure, recorded or computed. */
  get hasStructure() {
    return this.playback.runs.some(({ structure, present }) => structure || present.draw);
  }

  /** A crowded structure is drawn only around this body; null: all of it is drawn. */
  around(structure, done) {
    return this.selected !== null && structure?.at(done).length > CROWDED ? this.selected : null;
  }

  drawPane(canvas, at) {
    const run = this.playback.runs[at];
    const { bodies, camera, theme, held } = this;
    const { there } = run.motion.plans;
    const view = { ...prepare(canvas, devicePixelRatio), camera };
    const structure = this.structured ? this.structureOf(run) : null;
    const around = this.around(structure, run.done);
    const looks = { ...held, hidden: this.hidden, around, selected: this.selected };
    view.pen.clearRect(0, 0, view.width, view.height);
    const places = this.placesOf(run);
    const colours = coloursOf(bodies, there, (body) => Math.hypot(...run.motion.velocity(body, this.playback.moment)), held);
    if (held.arena) drawWalls(view, held.arena, theme.wall);
    if (structure) drawStructure(view, structure, run.done, places, looks, false);
    this.drawImages(places, (seen) => drawBodies(view, bodies, seen, colours, theme, this.marks(run)));
    if (structure) drawStructure(view, structure, run.done, places, looks, true);
    const picked = structure && this.lens.shapeOf(at, structure, run.done);
    if (picked !== null) drawPicked(view, structure, picked, places, theme);
    const body = this.selected;
    if (body !== null && there[body]) this.drawPlan(view, run, body);
    this.trial.draw(view, places, theme);
    drawNumbers(view, bodies, places, there, held.room, this.pointed);
    if (held.arena) view.pen.restore();
    if (structure && run.done > structure.seen) drawNote(view, `the structure is recorded up to event ${structure.seen} only`, theme);
    else if (this.trial.recorded) drawNote(view, this.trial.note, theme);
    else if (around !== null) drawNote(view, `the structure around body ${around}; Escape: all of it`, theme);
    const matrix = this.matrices[at];
    if (!matrix.hidden) drawMatrix(matrix, structure?.entries(run.done) ?? [], there, held, theme, this.marks(run));
  }

  /** Draws bodies at their places, and with periodic axes also their images beside them. */
  drawImages({ x, y }, draw) {
    const [width, height] = this.held.periods;
    const turns = (period) => (period ? [-period, 0, period] : [0]);
    for (const right of turns(width)) {
      for (const up of turns(height)) {
        draw(right || up ? { x: x.map((at) => at + right), y: y.map((at) => at + up) } : { x, y });
      }
    }
  }

  /** The colours of the bodies that are selected or in the present event. */
  marks(run) {
    const marks = new Map();
    for (const body of run.passing.at(run.done)) marks.set(body, { line: this.theme.groups.passings });
    const event = this.playback.current(run);
    if (event >= 0) {
      const colour = this.theme.groups[groupOf(run.events.kind[event])];
      for (const body of [run.events.a[event], run.events.b[event]]) {
        if (body >= 0) marks.set(body, { fill: colour, line: colour });
      }
    }
    if (this.selected !== null) {
      marks.set(this.selected, { fill: marks.get(this.selected)?.fill, line: this.theme.selected });
    }
    return marks;
  }

  /** Draws a body's plan, through borders: to its position, on to its next event, and the body there. */
  drawPlan(view, run, body) {
    const { bodies, theme, held: { periods } } = this;
    const points = this.plan(run, body);
    for (const [right, up] of imagesAlong(points[0], points.at(-1), periods)) drawFlight(view, points.map(([x, y]) => [x + right, y + up]), theme.selected);
    const [x, y] = points.at(-1).map((place, axis) => [wrapped(place, periods[axis])]);
    this.drawImages({ x, y }, (seen) => drawOutline(view, seen.x[0], seen.y[0], bodies.radius[body] || 0, bodies.outline[body], theme.selected));
  }

  /** A body's plan: points from its anchor to its position, in the middle, and on to its next event; on a parabola if accelerated. */
  plan(run, body) {
    const { plans } = run.motion;
    let until = this.playback.end;
    let event = seek(run.events, run.done, 1, "all", body);
    while (event >= 0 && KINDS[run.events.kind[event]] === "structural") event = seek(run.events, event + 1, 1, "all", body);
    if (event >= 0) until = momentOfEvent(run.events, event);
    const { moment } = this.playback;
    const count = run.motion.pull(body) ? CURVED : 1;
    const part = (from, to) => Array.from({ length: count }, (_, at) => between(from, to, at / count));
    const moments = [...part([plans.epoch[body], plans.tick[body]], moment), ...part(moment, until), until];
    return moments.map((each) => run.motion.flown(body, each, moment));
  }

  /** The difference between two bodies: through the image of a passing that begins or ends now, else through the nearest. */
  apart(a, b, { motion } = this.playback.runs[0]) {
    const [run] = this.playback.runs;
    const image = run.passing.imageOf(this.playback.current(run));
    const images = motion.images(Math.min(a, b), Math.max(a, b), this.playback.moment);
    const { apart } = images.find((each) => each.image === image) ?? images[0];
    return apart.map((each) => (a < b ? each : -each));
  }

  /** The gap between the surfaces of two bodies. */
  gap(run, a, b) {
    const one = run.motion.place(a, this.playback.moment);
    const there = this.apart(a, b, run).map((apart, axis) => one[axis] + apart);
    return gapOf(one, this.bodies.radius[a], there, this.bodies.radius[b]);
  }

  /** True if a point in pixels right of and above the middle may be drawn: images end at the borders. */
  isDrawnAt([right, up]) {
    const { held: { arena }, places: { periods }, camera: { x, y, dx, dy, scale } } = this;
    return !periods || [x + dx + right / scale, y + dy + up / scale].every((at, axis) => at >= 0 && at <= arena[axis]);
  }

  /** The body at a place of a canvas, in pixels right of and above its middle, by its nearest image; or null. */
  bodyAt(canvas, point) {
    const { motion } = this.playback.runs[this.panes.indexOf(canvas)];
    if (!this.isDrawnAt(point)) return null;
    for (let body = 0; body < this.bodies.x.length; body += 1) {
      if (!motion.plans.there[body]) continue;
      const seen = this.camera.see(...motion.place(body, this.playback.moment));
      const [right, up] = seen.map((at, axis) => apartAlong(point[axis], at, motion.periods[axis] * this.camera.scale));
      const away = Math.hypot(right, up);
      const outline = this.bodies.outline[body];
      if (outline && away > 6 && !areaAround(outline.map(([ax, ay]) => [right + ax * this.camera.scale, up + ay * this.camera.scale]))[1]) continue;
      if (away <= Math.max((this.bodies.radius[body] || 0) * this.camera.scale, 6)) return body;
    }
    return null;
  }
}

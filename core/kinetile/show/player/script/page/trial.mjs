// Try it: from the present moment on, the page computes the run, after a disc was thrown, turned back or inserted, or
// with a time-stepped engine. The recorded run is drawn as dashed outlines where it differs, and the first contact that
// differs is named.

import { addDisc, addLine } from "./paper.mjs";
import { $, legend } from "./tables.mjs";
import { compare, momentOf, ticksOf, timeOf } from "../run/clock.mjs";
import { contactsOf, eventsAt, firstDifference, momentOfEvent, withTime } from "../run/events.mjs";
import { Live } from "../run/live.mjs";
import { Motion } from "../run/motion.mjs";
import { PLAN } from "../run/plan.mjs";
import { Present } from "../run/present.mjs";
import { Stepped } from "../run/stepped.mjs";

const MOST = 60; // bodies: every pair is checked
const LONGEST = 512; // units of the clock
const BUDGET = 10; // milliseconds a frame for computing
const PAUSE = 100; // milliseconds between two displays of the computed rows
const SLOW = 2 ** -10; // of the initial speed of playing: the least that a throw assumes
const BY_FLIGHT = [...PLAN, "before"]; // columns of rows with two values a row

/** The reason not to compute, in words, or undefined: a page does for elastic discs in an arena with walls, without commands, from the beginning. */
export function reasonAgainst({ held: { arena, begin, end, periods, pull, responses, shapes }, bodies, commands }) {
  const count = bodies.radius.length;
  const reasons = [
    [!arena, "the scene has no walls"],
    [periods.some((each) => each), "an axis is periodic"],
    [pull, "bodies are accelerated"],
    [responses.flat().some((each) => each !== "elastic"), "contacts are not all elastic"],
    [shapes.length, "the bodies are not all discs"],
    [commands, "the scene has commands"],
    [count === 0 || count > MOST, `the scene has ${count} bodies, and the page computes 1 to ${MOST}`],
    [!bodies.radius.every((radius) => radius > 0), "some bodies are points"],
    [compare(begin, [0, 0]) !== 0, "the page does not begin at the start of its scene"],
    [end[0] >= LONGEST, `the page ends ${end[0]} units of the clock after the start, and the page computes less than ${LONGEST}`],
  ];
  return reasons.filter(([holds]) => holds).map(([, words]) => words)[0];
}

export class Trial {
  constructor(player) {
    Object.assign(this, { player, on: false, pulled: null, recorded: null });
    const { held, bodies, counts: [{ total }] } = player;
    const reason = reasonAgainst({ held, bodies, commands: total.commands });
    $("trial").hidden = reason !== undefined;
    $("untried").hidden = reason === undefined;
    $("untried").textContent = reason === undefined ? "" : `Try it is not offered here: ${reason}.`;
  }

  toggle() {
    if ($("trial").hidden) return this.player.say($("untried").textContent);
    this.on = !this.on;
    for (const canvas of this.player.panes) canvas.style.touchAction = this.on ? "none" : "";
    this.player.say(this.on ? "drag a disc to throw it, or from an empty place to throw one in" : "dragging moves the view");
    return this.player.changed();
  }

  /** Begins a drag, in pixels right of and above the middle of a canvas; time stands still meanwhile. */
  grab(canvas, from) {
    if (!this.on) return;
    this.player.playing = 0;
    this.pulled = { body: this.player.bodyAt(canvas, from), from, to: from };
  }

  /** Ends a drag: a disc flies as far as it was pulled in a second of playing. */
  release() {
    const { player, pulled } = this;
    const { speed, bodies, held } = player;
    this.pulled = null;
    const [from, to] = [pulled.from, pulled.to].map((place) => this.#place(place));
    const velocity = to.map((at, axis) => (at - from[axis]) / Math.max(speed, SLOW * held.speed));
    const like = player.selected ?? 0;
    if (pulled.body !== null) this.fork((run) => run.turn(pulled.body, velocity));
    else this.fork((run) => (run.insert(from, velocity, bodies.radius[like], bodies.mass[like]) === null ? `there is no room for a disc like ${like}` : ""));
  }

  /** Turns the selected body back. */
  turnBack() {
    const { playback: { runs: [{ motion: { plans } }] }, selected: body } = this.player;
    if ($("trial").hidden) return;
    if (body === null || !plans.there[body]) this.player.say("select a body first");
    else this.fork((run) => run.turn(body, [-plans.vx[body], -plans.vy[body]]));
  }

  /** Continues from here, with the chosen engine, after a command on a run, which may return a refusal. */
  fork(command) {
    const { held, playback, bodies, runs } = this.player;
    const radii = Number($("engine").value); // the flight of the fastest disc in a step; 0: exact
    const [{ motion, events }] = playback.runs;
    const rows = { count: motion.done };
    for (const [name, column] of Object.entries(motion.rows)) {
      if (name !== "count") rows[name] = Array.from(column.slice(0, (BY_FLIGHT.includes(name) ? 2 : 1) * motion.done));
    }
    const run = new (radii ? Stepped : Live)(bodies, motion.plans, rows, playback.moment, held);
    const refusal = command(run);
    if (refusal) return this.player.say(refusal);
    const fastest = Math.max(...run.bodies.map(({ vx, vy }) => Math.hypot(vx, vy)));
    run.step = BigInt(Math.ceil((radii * Math.min(...bodies.radius)) / (fastest || 1) / run.tick)) || 1n;
    this.recorded ??= { bodies, runs, events, motion: new Motion(bodies, runs[0].rows, held.unit) };
    this.run = run;
    this.#show(rows.count, false);
    return this.#go(run, performance.now());
  }

  /** Computes for a while, and continues in the next frame; `shown` is the page's time of the last display. */
  #go(run, shown) {
    if (run !== this.run) return;
    const isDone = run.until(ticksOf(this.player.held.end), performance.now() + BUDGET);
    const isDue = isDone || performance.now() - shown > PAUSE;
    if (isDue) this.#show(this.player.playback.runs[0].motion.done, isDone);
    if (isDone) this.#compare();
    else requestAnimationFrame(() => this.#go(run, isDue ? performance.now() : shown));
  }

  /** Shows the computed rows, with the first `done` of them past. */
  #show(done, isDone) {
    const { run, player: { held, playback: before } } = this;
    const bodies = {};
    for (const [name, column] of Object.entries(this.recorded.bodies)) {
      if (ArrayBuffer.isView(column)) bodies[name] = Float64Array.from(run.bodies, (body, at) => column[at] ?? { radius: body.radius, mass: body.mass }[name] ?? 0);
    }
    const runs = held.runs.map((each) => ({ rows: run.rows, steps: null, structure: null, present: new Present(each, bodies, held), isComputed: true }));
    this.note = isDone ? "computed in this page; O: as recorded" : `computing: up to time ${timeOf(momentOf(run.now), held.start, held.unit).toPrecision(4)} so far`;
    this.#hold(bodies, runs, run.isCut ? momentOf(run.now) : held.end);
    const { playback } = this.player;
    playback.known = isDone ? playback.end : momentOf(run.now);
    playback.resume(before, done);
  }

  #hold(bodies, runs, end) {
    const { player } = this;
    player.hold(bodies, runs, end);
    if (player.selected >= bodies.x.length) player.select(null);
    legend(player);
    player.changed();
  }

  /** Names the first contact that differs from the recorded run; with a time-stepped engine, goes there. */
  #compare() {
    const { player, recorded, run } = this;
    const own = player.playback.runs[0].events;
    const isStepped = run instanceof Stepped;
    const found = firstDifference(own, recorded.events, !isStepped);
    if (run.isCut) player.say(`after ${own.count} events nothing more is computed here: ${withTime(own, own.count - 1, player.held)}`);
    else if (!found) player.say(`the same ${contactsOf(own).length} contacts as recorded, ${isStepped ? "in the same order" : "to the last bit"}`);
    else {
      const [mine, theirs] = found.events;
      if (isStepped && mine >= 0) player.playback.seek(momentOfEvent(own, mine));
      player.say(`contact ${found.at + 1} is the first that differs: ${withTime(own, mine, player.held)}; recorded: ${withTime(recorded.events, theirs, player.held)}`);
    }
    player.changed();
  }

  /** Shows the recorded run again. */
  reset() {
    if (!this.recorded) return;
    const { bodies, runs } = this.recorded;
    const { moment } = this.player.playback;
    Object.assign(this, { recorded: null, run: null });
    $("engine").value = "0";
    this.#hold(bodies, runs, this.player.held.end);
    this.player.playback.seek(moment);
    this.player.say("the run as recorded");
  }

  /** The place in the scene at pixels right of and above the middle. */
  #place([right, up]) {
    const { x, y, dx, dy, scale } = this.player.camera;
    return [x + dx + right / scale, y + dy + up / scale];
  }

  /** Draws the recorded run as outlines where it differs, and the arrow of a throw. */
  draw(view, places, theme) {
    const { pen, camera } = view;
    pen.strokeStyle = theme.selected;
    pen.lineWidth = 1.5;
    if (this.recorded) {
      const { motion, bodies } = this.recorded;
      const { moment } = this.player.playback;
      motion.to(eventsAt(motion.rows, moment));
      pen.setLineDash([4, 3]);
      pen.beginPath();
      motion.plans.there.forEach((there, body) => {
        const [x, y] = motion.place(body, moment);
        const isAway = Math.hypot(x - places.x[body], y - places.y[body]) * camera.scale > 1;
        if (there && isAway) addDisc(view, x, y, bodies.radius[body]);
      });
      pen.stroke();
      pen.setLineDash([]);
    }
    if (!this.pulled) return;
    const { from, to } = this.pulled;
    const [right, up] = [to[0] - from[0], to[1] - from[1]];
    pen.lineWidth = 3;
    pen.beginPath();
    addLine(view, ...this.#place(from), ...this.#place(to));
    for (const side of [-1, 1]) addLine(view, ...this.#place(to), ...this.#place([to[0] - 0.2 * right + side * 0.1 * up, to[1] - 0.2 * up - side * 0.1 * right]));
    pen.stroke();
  }
}

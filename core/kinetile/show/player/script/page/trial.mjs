// Try it: from the present moment on, the run is computed in the page, after a disc was thrown or turned back, or one
// thrown in, or with a time-stepped engine. The recorded run is drawn as dashed outlines where it differs, and the first
// contact that differs is named.

import { addDisc, addLine } from "./paper.mjs";
import { $, legend } from "./tables.mjs";
import { compare, ticksOf } from "../run/clock.mjs";
import { contactsOf, firstDifference, momentOfEvent, withTime } from "../run/events.mjs";
import { Live } from "../run/live.mjs";
import { Motion } from "../run/motion.mjs";
import { Present } from "../run/present.mjs";
import { Stepped } from "../run/stepped.mjs";

const MOST = 60; // bodies: every pair is asked, some 400 microseconds an event
const BUDGET = 10; // milliseconds a frame for computing
const BY_FLIGHT = ["x", "y", "vx", "vy", "before"]; // columns of rows with two values a row

export class Trial {
  /** For elastic discs in an arena with walls, without commands, from the beginning: nothing else is computed here. */
  constructor(player) {
    const { held: { arena, begin, end, periods, responses, shapes }, bodies, counts: [{ total }] } = player;
    const isPlain = arena && !periods.some((each) => each) && !responses.flat().some((each) => each !== "elastic") && !shapes.length;
    const isWhole = compare(begin, [0, 0]) === 0 && end[0] < 512 && bodies.radius.every((radius) => radius > 0);
    Object.assign(this, { player, on: false, pulled: null, recorded: null });
    $("trial").hidden = !(isPlain && isWhole && total.commands === 0 && bodies.radius.length <= MOST);
  }

  toggle() {
    if ($("trial").hidden) return;
    this.on = !this.on;
    for (const canvas of this.player.panes) canvas.style.touchAction = this.on ? "none" : "";
    this.player.say(this.on ? "drag a disc to throw it, or from an empty place to throw one in" : "dragging moves the view");
    this.player.changed();
  }

  /** A drag begins, in pixels right of and above the middle of a canvas. */
  grab(canvas, from) {
    if (this.on) this.pulled = { body: this.player.bodyAt(canvas, from), from, to: from };
  }

  /** The drag has ended: a disc flies as far as it was pulled in a second of playing. */
  release() {
    const { player, pulled } = this;
    const { playback: { runs: [{ motion }], moment }, speed, bodies } = player;
    this.pulled = null;
    const from = pulled.body === null ? this.#place(pulled.from) : motion.place(pulled.body, moment);
    const velocity = this.#place(pulled.to).map((to, axis) => (to - from[axis]) * speed);
    const like = player.selected ?? 0;
    if (pulled.body !== null) this.fork((run) => run.turn(pulled.body, velocity));
    else this.fork((run) => (run.insert(from, velocity, bodies.radius[like], bodies.mass[like]) === null ? `there is no room for a disc like ${like}` : ""));
  }

  /** Turn the selected body back. */
  turnBack() {
    const { playback: { runs: [{ motion: { plans } }] }, selected: body } = this.player;
    if ($("trial").hidden) return;
    if (body === null || !plans.there[body]) this.player.say("select a body first");
    else this.fork((run) => run.turn(body, [-plans.vx[body], -plans.vy[body]]));
  }

  /** Go on from here after a command on a run, which may say why it is refused; in steps of so many radii, 0: exact. */
  fork(command, radii = Number($("engine").value)) {
    const { held, playback, bodies, runs } = this.player;
    const [{ motion, events }] = playback.runs;
    const rows = { count: motion.done };
    for (const [name, column] of Object.entries(motion.rows)) {
      if (name !== "count") rows[name] = Array.from(column.slice(0, (BY_FLIGHT.includes(name) ? 2 : 1) * motion.done));
    }
    const run = new (radii ? Stepped : Live)(bodies, motion.plans, rows, playback.moment, held);
    const fastest = Math.max(...run.bodies.map(({ vx, vy }) => Math.hypot(vx, vy)));
    run.step = BigInt(Math.ceil((radii * Math.min(...bodies.radius)) / (fastest || 1) / run.tick)) || 1n;
    const refusal = command(run);
    if (refusal) return this.player.say(refusal);
    this.recorded ??= { bodies, runs, events, motion: new Motion(bodies, runs[0].rows, held.unit) };
    this.run = run;
    return this.#go(run);
  }

  /** Compute for a while, show what there is, and go on in the next frame. */
  #go(run) {
    if (run !== this.run) return;
    const { held } = this.player;
    const isDone = run.until(ticksOf(held.end), performance.now() + BUDGET);
    const bodies = {};
    for (const [name, column] of Object.entries(this.recorded.bodies)) {
      if (ArrayBuffer.isView(column)) bodies[name] = Float64Array.from(run.bodies, (body, at) => column[at] ?? { radius: body.radius, mass: body.mass }[name] ?? 0);
    }
    const runs = held.runs.map(({ drawn_as: how }) => ({ rows: run.rows, steps: null, structure: null, present: new Present(how, bodies, held), isComputed: true }));
    this.#show(bodies, runs);
    if (isDone) this.#compare();
    else requestAnimationFrame(() => this.#go(run));
  }

  /** Play other runs, from the same moment on. */
  #show(bodies, runs) {
    const { player } = this;
    const { moment } = player.playback;
    player.hold(bodies, runs);
    if (player.selected >= bodies.x.length) player.select(null);
    player.playback.seek(moment);
    legend(player);
    player.changed();
  }

  /** Say which contact is the first that differs from the recorded run; of a time-stepped run, go there. */
  #compare() {
    const { player, recorded, run } = this;
    const own = player.playback.runs[0].events;
    const isStepped = run instanceof Stepped;
    const found = firstDifference(own, recorded.events, !isStepped);
    if (run.isStuck) player.say("the run ends here: contacts come up without end");
    else if (!found) player.say(`the same ${contactsOf(own).length} contacts as recorded, ${isStepped ? "in the same order" : "to the last bit"}`);
    else {
      const [mine, theirs] = found.events;
      if (isStepped && mine >= 0) player.playback.seek(momentOfEvent(own, mine));
      player.say(`contact ${found.at + 1} is the first that differs: ${withTime(own, mine, player.held)}; recorded: ${withTime(recorded.events, theirs, player.held)}`);
    }
    player.changed();
  }

  /** Show the recorded run again. */
  reset() {
    if (!this.recorded) return;
    const { bodies, runs } = this.recorded;
    Object.assign(this, { recorded: null, run: null });
    this.#show(bodies, runs);
    this.player.say("the run as recorded");
  }

  /** What stands where in the scene, from pixels right of and above the middle. */
  #place([right, up]) {
    const { x, y, dx, dy, scale } = this.player.camera;
    return [x + dx + right / scale, y + dy + up / scale];
  }

  /** The recorded run as outlines where it differs, and the arrow of a throw. */
  draw(view, places, theme) {
    const { pen, camera } = view;
    pen.strokeStyle = theme.selected;
    pen.lineWidth = 1.5;
    if (this.recorded) {
      const { motion, bodies } = this.recorded;
      const { moment } = this.player.playback;
      motion.to(motion.rowsAt(moment));
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

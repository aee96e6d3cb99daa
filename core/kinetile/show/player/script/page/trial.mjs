// Try it: from the present moment on the run is computed in the page, after a disc was thrown or turned, one thrown in,
// or with a time-stepped engine. The run as it was recorded is drawn as outlines, and the first contact that differs is named.

import { addDisc, addLine } from "./paper.mjs";
import { $ } from "./tables.mjs";
import { compare, ticksOf, timeOf } from "../run/clock.mjs";
import { inWords, momentOfEvent } from "../run/events.mjs";
import { Live } from "../run/live.mjs";
import { Motion } from "../run/motion.mjs";
import { Present } from "../run/present.mjs";
import { KINDS } from "../run/rows.mjs";
import { Stepped } from "../run/stepped.mjs";

const MOST = 60; // bodies
const BUDGET = 10; // milliseconds a frame for computing

export class Trial {
  constructor(player) {
    const { held: { arena, begin, end, periods, responses, shapes }, bodies } = player;
    const isPlain = arena && !periods.some((each) => each) && !responses.flat().some((each) => each !== "elastic") && !shapes.length;
    const isShort = compare(begin, [0, 0]) === 0 && end[0] < 512 && bodies.radius.every((radius) => radius > 0);
    Object.assign(this, { player, on: false, pulled: null, recorded: null });
    $("trial").hidden = !(isPlain && isShort && bodies.radius.length <= MOST);
  }

  toggle() {
    if ($("trial").hidden) return;
    this.on = !this.on;
    for (const canvas of this.player.panes) canvas.style.touchAction = this.on ? "none" : "";
    this.player.say(this.on ? "drag a disc to throw it, or from an empty place to throw one in" : "dragging moves the view");
    this.player.changed();
  }

  /** A drag begins, in pixels right of and above the middle of a canvas; return whether it is a throw. */
  grab(canvas, from) {
    if (this.on) this.pulled = { body: this.player.bodyAt(canvas, from), from, to: from };
    return this.on;
  }

  /** The drag has ended: a disc flies as far as it was pulled in a second of playing. */
  release() {
    const { player, pulled } = this;
    const { camera, playback, speed, bodies } = player;
    this.pulled = null;
    const place = ([right, up]) => [camera.x + camera.dx + right / camera.scale, camera.y + camera.dy + up / camera.scale];
    const from = pulled.body === null ? place(pulled.from) : playback.runs[0].motion.place(pulled.body, playback.moment);
    const velocity = place(pulled.to).map((to, axis) => (to - from[axis]) * speed);
    const like = player.selected ?? 0;
    this.fork((run) => {
      if (pulled.body !== null) run.turn(pulled.body, velocity);
      else return run.insert(from, velocity, bodies.radius[like], bodies.mass[like]) !== null || "there is no room for a disc";
      return true;
    });
  }

  /** Turn the selected body back. */
  turnBack() {
    const { playback: { runs: [{ motion: { plans } }] }, selected: body } = this.player;
    if (body === null || $("trial").hidden) return this.player.say("select a body first");
    return this.fork((run) => run.turn(body, [-plans.vx[body], -plans.vy[body]]) ?? true);
  }

  /** Go on from here with a command on a run, which returns true, or why it is refused; in steps of so many radii, 0: exact. */
  fork(command, radii = Number($("engine").value)) {
    const { held, playback, bodies, runs } = this.player;
    const [{ motion, events }] = playback.runs;
    this.recorded ??= { bodies, runs, events, motion: new Motion(bodies, runs[0].rows, held.unit) };
    const rows = { count: motion.done };
    for (const [name, column] of Object.entries(motion.rows)) {
      if (name !== "count") rows[name] = Array.from(column).slice(0, (["x", "y", "vx", "vy", "before"].includes(name) ? 2 : 1) * motion.done);
    }
    this.run = new (radii ? Stepped : Live)(bodies, motion.plans, rows, playback.moment, held);
    const fastest = Math.max(...this.run.bodies.map(({ vx, vy }) => Math.hypot(vx, vy)));
    this.run.step = BigInt(Math.ceil((radii * Math.min(...bodies.radius)) / (fastest || 1) / this.run.tick)) || 1n;
    const said = command(this.run);
    if (said !== true) this.player.say(said);
    else this.#go(this.run);
  }

  /** Compute for a while, show what there is, and go on in the next frame. */
  #go(run) {
    if (run !== this.run) return;
    const { player, recorded } = this;
    const isDone = run.until(ticksOf(player.held.end), performance.now() + BUDGET);
    const bodies = Object.fromEntries(Object.entries(recorded.bodies).filter(([, column]) => column?.BYTES_PER_ELEMENT));
    for (const [name, column] of Object.entries(bodies)) {
      bodies[name] = Float64Array.from(run.bodies, (body, at) => column[at] ?? { radius: body.radius, mass: body.mass }[name] ?? 0);
    }
    const runs = player.held.runs.map(({ drawn_as: how }) => ({ rows: run.rows, steps: null, structure: null, present: new Present(how, bodies, player.held) }));
    const { moment } = player.playback;
    player.hold(bodies, runs);
    player.playback.seek(moment);
    player.changed();
    if (isDone) this.#compare();
    else requestAnimationFrame(() => this.#go(run));
  }

  /** Say which contact is the first that differs from the recorded run; of a time-stepped run, go there. */
  #compare() {
    const { player, recorded } = this;
    const met = (events) => Array.from({ length: events.count }, (_, event) => event).filter((event) => ["disc", "wall"].includes(KINDS[events.kind[event]]));
    const [own, theirs] = [player.playback.runs[0].events, recorded.events].map((events) => ({ events, list: met(events) }));
    const name = ({ events, list }, at) => (at < list.length ? `${events.a[list[at]]} ${events.b[list[at]]}` : "");
    let at = 0;
    while (at < own.list.length && name(own, at) === name(theirs, at)) at += 1;
    const words = ({ events, list }) => (at < list.length ? `${inWords(events, list[at], player.held)} at ${timeOf(momentOfEvent(events, list[at]), player.held.start, player.held.unit).toPrecision(6)}` : "nothing");
    const isSame = at === own.list.length && at === theirs.list.length;
    if (!isSame && this.run instanceof Stepped && at < own.list.length) player.playback.seek(momentOfEvent(own.events, own.list[at]));
    player.say(isSame ? `the same ${at} contacts, in the same order` : `contact ${at + 1} is the first that differs: ${words(own)}; recorded: ${words(theirs)}`);
    player.changed();
  }

  /** Show the recorded run again. */
  reset() {
    if (!this.recorded) return;
    const { moment } = this.player.playback;
    this.player.hold(this.recorded.bodies, this.recorded.runs);
    Object.assign(this, { recorded: null, run: null });
    this.player.playback.seek(moment);
    this.player.say("the run as recorded");
    this.player.changed();
  }

  /** The recorded run as outlines, and the arrow of a throw. */
  draw(view, theme) {
    const { pen } = view;
    const { playback: { moment }, camera } = this.player;
    pen.beginPath();
    if (this.recorded) {
      const { motion, bodies } = this.recorded;
      motion.to(motion.rowsAt(moment));
      motion.plans.there.forEach((there, body) => there && addDisc(view, ...motion.place(body, moment), bodies.radius[body]));
    }
    if (this.pulled) {
      const points = [this.pulled.from, this.pulled.to].map(([right, up]) => [camera.x + camera.dx + right / camera.scale, camera.y + camera.dy + up / camera.scale]);
      addLine(view, ...points[0], ...points[1]);
    }
    pen.strokeStyle = theme.groups.commands;
    pen.lineWidth = 1.5;
    pen.stroke();
  }
}

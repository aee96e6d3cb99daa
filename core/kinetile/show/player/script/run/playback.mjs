// Runs on one clock: seek, step by event, play. The state is a moment and the number of done events of each run: events
// of one tick are stepped one by one, so a moment alone is not a state.

import { between, compare, later } from "./clock.mjs";
import { decode } from "./columns.mjs";
import { Passing, eventsAt, merge, momentOfEvent, seek } from "./events.mjs";
import { Motion } from "./motion.mjs";
import { Present } from "./present.mjs";
import { isAside, rebuild } from "./rows.mjs";
import { Structure } from "./structure.mjs";

/** Everything that a page holds, decoded. */
export async function load(held) {
  const bodies = await decode(held.bodies);
  let rows = null;
  const runs = [];
  for (const run of held.runs) {
    rows = run.rows ? rebuild(bodies, await decode(run.rows), held) : rows; // null: the rows of the run before
    const steps = run.steps ? await decode(run.steps) : null;
    const structure = run.structure ? new Structure(await decode(run.structure), run.labels, Object.keys(held.looks), run.seen) : null;
    runs.push({ rows, steps, structure, present: new Present(run, bodies, held) });
  }
  return { bodies, runs };
}

export class Playback {
  /** `runs`: [{rows, steps, structure}], with rows from `rebuild`; the others may be null. `known`: the end of the rows so far. */
  constructor(bodies, runs, { unit, begin, end, periods, passing }) {
    Object.assign(this, { unit, begin, end, known: end });
    const events = runs.map(({ rows, steps }) => merge(rows, steps));
    const motionOf = (rows) => new Motion(bodies, rows, unit, periods);
    this.runs = runs.map(({ rows, structure, present }, at) => ({
      events: events[at],
      passing: new Passing(events[at], motionOf(rows), passing),
      motion: motionOf(rows),
      structure,
      present,
      done: 0,
    }));
    this.#be(begin);
  }

  /** Goes to a moment: all events up to and at it are done; at the beginning, no event. */
  seek(moment) {
    if (compare(moment, this.begin) <= 0) {
      this.#be(this.begin);
      this.runs.forEach((run) => this.#settle(run, 0));
      return;
    }
    this.#be(compare(moment, this.known) < 0 ? moment : this.known);
    this.runs.forEach((run) => this.#settle(run, eventsAt(run.events, this.moment)));
  }

  /**
   * Steps to the next event of a group (direction 1) or the one before (-1), of a body unless that is null; if there are
   * several runs, to the nearest. Before the first event is the beginning. Returns true if there is such an event.
   */
  step(direction, group = "all", body = null) {
    const found = this.runs.map((run) => seek(run.events, this.#from(run, direction), direction, group, body));
    const moments = found.map((event, at) => (event < 0 ? null : momentOfEvent(this.runs[at].events, event)));
    const known = moments.filter((moment) => moment !== null);
    if (!known.length) {
      const back = direction < 0 && group === "all" && body === null && this.runs.some((run) => run.done > 0);
      if (back) this.seek(this.begin);
      return back;
    }
    const next = known.reduce((one, other) => (compare(one, other) * direction <= 0 ? one : other));
    this.#be(next);
    this.runs.forEach((run, at) => {
      const steps = moments[at] !== null && compare(moments[at], next) === 0;
      this.#settle(run, steps ? found[at] + 1 : eventsAt(run.events, next));
    });
    return true;
  }

  /** Goes to just after an event of a run; the other runs go to its moment. */
  jump(at, event) {
    this.seek(momentOfEvent(this.runs[at].events, event));
    this.#settle(this.runs[at], event + 1);
  }

  /** Plays a part of the scene's time, forward or back. Returns true if there is more. */
  play(time) {
    this.seek(later(this.moment, time, this.unit));
    return compare(this.moment, time < 0 ? this.begin : this.end) !== 0;
  }

  /** Plays a number of events, with even time between two events. Returns true if there is more. */
  playEvenly(events) {
    const isWaiting = () => compare(this.known, this.end) < 0 && this.runs.every((run) => run.done === run.events.count);
    this.way += events;
    while (this.way >= 1 && !isWaiting()) {
      const rest = this.way - 1;
      if (!this.step(1)) {
        this.seek(this.end);
        return false;
      }
      this.way = rest;
    }
    if (isWaiting()) { // the next event is still being computed
      this.way = 0;
      return true;
    }
    const next = this.runs
      .filter((run) => run.done < run.events.count)
      .map((run) => momentOfEvent(run.events, run.done))
      .reduce((one, other) => (compare(one, other) <= 0 ? one : other), this.end);
    this.moment = between(this.since, next, this.way);
    this.runs.forEach((run) => this.#settle(run, run.done));
    return true;
  }

  /** Takes over the state of another playback, with `rows` of each run done. */
  resume({ moment, since, way }, rows) {
    Object.assign(this, { moment, since, way });
    for (const run of this.runs) {
      let done = 0;
      while (done < run.events.count && run.events.rows[done] <= rows) done += 1;
      this.#settle(run, done);
    }
  }

  /** The last done event of a run, if this is its moment; else -1. */
  current(run) {
    const last = run.done - 1;
    return last >= 0 && compare(momentOfEvent(run.events, last), this.moment) === 0 ? last : -1;
  }

  #be(moment) {
    this.moment = moment;
    this.since = moment;
    this.way = 0;
  }

  #from(run, direction) {
    return direction < 0 && this.current(run) >= 0 ? run.done - 1 : run.done;
  }

  /** Sets the number of done events of a run, with the rows after them, up to now, that are not events. */
  #settle(run, done) {
    run.done = done;
    const { rows } = run.motion;
    let count = done ? run.events.rows[done - 1] : 0;
    while (count < rows.count && isAside(rows.kind[count])) {
      if (compare([rows.epoch[count], rows.tick[count]], this.moment) > 0) break;
      count += 1;
    }
    run.motion.to(count);
  }
}

// The timeline: a lane for each group of events, one mark an event or, for many, their density; and the present moment.

import { groupOf } from "./drawing.mjs";
import { Backdrop } from "./paper.mjs";
import { fractionOf } from "../run/clock.mjs";
import { GROUPS, momentOfEvent } from "../run/events.mjs";

const DENSE = 1000; // events of a lane: more are drawn as a density
const MARGIN = 6; // pixels, so that the first and the last mark are wholly visible

/** The lanes of the timeline, from above: one for each group with events in any run, by their numbers. */
export function lanesOf(totals) {
  return Object.keys(GROUPS).filter((group) => group !== "all" && totals.some((total) => total[group] > 0));
}

export class Timeline {
  constructor(canvas, playback, lanes) {
    Object.assign(this, { canvas, playback, lanes, gutter: MARGIN, backdrop: new Backdrop() });
    canvas.style.height = `${Math.max(lanes.length, 1) * 1.3 + 0.4}rem`;
  }

  /** The place of a fraction of the time, in pixels from the left. */
  place(fraction) {
    return this.gutter + fraction * (this.canvas.clientWidth - this.gutter - MARGIN);
  }

  /** The fraction of the time at a place. */
  fraction(place) {
    const fraction = (place - this.gutter) / Math.max(this.canvas.clientWidth - this.gutter - MARGIN, 1);
    return Math.min(Math.max(fraction, 0), 1);
  }

  /** Draws it: the marks once, and the present moment over them. */
  draw(theme) {
    const { playback } = this;
    const { pen, height } = this.backdrop.show(this.canvas, theme, "", (view) => {
      this.#names(view, theme);
      playback.runs.forEach(({ events }, part) => this.#marks(view, events, theme, part));
    });
    const now = this.place(fractionOf(playback.moment, playback.begin, playback.end));
    pen.fillStyle = theme.now;
    pen.fillRect(now - 1, 0, 2, height);
    pen.beginPath();
    pen.moveTo(now - 5, 0);
    pen.lineTo(now + 5, 0);
    pen.lineTo(now, 7);
    pen.fill();
  }

  #names({ pen, height }, theme) {
    const tall = height / Math.max(this.lanes.length, 1);
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    pen.fillStyle = theme.text;
    this.lanes.forEach((group, lane) => pen.fillText(group, MARGIN, (lane + 0.5) * tall));
    this.gutter = 2 * MARGIN + Math.max(0, ...this.lanes.map((group) => pen.measureText(group).width));
  }

  /**
   * The marks of a run; if there are several, each has its part of every lane. A lane of many events has bars instead, as
   * high as the logarithm of the number of events in a pixel's time.
   */
  #marks({ pen, height }, events, theme, part) {
    const { begin, end, runs } = this.playback;
    const tall = height / Math.max(this.lanes.length, 1);
    const own = (tall - 3) / runs.length;
    const high = own - (runs.length > 1 ? 1 : 0);
    const columns = this.lanes.map(() => new Map());
    for (let event = 0; event < events.count; event += 1) {
      const counts = columns[this.lanes.indexOf(groupOf(events.kind[event]))];
      const column = Math.floor(this.place(fractionOf(momentOfEvent(events, event), begin, end)));
      counts?.set(column, (counts.get(column) ?? 0) + 1);
    }
    columns.forEach((counts, lane) => {
      const most = Math.max(...counts.values());
      const isDense = [...counts.values()].reduce((sum, count) => sum + count, 0) > DENSE;
      pen.fillStyle = theme.groups[this.lanes[lane]];
      for (const [column, count] of counts) {
        const size = isDense ? (high * Math.log1p(count)) / Math.log1p(most) : high;
        pen.fillRect(column, lane * tall + 1.5 + part * own + high - size, isDense ? 1 : 1.5, size);
      }
    });
  }
}

// The events of a run, structural ones among the rows, in their order; and a cursor that steps through them.

import { compare, timeOf } from "./clock.mjs";
import { KINDS } from "./rows.mjs";

/** The groups in which a reader steps, and the kinds that are in each. */
export const GROUPS = {
  all: ["structural", "disc", "wall", "turn", "insert", "remove", "pass", "part"],
  contacts: ["disc"],
  structural: ["structural"],
  walls: ["wall"],
  commands: ["turn", "insert", "remove"],
  passings: ["pass", "part"],
};

/** The kinds of events that are contacts, by number. */
export const MET = new Set(["disc", "wall", "pass", "part"].map((kind) => KINDS.indexOf(kind)));

const WALLS = { "-1": "left", "-2": "right", "-3": "bottom", "-4": "top" };

/**
 * Merge rows and structural events (columns epoch, tick, body, after; or null) into one list: columns kind (a
 * number, see KINDS), epoch, tick, a, b (-1 at a structural event), and `rows`, how many are done after it.
 * What the clock writes down anew is no event.
 */
export function merge(rows, steps) {
  const list = [];
  let step = 0;
  const take = (row) => {
    while (steps && step < steps.after.length && steps.after[step] <= row) {
      list.push([0, steps.epoch[step], steps.tick[step], steps.body[step], -1, row]);
      step += 1;
    }
  };
  for (let row = 0; row < rows.count; row += 1) {
    take(row);
    if (KINDS[rows.kind[row]] !== "anchor") {
      list.push([rows.kind[row], rows.epoch[row], rows.tick[row], rows.a[row], rows.b[row], row + 1]);
    }
  }
  take(rows.count);
  const column = (at, type) => type.from(list, (each) => each[at]);
  return {
    count: list.length,
    kind: column(0, Uint8Array),
    epoch: column(1, Float64Array),
    tick: column(2, Float64Array),
    a: column(3, Int32Array),
    b: column(4, Int32Array),
    rows: column(5, Int32Array),
  };
}

/** The moment of an event. */
export function momentOfEvent(events, event) {
  return [events.epoch[event], events.tick[event]];
}

/** How many events are done at a moment, those of that very tick among them. */
export function eventsAt(events, moment) {
  let low = 0;
  let high = events.count;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (compare(momentOfEvent(events, middle), moment) <= 0) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** Whether an event is of a group, and of a body unless that is null. */
export function isOf(events, event, group, body = null) {
  if (!GROUPS[group].includes(KINDS[events.kind[event]])) return false;
  return body === null || events.a[event] === body || events.b[event] === body;
}

/** The events of a list that are contacts, those with walls and passings among them, in their order. */
export function contactsOf({ count, kind }) {
  return Array.from({ length: count }, (_, event) => event).filter((event) => MET.has(kind[event]));
}

/**
 * The first contact in which two lists of events differ, by its bodies, and by its tick if they are `timed`:
 * {at, events}, its number and the event of each list, -1 where there is none; null where there is no such contact.
 */
export function firstDifference(one, other, timed = true) {
  const lists = [one, other].map(contactsOf);
  const names = timed ? ["a", "b", "tick", "epoch"] : ["a", "b"];
  const isSame = (at) => names.every((name) => one[name][lists[0][at]] === other[name][lists[1][at]]);
  let at = 0;
  while (lists.every((list) => at < list.length) && isSame(at)) at += 1;
  return lists.some((list) => at < list.length) ? { at, events: lists.map((list) => list[at] ?? -1) } : null;
}

/**
 * The first event that is wanted from `done` on (direction 1), or the last one before `done` (direction -1);
 * -1 where there is none.
 */
export function seek(events, done, direction, group = "all", body = null) {
  for (let event = direction > 0 ? done : done - 1; event >= 0 && event < events.count; event += direction) {
    if (isOf(events, event, group, body)) return event;
  }
  return -1;
}

/** Who is passing through whom after so many events. */
export class Passing {
  constructor(events) {
    this.events = events;
    const isPassing = (event) => GROUPS.passings.includes(KINDS[events.kind[event]]);
    this.list = Array.from({ length: events.count }, (_, event) => event).filter(isPassing);
    this.asked = -1;
  }

  /** Whether two bodies are within each other after so many events. */
  holds(done, a, b) {
    this.at(done);
    return this.pairs.has([Math.min(a, b), Math.max(a, b)].join());
  }

  /** The bodies that are within another one after so many events. */
  at(done) {
    if (this.asked === done) return this.bodies;
    const { kind, a, b } = this.events;
    const pairs = (this.pairs = new Map());
    for (const event of this.list) {
      if (event >= done) break;
      const pair = [Math.min(a[event], b[event]), Math.max(a[event], b[event])];
      if (KINDS[kind[event]] === "pass") pairs.set(pair.join(), pair);
      else pairs.delete(pair.join());
    }
    [this.asked, this.bodies] = [done, new Set([...pairs.values()].flat())];
    return this.bodies;
  }
}

/** The response of two bodies (or of one and a wall, b < 0), with a space before it; nothing if it is elastic. */
function responseOf({ kind, responses }, a, b) {
  const found = responses[kind[a] ?? 0]?.at(b < 0 ? -1 : kind[b] ?? 0) ?? "elastic";
  return found === "elastic" ? "" : ` (${found})`;
}

/** An event in words; `kinds`, the `kind` of each body and `responses` are the scene's. */
export function inWords(events, event, held) {
  const [a, b] = [events.a[event], events.b[event]];
  const who = (body) => `${held.kinds[held.kind[body]] ?? "body"} ${body}`;
  const both = (one, other) => (held.kinds.length ? `${who(one)} and ${who(other)}` : `bodies ${one} and ${other}`);
  switch (KINDS[events.kind[event]]) {
    case "structural": return `a certificate of ${who(a)} fails`;
    case "disc": return `${both(a, b)} meet${responseOf(held, a, b)}`;
    case "wall": return `${who(a)} meets the ${WALLS[b]} wall${responseOf(held, a, b)}`;
    case "turn": return `${who(a)} turns`;
    case "insert": return `${who(a)} comes`;
    case "remove": return `${who(a)} goes`;
    case "pass": return `${both(a, b)} begin to pass through each other`;
    default: return `${both(b, a)} end to pass through each other`;
  }
}

/** An event in words with its time, in full: two may differ by a tick; "no contact" for -1. */
export function withTime(events, event, held) {
  if (event < 0) return "no contact";
  return `${inWords(events, event, held)} at ${timeOf(momentOfEvent(events, event), held.start, held.unit)}`;
}

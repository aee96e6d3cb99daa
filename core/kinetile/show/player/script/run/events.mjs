// The events of a run in their order, structural events among the rows; and a search that steps through them.

import { compare, timeOf } from "./clock.mjs";
import { KINDS, isAside } from "./rows.mjs";

/** The groups of events for steps, with the kinds in each. */
export const GROUPS = {
  all: ["structural", "disc", "wall", "turn", "move", "insert", "remove", "accelerate", "kind", "pass", "part"],
  contacts: ["disc"],
  structural: ["structural"],
  walls: ["wall"],
  commands: ["turn", "move", "insert", "remove", "accelerate", "kind"],
  passings: ["pass", "part"],
};

/** The kinds of events that are contacts, by number. */
export const MET = new Set(["disc", "wall", "pass", "part"].map((kind) => KINDS.indexOf(kind)));

const WALLS = { "-1": "left", "-2": "right", "-3": "bottom", "-4": "top" };

/**
 * Merges rows and structural events (columns epoch, tick, body, after; or null) into one list: columns kind (a
 * number, see KINDS), epoch, tick, a, b (-1 at a structural event), and `rows`, the number of rows after it.
 * A plan that the clock anchors again is not an event.
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
    if (!isAside(rows.kind[row])) {
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

/** The number of done events at a moment, with the events of this tick. */
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

/** True if an event belongs to a group, and to a body unless that is null. */
export function isOf(events, event, group, body = null) {
  if (!GROUPS[group].includes(KINDS[events.kind[event]])) return false;
  return body === null || events.a[event] === body || events.b[event] === body;
}

/** The contacts in a list of events, also with walls and passings, in their order. */
export function contactsOf({ count, kind }) {
  return Array.from({ length: count }, (_, event) => event).filter((event) => MET.has(kind[event]));
}

/**
 * The first contact that differs between two lists of events, by its bodies, and by its tick if they are `timed`:
 * {at, events}, its number and the event of each list, -1 without one; null if all contacts agree.
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
 * The first matching event from `done` on (direction 1), or the last one before `done` (direction -1);
 * -1 without one.
 */
export function seek(events, done, direction, group = "all", body = null) {
  for (let event = direction > 0 ? done : done - 1; event >= 0 && event < events.count; event += direction) {
    if (isOf(events, event, group, body)) return event;
  }
  return -1;
}

/**
 * The pairs that pass through each other after a number of events, and their images: a pair may pass through several
 * at a time. Rows have no images; but an image that does not pass yet is further away than one that begins, and one
 * that still passes is nearer than one that ends; also at the start. Shapes are so small that one image is within reach.
 */
export class Passing {
  /** `motion`: one for this object alone; `began`: passings that last at the beginning, [a, b, m, n] each. */
  constructor(events, motion, began) {
    this.began = began.map(([a, b, m, n]) => ({ pair: [a, b], image: `${m},${n}` }));
    this.changes = new Map(); // by event
    this.asked = -1;
    const lasting = new Set(this.began.map(keyOf));
    for (let event = 0; event < events.count; event += 1) {
      if (!GROUPS.passings.includes(KINDS[events.kind[event]])) continue;
      const pair = [events.a[event], events.b[event]].sort((one, other) => one - other);
      const begins = KINDS[events.kind[event]] === "pass";
      if (motion.periods.some((period) => period)) motion.to(events.rows[event] - 1);
      const images = motion.images(...pair, momentOfEvent(events, event)).map(({ image }) => ({ pair, image, begins }));
      const its = images.filter((each) => lasting.has(keyOf(each)) !== begins);
      const change = begins ? its[0] : its.at(-1);
      if (begins) lasting.add(keyOf(change));
      else lasting.delete(keyOf(change));
      this.changes.set(event, change);
    }
  }

  /** True if two bodies a < b are within each other after a number of events, through an image. */
  holds(done, a, b, image) {
    this.at(done);
    return this.lasting.has(keyOf({ pair: [a, b], image }));
  }

  /** The image through which an event begins or ends a passing; else undefined. */
  imageOf(event) {
    return this.changes.get(event)?.image;
  }

  /** The bodies that are within another one after a number of events. */
  at(done) {
    if (this.asked === done) return this.bodies;
    const lasting = (this.lasting = new Map(this.began.map((each) => [keyOf(each), each.pair])));
    for (const [event, change] of this.changes) {
      if (event >= done) break;
      if (change.begins) lasting.set(keyOf(change), change.pair);
      else lasting.delete(keyOf(change));
    }
    [this.asked, this.bodies] = [done, new Set([...lasting.values()].flat())];
    return this.bodies;
  }
}

const keyOf = ({ pair, image }) => `${pair} ${image}`;

/** The response of two bodies (or of one and a wall, b < 0), with a space before it; empty if it is elastic. */
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
    case "structural": return `a certificate of ${who(a)} fails${held.pull ? ", or its chord ends" : ""}`;
    case "disc": return `${both(a, b)} meet${responseOf(held, a, b)}`;
    case "wall": return `${who(a)} meets the ${WALLS[b]} wall${responseOf(held, a, b)}`;
    case "turn": return `${who(a)} turns`;
    case "insert": return `${who(a)} comes`;
    case "move": return `${who(a)} is moved`;
    case "remove": return `${who(a)} goes`;
    case "accelerate": return `${who(a)} gets another acceleration`;
    case "kind": return `${who(a)} gets another kind`;
    case "pass": return `${both(a, b)} begin to pass through each other`;
    default: return `${both(b, a)} end to pass through each other`;
  }
}

/** An event in words with its time, in full: two may differ by a tick; "no contact" for -1. */
export function withTime(events, event, held) {
  if (event < 0) return "no contact";
  return `${inWords(events, event, held)} at ${timeOf(momentOfEvent(events, event), held.start, held.unit)}`;
}

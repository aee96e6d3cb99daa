// Events in sentences: the event, and the changes of the structure with it. A phase shows its structure by the shapes
// that it draws, so the sentence follows from the shapes before and after, for any phase.

import { KINDS } from "./rows.mjs";
import { inWords, momentOfEvent } from "./events.mjs";
import { meetingOf, sideInWords } from "./meetings.mjs";
import { Motion } from "./motion.mjs";
import { SHAPES, plural } from "./structure.mjs";

const NUMBERS = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine"];
const MOST_NAMED = 3; // pairs: more are only counted

const counted = (count, role) => `${NUMBERS[count] ?? count} ${count === 1 ? role : plural(role)}`;

/** The events of one run in sentences, each made on its first use. */
export class Sentences {
  /** `run`: {rows, structure}; `events`: its events; `held`: what the page holds. */
  constructor({ rows, structure }, events, bodies, held) {
    Object.assign(this, { structure, events, held, known: new Map() });
    this.size = Math.max(held.box[2] - held.box[0], held.box[3] - held.box[1]);
    this.motion = new Motion(bodies, rows, held.unit, held.periods); // the plans before an event, whatever the page's moment
  }

  /** An event as a sentence. */
  of(event) {
    if (!this.known.has(event)) this.known.set(event, this.#make(event));
    return this.known.get(event);
  }

  #make(event) {
    const { events, structure, held } = this;
    const isKnown = structure && event < structure.seen;
    const isStructural = KINDS[events.kind[event]] === "structural";
    const lead = (isStructural && isKnown && this.#failure(event)) || inWords(events, event, held);
    return [lead, isKnown ? this.#changes(event + 1).join("; ") : ""].filter(Boolean).join(": ");
  }

  /** The failure at a structural event: two coordinates that pass each other; empty if the shapes do not show it. */
  #failure(event) {
    const { structure, events, motion } = this;
    const [moment, body] = [momentOfEvent(events, event), events.a[event]];
    motion.to(event ? events.rows[event - 1] : 0);
    const due = structure.at(event).filter((shape) => structure.epoch[shape] === moment[0] && structure.tick[shape] === moment[1]);
    const isWatched = (shape) => structure.roles[structure.role[shape]] === "certificate";
    due.sort((one, other) => isWatched(other) - isWatched(one));
    for (const shape of due) {
      const found = meetingOf(structure, shape, motion, moment, body, this.size);
      if (!found) continue;
      const role = structure.roles[structure.role[shape]];
      const label = structure.labels[structure.label[shape]];
      const words = meetingInWords(structure, event, found, role);
      return label ? `${words} (${label})` : words;
    }
    return due.some((shape) => structure.roles[structure.role[shape]] === "cell") ? `body ${body} leaves its cell` : null;
  }

  /** The changes of the structure by the last of a number of events. */
  #changes(done) {
    const { structure } = this;
    const { came, gone } = structure.changes(done);
    const [links, entries, counts] = [new Map(), new Map(), new Map()];
    let again = 0;
    for (const [shape, sign] of [...gone.map((each) => [each, -1]), ...came.map((each) => [each, 1])]) {
      const kind = SHAPES[structure.shape[shape]];
      const role = structure.roles[structure.role[shape]];
      if (role === "certificate" || role === "axis") continue; // the next certificate is not a change
      const isAgain = sign > 0 && !structure.fresh[shape];
      if (kind === "link" || kind === "entry") {
        const pair = [0, 2].map((at) => structure.body[structure.start[shape] + at]).join("-");
        if (kind === "link") links.set(pair, (links.get(pair) ?? 0) + sign);
        else entries.set(pair, { ...entries.get(pair), [sign]: structure.labels[structure.label[shape]] });
        continue;
      }
      const count = counts.get(role) ?? { came: 0, gone: 0 };
      counts.set(role, count);
      if (isAgain) count.gone -= 1;
      else count[sign > 0 ? "came" : "gone"] += 1;
      again += isAgain ? 1 : 0;
    }
    const found = [...counts].filter(([, count]) => count.came || count.gone).map(([role, count]) => replacement(role, count));
    for (const [verb, verbs, sign] of [["ends", "end", -1], ["begins", "begin", 1]]) {
      const pairs = [...links].filter(([, change]) => change === sign).map(([pair]) => pair);
      if (pairs.length > MOST_NAMED) found.push(`${counted(pairs.length, "pair")} ${verbs}`);
      else if (pairs.length > 1) found.push(`pairs ${pairs.join(", ")} ${verbs}`);
      else if (pairs.length) found.push(`pair ${pairs[0]} ${verb}`);
    }
    const cells = [...entries].map(([pair, { "-1": before, 1: after }]) => [pair, before, after]);
    const matrix = cells.map(([pair, before, after]) => `${pair} ${before && after ? `from ${before} to ${after}` : after ? `has ${after}` : `has no ${before} more`}`);
    if (matrix.length) found.push(`in the matrix ${matrix.length > MOST_NAMED ? `${matrix.length} entries change` : matrix.join(", ")}`);
    if (again) found.push(`${counted(again, "certificate")} rescheduled`);
    return found;
  }
}

/** A meeting in words: two coordinates that pass each other, or a body that leaves its cell. */
export function meetingInWords(structure, done, { axis, one, other }, role) {
  const [passes, passed] = [one, other].map((each) => sideInWords(structure, done, each, axis));
  const [body, place] = one.body < 0 ? [passed, passes] : [passes, passed];
  if (role === "cell" && Math.min(one.body, other.body) < 0) return `${body} leaves its cell at ${place}`;
  return one.body < 0 ? `${body} passes ${place}` : `${passes} passes ${passed}`;
}

function replacement(role, { came, gone }) {
  if (came === gone) return `${counted(came, role)} replaced`;
  if (!gone) return `${counted(came, role)} new`;
  return came ? `${counted(gone, role)} replaced by ${NUMBERS[came] ?? came}` : `${counted(gone, role)} gone`;
}

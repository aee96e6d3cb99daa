// Several phases on one clock: the number of certificates that each has had to replace so far, and a comparison of their
// contacts. A digest of the contacts so far stands for each list; it is not the run's fingerprint, which covers all.

import { $, fill } from "./tables.mjs";
import { timeOf } from "../run/clock.mjs";
import { MET, firstDifference, inWords, momentOfEvent, withTime } from "../run/events.mjs";

const LATEST = 3; // named contacts

/** After each number of events, the number of contacts and their digest: the 32 bits of FNV-1a over whole numbers. */
export function digests({ count, kind, epoch, tick, a, b }) {
  const contacts = new Int32Array(count + 1);
  const digest = new Uint32Array(count + 1);
  digest[0] = 0x811c9dc5;
  for (let event = 0; event < count; event += 1) {
    const isContact = MET.has(kind[event]);
    let state = digest[event];
    const numbers = [epoch[event], Math.floor(tick[event] / 2 ** 32), tick[event], a[event], b[event]];
    if (isContact) for (const number of numbers) state = Math.imul(state ^ number, 0x01000193);
    digest[event + 1] = state;
    contacts[event + 1] = contacts[event] + (isContact ? 1 : 0);
  }
  return { contacts, digest };
}

export class Race {
  /** `place`: the element of the table; hidden with one run, and if runs were computed in the page. */
  constructor(place, player) {
    Object.assign(this, { place, player });
    place.hidden = player.runs.length < 2 || player.runs[0].isComputed;
    if (!place.hidden) this.lists = player.playback.runs.map(({ events }) => digests(events));
  }

  /** Shows the progress of each run at the present moment. */
  tell() {
    if (this.place.hidden) return;
    const { held, counts, playback: { runs } } = this.player;
    const most = Math.max(1, ...this.player.runs.map(({ steps }) => steps?.after.length ?? 0));
    const found = runs.map(({ done }, at) => [this.lists[at].contacts[done], this.lists[at].digest[done]]);
    const failed = runs.map(({ done }, at) => counts[at].before("structural", done));
    const rows = found.map(([contacts, digest], at) => [held.runs[at].label, failed[at], "", contacts, digest.toString(16).padStart(8, "0")]);
    fill($("work"), ["phase", "certificates failed", "", "contacts", "digest of them"], rows);
    failed.forEach((count, at) => {
      const bar = document.createElement("span");
      bar.style.width = `${(100 * count) / most}%`;
      $("work").rows[at + 1].cells[2].append(bar);
    });
    const [[many, first]] = found;
    const differs = found.findIndex(([contacts, digest]) => contacts !== many || digest !== first);
    $("same").textContent = differs < 0
      ? `The same ${many} contacts under all ${found.length} phases. ${this.latest()}`
      : this.difference(differs);
  }

  /** The first contact that differs between a run and the first run. */
  difference(which) {
    const { playback: { runs }, held } = this.player;
    const lists = [runs[0].events, runs[which].events];
    const found = firstDifference(...lists);
    if (!found) return "Events of one tick are being stepped one by one: not all phases are through them.";
    const { at, events } = found;
    const [one, other] = lists.map((list, side) => withTime(list, events[side], held));
    return `Contact ${at + 1} differs. Under ${held.runs[0].label}: ${one}. Under ${held.runs[which].label}: ${other}.`;
  }

  /** The latest contacts in words, the last one first. */
  latest() {
    const { playback: { runs: [{ events, done }] }, held } = this.player;
    const said = [];
    for (let event = done - 1; event >= 0 && said.length < LATEST; event -= 1) {
      if (!MET.has(events.kind[event])) continue;
      said.push(`${timeOf(momentOfEvent(events, event), held.start, held.unit).toFixed(4)} ${inWords(events, event, held)}`);
    }
    return said.length ? `Latest: ${said.join("; ")}.` : "";
  }
}

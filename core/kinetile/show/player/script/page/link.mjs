// The address of a moment: page.html#t=epoch:tick&body=number. Of several events in one tick, event=number is the
// count of all events that are done in the first run. page.html#try opens with *Try it* switched on.

import { TICKS, compare } from "../run/clock.mjs";
import { eventsAt, momentOfEvent } from "../run/events.mjs";

/** The part of an address, the # and what follows, that leads to what a player shows. */
export function linkOf({ playback, selected }) {
  const [{ events, done }] = playback.runs;
  const [epoch, tick] = playback.moment;
  const usual = compare(playback.moment, playback.begin) > 0 ? eventsAt(events, playback.moment) : 0;
  return `#t=${epoch}:${tick}${done === usual ? "" : `&event=${done}`}${selected === null ? "" : `&body=${selected}`}`;
}

/** What such a part says: {moment, event, body}, null for what it does not name; null if it names no moment. */
export function readLink(text) {
  const named = new URLSearchParams(text.slice(1));
  const number = (found) => (/^\d+$/.test(found ?? "") && Number.isSafeInteger(Number(found)) ? Number(found) : null);
  const moment = (named.get("t") ?? "").split(":").map(number);
  if (moment.length !== 2 || moment.includes(null) || moment[1] >= TICKS) return null;
  return { moment, event: number(named.get("event")), body: number(named.get("body")) };
}

/** Go where an address leads; an address without such a part, or of what is shown already, leads nowhere. */
export function followLink(player, text) {
  if (text === player.ownLink) return void (player.ownLink = null);
  if (text.length < 2 || text === linkOf(player)) return;
  if (text === "#try") return void (player.trial.on || player.trial.toggle());
  const { playback } = player;
  const found = readLink(text);
  const outside = found && (compare(found.moment, playback.begin) < 0 || compare(found.moment, playback.end) > 0);
  if (!found || outside) {
    player.say(`${text} is no moment of this page`);
    return;
  }
  const [{ events }] = playback.runs;
  const isThere = found.event > 0 && found.event <= events.count && compare(momentOfEvent(events, found.event - 1), found.moment) === 0;
  if (isThere) playback.jump(0, found.event - 1);
  else playback.seek(found.moment);
  player.select(found.body < player.bodies.x.length ? found.body : null);
  player.arrive();
}

/** Put the address of what a player shows into the clipboard and into the page's own address. */
export async function copyLink(player) {
  const link = linkOf(player);
  const { href } = location;
  const whole = href.startsWith("about:") ? link : href.split("#")[0] + link; // a notebook's page has no address
  try {
    if (location.hash !== link) player.ownLink = location.hash = link; // its event comes when time may have moved on
    await navigator.clipboard.writeText(whole);
    player.say(`the link to this moment${player.trial.recorded ? " of the recorded run" : ""} is copied`);
  } catch {
    player.say(`the browser copies nothing here; the link is ${whole}`);
  }
}

// The address of a moment: page.html#t=epoch:tick&body=number. If several events share a tick, event=number is the
// count of all events that are done in the first run. page.html#try opens with *Try it* switched on.

import { TICKS, compare } from "../run/clock.mjs";
import { eventsAt, momentOfEvent } from "../run/events.mjs";

/** The part of an address, from the # on, that leads to the present state of a player. */
export function linkOf({ playback, selected }) {
  const [{ events, done }] = playback.runs;
  const [epoch, tick] = playback.moment;
  const usual = compare(playback.moment, playback.begin) > 0 ? eventsAt(events, playback.moment) : 0;
  return `#t=${epoch}:${tick}${done === usual ? "" : `&event=${done}`}${selected === null ? "" : `&body=${selected}`}`;
}

/** Reads such a part: {moment, event, body}, null for each without a value; null if it has no moment. */
export function readLink(text) {
  const named = new URLSearchParams(text.slice(1));
  const number = (found) => (/^\d+$/.test(found ?? "") && Number.isSafeInteger(Number(found)) ? Number(found) : null);
  const moment = (named.get("t") ?? "").split(":").map(number);
  if (moment.length !== 2 || moment.includes(null) || moment[1] >= TICKS) return null;
  return { moment, event: number(named.get("event")), body: number(named.get("body")) };
}

/** Follows an address; an address without such a part, or of the present state, changes nothing. */
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

/** Puts the address of the present state into the clipboard and into the page's own address. */
export async function copyLink(player) {
  const link = linkOf(player);
  const { href } = location;
  const whole = href.startsWith("about:") ? link : href.split("#")[0] + link; // a notebook's page has no address
  try {
    if (location.hash !== link) player.ownLink = location.hash = link; // its event may be sent after time has moved on
    await navigator.clipboard.writeText(whole);
    player.say(`the link to this moment${player.trial.recorded ? " of the recorded run" : ""} is copied`);
  } catch {
    player.say(`the browser copies nothing here; the link is ${whole}`);
  }
}

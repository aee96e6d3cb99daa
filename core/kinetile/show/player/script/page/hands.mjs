// Input: keys, buttons, pointers; and the start of the page.

import { GROUPS } from "../run/events.mjs";
import { load } from "../run/playback.mjs";
import { copyLink, followLink } from "./link.mjs";
import { Player, readTheme } from "./player.mjs";
import { saveSvg } from "./svg.mjs";
import { $, legend } from "./tables.mjs";

/** A place in the window in pixels right of and above the middle of a canvas. */
function offset(canvas, [x, y]) {
  const box = canvas.getBoundingClientRect();
  return [x - box.left - box.width / 2, box.top + box.height / 2 - y];
}

const pointOf = (event) => [event.clientX, event.clientY];

const PAN = 60;

/** The action of each key; a capital letter or an arrow with Shift has "Shift " before it. */
const KEYS = {
  " ": (player) => player.toggle(),
  ArrowRight: (player) => player.step(1),
  ArrowLeft: (player) => player.step(-1),
  "Shift ArrowRight": (player) => player.step(1, true),
  "Shift ArrowLeft": (player) => player.step(-1, true),
  ArrowUp: (player) => player.hasten(2),
  ArrowDown: (player) => player.hasten(0.5),
  Home: (player) => player.seekFraction(-2, player.playback.moment),
  End: (player) => player.seekFraction(2, player.playback.moment),
  PageDown: (player) => player.seekFraction(0.05, player.playback.moment),
  PageUp: (player) => player.seekFraction(-0.05, player.playback.moment),
  e: (player) => setEven(player),
  n: (player) => player.selectNext(1),
  p: (player) => player.selectNext(-1),
  f: (player) => setFollow(player),
  c: (player) => player.lookAtEvent(),
  z: (player) => zoom(player, 2),
  x: (player) => zoom(player, 0.5),
  a: (player) => pan(player, -PAN, 0),
  d: (player) => pan(player, PAN, 0),
  w: (player) => pan(player, 0, PAN),
  s: (player) => pan(player, 0, -PAN),
  r: (player) => reset(player),
  t: (player) => setStructured(player),
  l: (player) => copyLink(player),
  v: (player) => saveSvg(player),
  y: (player) => player.trial.toggle(),
  b: (player) => player.trial.turnBack(),
  o: (player) => player.trial.reset(),
  Escape: (player) => leave(player),
  "?": () => help(),
};

function leave(player) {
  player.panes.forEach((canvas) => canvas.classList.remove("active"));
  player.select(null);
}

function help() {
  $("help").showModal();
  $("close").focus(); // the attribute autofocus is an error in a page within a page
}

function setEven(player) {
  player.evenly = !player.evenly;
  player.changed();
}

function setStructured(player) {
  if (!player.hasStructure) return player.say("there is no structure in this page");
  player.structured = !player.structured;
  player.say(player.structured ? "the structure is shown" : "the structure is hidden");
  return player.changed();
}

function setFollow(player) {
  player.follows = !player.follows && player.selected !== null;
  player.say(player.follows ? `the view follows body ${player.selected}` : "the view stands still");
  player.changed();
}

function zoom(player, factor, right = 0, up = 0) {
  player.camera.zoom(factor, right, up);
  player.changed();
}

function pan(player, right, up) {
  player.follows = false;
  player.camera.pan(right, up);
  player.changed();
}

function reset(player) {
  player.follows = false;
  player.fit();
  player.changed();
}

function setGroup(player, group) {
  player.group = group;
  $("group").value = group;
  player.say(`steps go to: ${group}`);
  player.changed();
}

function onKey(player, event) {
  if (event.ctrlKey || event.metaKey || event.altKey || $("help").open) return;
  const { tagName, type } = event.target;
  const typing = tagName === "SELECT" || (tagName === "INPUT" && type !== "checkbox");
  if (typing || (event.key === " " && ["BUTTON", "SUMMARY", "INPUT", "A"].includes(tagName))) return;
  if (event.key.length === 1 && !$("letters").checked) return;
  const groups = Object.keys(GROUPS);
  const number = Number.parseInt(event.key, 10) - 1;
  const plain = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const name = event.shiftKey && event.key.length > 1 ? `Shift ${plain}` : plain;
  const act = groups[number] ? () => setGroup(player, groups[number]) : KEYS[name];
  if (!act) return;
  event.preventDefault();
  act(player);
}

/**
 * Pointers: one drags, two zoom and move the view, a tap selects. A reader has to scroll the page past its pictures, and
 * past a player in it: so the wheel zooms with Ctrl, or after a click into the picture until the mouse leaves it, and a
 * finger that moves up or down scrolls (touch-action in page.css).
 */
function listen(player, canvas) {
  const fingers = new Map();
  let moved = 0;
  let before = {}; // the view before the first finger
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, pointOf(event));
    if (fingers.size === 1) before = { ...player.camera };
    moved = fingers.size > 1 ? 100 : 0;
    player.trial.pulled = null;
    if (fingers.size === 1 && event.button === 0) player.trial.grab(canvas, offset(canvas, pointOf(event)));
    if (event.pointerType !== "touch") canvas.classList.add("active");
  });
  canvas.addEventListener("pointerleave", () => {
    canvas.classList.remove("active");
    player.point(null);
  });
  canvas.addEventListener("pointermove", (event) => {
    const was = fingers.get(event.pointerId);
    if (!was) {
      if (player.playing) return;
      const at = offset(canvas, pointOf(event));
      canvas.title = player.lens.nameAt(canvas, at);
      player.point(player.bodyAt(canvas, at));
      return;
    }
    const now = pointOf(event);
    moved += Math.abs(now[0] - was[0]) + Math.abs(now[1] - was[1]);
    const other = [...fingers].find(([id]) => id !== event.pointerId)?.[1];
    fingers.set(event.pointerId, now);
    if (player.trial.pulled) {
      player.trial.pulled.to = offset(canvas, now);
      player.changed();
      return;
    }
    if (!other) {
      if (moved > 4) pan(player, was[0] - now[0], now[1] - was[1]);
      return;
    }
    const apart = (point) => Math.hypot(point[0] - other[0], point[1] - other[1]) || 1;
    const middle = [(now[0] + other[0]) / 2, (now[1] + other[1]) / 2];
    pan(player, (was[0] - now[0]) / 2, (now[1] - was[1]) / 2); // by the move of the middle of the two
    zoom(player, apart(now) / apart(was), ...offset(canvas, middle));
  });
  const lift = (event) => {
    if (event.type === "pointercancel" && fingers.size === 1) {
      Object.assign(player.camera, before); // the browser scrolls the page by this finger: the view stays
      player.changed();
    }
    const taps = fingers.delete(event.pointerId) && moved <= 4 && event.type === "pointerup";
    if (player.trial.pulled && moved > 4 && event.type === "pointerup") player.trial.release();
    player.trial.pulled = null;
    if (taps) player.pickAt(canvas, offset(canvas, pointOf(event)));
  };
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  for (const kind of ["touchstart", "touchmove"]) {
    canvas.addEventListener(kind, (event) => {
      if (event.touches.length > 1) event.preventDefault(); // two fingers move the view, in all directions
    }, { passive: false });
  }
  canvas.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.metaKey && !canvas.classList.contains("active")) return;
    event.preventDefault();
    zoom(player, 2 ** (-event.deltaY / 200), ...offset(canvas, pointOf(event)));
  }, { passive: false });
}

const SLOP = 16; // pixels: after at most 15 a browser decides that a finger scrolls, and sends pointercancel

/**
 * A pointer moves the present moment on a canvas: `fractionAt` is the fraction of the time, from pixels from the left and
 * the part of the height. A mouse does so at once; a finger when it is lifted, or when it moves sideways, if it `drags`.
 * A finger that moves up or down scrolls the page (touch-action in page.css), and the moment stays.
 */
function listenForMoments(player, canvas, fractionAt, drags) {
  const go = ({ clientX, clientY }) => {
    const { left, top, height } = canvas.getBoundingClientRect();
    player.seekFraction(fractionAt(clientX - left, (clientY - top) / height));
  };
  let from = null; // the start of a finger that may still scroll
  canvas.addEventListener("pointerdown", (event) => {
    if (drags) canvas.setPointerCapture(event.pointerId);
    from = event.pointerType === "touch" ? pointOf(event) : null;
    if (!from) go(event);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!event.buttons || !drags) return;
    const [aside, up] = pointOf(event).map((at, axis) => (from ? Math.abs(at - from[axis]) : 0));
    if (from && aside <= Math.max(up, SLOP)) return;
    from = null;
    go(event);
  });
  canvas.addEventListener("pointerup", (event) => {
    if (from) go(event);
    from = null;
  });
  canvas.addEventListener("pointercancel", () => {
    from = null;
  });
}

/** At first there are few controls: a button shows the others, and in a frame of another page the tables. */
function beginWithFew(player) {
  const { classList } = document.documentElement;
  classList.add("few");
  classList.toggle("within", window.parent !== window);
  $("more").hidden = false;
  $("more").addEventListener("click", () => {
    $("more").setAttribute("aria-expanded", String(classList.toggle("more")));
    player.changed();
  });
}

/** Starts the page: decodes its content, and connects the controls. */
export async function begin() {
  const held = JSON.parse($("recording").textContent);
  const player = new Player(held, await load(held));
  beginWithFew(player);
  window.kinetilePlayer = player; // for the browser's console
  player.panes.forEach((canvas) => listen(player, canvas));
  listenForMoments(player, $("timeline"), (right) => player.timeline.fraction(right), true);
  listenForMoments(player, $("spacetime"), (_, down) => player.spaceTime.timeAt(down), false);
  document.addEventListener("keydown", (event) => onKey(player, event));
  document.querySelectorAll("button[data-key]").forEach((button) => {
    button.addEventListener("click", () => KEYS[button.dataset.key](player));
  });
  $("group").addEventListener("change", (event) => setGroup(player, event.target.value));
  $("axis").addEventListener("change", (event) => {
    player.spaceTime.show(event.target.value);
    event.target.value = player.spaceTime.axis;
    player.changed();
  });
  $("engine").addEventListener("change", () => player.trial.fork(() => ""));
  $("goto").addEventListener("change", (event) => player.goTo(event.target.value));
  document.addEventListener("click", ({ target, detail }) => {
    if (detail && target.tagName === "BUTTON") target.blur(); // a click, not a key: Space has to play, not press again
  });
  const sizes = new ResizeObserver(() => player.resized());
  [...player.panes, $("timeline"), $("spacetime")].forEach((canvas) => sizes.observe(canvas));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    player.theme = readTheme();
    player.changed();
  });
  addEventListener("hashchange", () => followLink(player, location.hash));
  followLink(player, location.hash);
  legend(player);
  $("loading").hidden = true; // not removed: a saved copy of the present page needs it
  player.changed();
  const opensAt = held.open || held.select !== null || location.hash;
  if (!opensAt && !matchMedia("(prefers-reduced-motion: reduce)").matches) player.toggle();
  requestAnimationFrame(() => requestAnimationFrame(() => {
    document.documentElement.dataset.ready = String(Math.round(performance.now())); // milliseconds to the first picture
  }));
}

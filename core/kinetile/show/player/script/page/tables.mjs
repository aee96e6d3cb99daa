// Words and numbers beside the picture.

import { fractionOf, timeOf } from "../run/clock.mjs";
import { GROUPS, isOf, momentOfEvent, seek } from "../run/events.mjs";
import { SHAPES, plural } from "../run/structure.mjs";

/** An element of the page by its id. */
export const $ = (id) => document.getElementById(id);

/** The number of events of each group before an event, and in all. */
export function countUp(events) {
  const columns = {};
  const total = {};
  for (const group of Object.keys(GROUPS)) {
    const column = new Int32Array(events.count + 1);
    for (let event = 0; event < events.count; event += 1) {
      column[event + 1] = column[event] + (isOf(events, event, group) ? 1 : 0);
    }
    columns[group] = column;
    total[group] = column[events.count];
  }
  return { total, before: (group, event) => columns[group][event] };
}

/** The energy of the present movable bodies: kinetic, and with accelerations potential, which is 0 in the corner (0, 0). */
export function energy(motion) {
  const { bodies, plans } = motion;
  let sum = 0;
  for (let body = 0; body < plans.vx.length; body += 1) {
    if (!plans.there[body] || bodies.mass[body] === Infinity) continue;
    const twice = plans.vx[body] ** 2 + plans.vy[body] ** 2 - 2 * (plans.wx[body] * plans.x[body] + plans.wy[body] * plans.y[body]); // at its anchor
    sum += 0.5 * bodies.mass[body] * twice;
  }
  return sum;
}

/** Fills a table, with or without a head; the first cell of each row is its name. An empty cell of the head is plain. */
export function fill(table, head, rows) {
  const line = (row, isHead) => {
    const made = document.createElement("tr");
    made.append(...row.map((text, at) => {
      const isName = isHead ? text !== "" : at === 0;
      const cell = document.createElement(isName ? "th" : "td");
      cell.textContent = String(text);
      if (isName) cell.scope = isHead ? "col" : "row";
      return cell;
    }));
    return made;
  };
  const lines = rows.map((row) => line(row, false));
  table.replaceChildren(...(head ? [line(head, true), ...lines] : lines));
}

/** Shows the readings, the selected body, and the texts of the controls. */
export function tell(player) {
  const { playback, held } = player;
  const [epoch, tick] = playback.moment;
  $("time").textContent = String(Number(player.time().toPrecision(4)));
  $("exact").textContent = `${player.time()}: ${epoch} units and ${tick} ticks of 2^-52`;
  $("structure").hidden = !player.hasStructure;
  $("structural").hidden = !player.lanes.includes("structural");
  $("play").textContent = player.playing ? "Pause" : "Play";
  const pressed = { structure: player.structured, try: player.trial.on, even: player.evenly, follow: player.follows };
  for (const [button, isOn] of Object.entries(pressed)) $(button).setAttribute("aria-pressed", String(isOn));
  const [pace, what] = player.evenly ? [player.pace(), "events"] : [player.speed, "time units"];
  $("pace").textContent = `${Number(pace.toPrecision(2))} ${what} a second${player.bound()}`;
  const clock = $("timeline");
  clock.setAttribute("aria-valuenow", String(Math.round(1000 * fractionOf(playback.moment, playback.begin, playback.end))));
  clock.setAttribute("aria-valuetext", `time ${player.time()}`);
  const columns = playback.runs.map((run, at) => readings(player, run, at));
  const head = ["", ...held.runs.map((run) => run.label)];
  const names = [...new Set(columns.flatMap((column) => Object.keys(column)))];
  fill($("readings"), head, names.map((name) => [name, ...columns.map((column) => column[name] ?? "")]));
  player.bodyTable.tell();
}

function readings(player, run, at) {
  const { bodies, counts, lanes } = player;
  const event = player.playback.current(run);
  const found = { now: event < 0 ? player.between() : player.sentences[at].of(event) };
  const { steps } = player.runs[at];
  const structure = player.structureOf(run);
  const [next] = structure?.failing(run.done) ?? [];
  if (next !== undefined) {
    const fails = timeOf([structure.epoch[next], structure.tick[next]], player.held.start, player.held.unit);
    found["fails next"] = `${structure.roles[structure.role[next]]} at ${Number(fails.toPrecision(4))}`;
  }
  const pair = player.pair();
  if (pair && !pair.some((body) => bodies.outline[body])) found[`gap of ${pair.join(" and ")}`] = player.gap(run, ...pair).toExponential(3);
  found.events = run.done;
  for (const group of lanes) found[group] = counts[at].before(group, run.done);
  found.bodies = run.motion.plans.there.reduce((sum, there) => sum + there, 0);
  found[player.held.pull ? "energy" : "kinetic energy"] = energy(run.motion).toPrecision(9);
  if (run.done < steps?.queue.length) found.queue = steps.queue[run.done];
  Object.assign(found, structure?.counts(run.done));
  if (run.done > run.structure?.seen) found.structure = `recorded up to event ${run.structure.seen}${structure === run.structure ? "" : ", computed since"}`;
  return found;
}

const MOST_SEEN = 100; // events before and after the present one in the list

/** The selected body in words: its plan and its pairs; and its events, or all, as buttons that go there. */
export class BodyTable {
  constructor(player) {
    this.player = player;
    this.buttons = [];
    $("contacts").replaceChildren(); // a saved copy of a page has buttons already
  }

  tell() {
    const { playback, selected: body, held, bodies } = this.player;
    const [run] = playback.runs;
    $("body").hidden = body === null;
    $("events-head").textContent = body === null ? "Events" : `Events of body ${body}`;
    this.#events(run, body);
    if (body === null) return;
    const { plans } = run.motion;
    const [[x, y], [vx, vy]] = [run.motion.place(body, playback.moment), run.motion.velocity(body, playback.moment)];
    $("body-name").textContent = `Body ${body}`;
    const anchored = timeOf([plans.epoch[body], plans.tick[body]], held.start, held.unit);
    const partners = this.player.structureOf(run)?.partners(run.done, body) ?? [];
    fill($("plan"), null, plans.there[body] ? [
      ["place", `${x}, ${y}`],
      ["velocity", `${vx}, ${vy}`],
      ...(held.pull ? [["acceleration", `${plans.ax[body]}, ${plans.ay[body]}`]] : []),
      ["anchor", `${plans.x[body]}, ${plans.y[body]} at ${anchored}`],
      ["pairs drawn", partners.length ? `with ${partners.join(", ")}` : held.pairs ? "none" : "left out"],
      bodies.outline[body]
        ? ["shape, mass", `${held.shapes[held.shape[body]].words}, ${bodies.mass[body]}`]
        : ["radius, mass", `${bodies.radius[body]}, ${bodies.mass[body]}`],
    ] : [["", "it is not there now"]]);
  }

  /** The last events and the next ones, of a body unless that is null; alike ones that follow each other are one line. */
  #events(run, body) {
    const lines = [];
    const group = body === null ? this.player.group : "all";
    const told = (event) => ({ text: this.player.sentences[0].of(event), events: [event] });
    let event = seek(run.events, run.done, -1, group, body);
    for (let seen = 0; event >= 0 && seen < MOST_SEEN; event = seek(run.events, event, -1, group, body), seen += 1) {
      const line = told(event);
      if (line.text === lines[0]?.text) lines[0].events.unshift(event);
      else if (lines.length === 3) break;
      else lines.unshift(line);
    }
    event = seek(run.events, run.done, 1, group, body);
    const past = lines.length;
    for (let seen = 0; event >= 0 && seen < MOST_SEEN; event = seek(run.events, event + 1, 1, group, body), seen += 1) {
      const line = told(event);
      if (lines.length > past && line.text === lines.at(-1).text) lines.at(-1).events.push(event);
      else if (lines.length === 8) break;
      else lines.push(line);
    }
    while (this.buttons.length < lines.length) this.#add();
    this.buttons.forEach(({ item, button }, at) => {
      item.hidden = at >= lines.length;
      if (item.hidden) return;
      const { text, events: [first, ...others] } = lines[at];
      const time = (of) => Number(timeOf(momentOfEvent(run.events, of), this.player.held.start, this.player.held.unit).toPrecision(4));
      button.event = first;
      const many = others.length ? `, ${others.length + 1} times until ${time(others.at(-1))}` : "";
      button.textContent = `${time(first)}: ${text}${many}`;
      if (lines[at].events.includes(this.player.playback.current(run))) button.setAttribute("aria-current", "true");
      else button.removeAttribute("aria-current");
    });
  }

  #add() {
    const item = document.createElement("li");
    const button = document.createElement("button");
    button.addEventListener("click", () => this.player.jump(button.event));
    item.append(button);
    this.buttons.push({ item, button });
    $("contacts").append(item);
  }
}

/** A line of the legend as a switch: it shows or hides the shapes of its role. */
function layer(line, role, player) {
  const button = document.createElement("button");
  button.append(...line.childNodes);
  button.setAttribute("aria-pressed", String(!player.hidden.has(role)));
  button.addEventListener("click", () => {
    const shown = player.hidden.delete(role) || !player.hidden.add(role);
    button.setAttribute("aria-pressed", String(shown));
    player.say(`${plural(role)} are ${shown ? "shown" : "hidden"}`);
    player.changed();
  });
  line.append(button);
  return line;
}

const EVENTS = {
  contacts: "two bodies meet",
  structural: "a certificate of the broad phase fails",
  walls: "a body meets a wall",
  commands: "a body turns, moves, is accelerated, changes its kind, comes or goes",
  passings: "two bodies begin or end to pass through each other",
};

/** The legend of colours; a swatch of the structure is drawn like the structure. */
export function legend(player) {
  const item = (style, text) => {
    const line = document.createElement("li");
    const mark = document.createElement("span");
    Object.assign(mark.style, style);
    line.append(mark, text);
    return line;
  };
  const swatch = (look, isLine) => {
    const line = `${Math.max(look.width, 1)}px ${look.dashes.length ? "dashed" : "solid"} ${look.colour}`;
    const alpha = Math.round(255 * look.filled).toString(16).padStart(2, "0");
    return isLine ? { height: "0", border: "0", borderTop: line, verticalAlign: "0.25rem" } : { border: line, background: look.colour + alpha };
  };
  const events = player.lanes.map((group) => item({ background: `var(--${group})`, width: "0.3rem", marginLeft: "0.35rem", marginRight: "0.85rem" }, `${group}: ${EVENTS[group]}`));
  const { kinds: names, responses, colours, pace } = player.held;
  if (!names.length) events.push(item({ background: `linear-gradient(90deg, ${colours.speeds.join()})`, width: "4rem" }, `speed 0 to ${Number(pace.toPrecision(2))} and more`));
  names.forEach((name, kind) => {
    events.push(item({ background: colours.kinds[kind % colours.kinds.length], border: "1px solid var(--line)" }, `kind ${name}`));
    responses[kind]?.forEach((response, other) => {
      const whom = names[other] ?? "walls";
      if ((other >= kind) && response !== "elastic") events.push(item({}, `${name} and ${whom}: ${response}`));
    });
  });
  const drawn = player.playback.runs.map((run) => run.structure ?? player.structureOf(run)).filter(Boolean);
  const shapesOf = (role) => drawn.flatMap((each) => [...each.shape].filter((_, shape) => each.roles[each.role[shape]] === role));
  const shapes = [];
  for (const [role, look] of Object.entries(player.held.looks)) {
    const kinds = new Set(shapesOf(role).map((kind) => SHAPES[kind]));
    if (kinds.size) shapes.push(layer(item(swatch(look, !kinds.has("box") && !kinds.has("polygon")), role), role, player));
  }
  if (shapes.length) {
    shapes.push(item(swatch(player.held.fresh, false), "has come with the last event"));
    shapes.push(item(swatch(player.held.next, false), "fails next"));
  }
  const labels = player.held.runs.map((run) => run.label);
  if (labels.length > 1) events.push(item({}, `in each lane, from above: ${labels.join(", ")}`));
  $("legend").replaceChildren(...events);
  $("legend-structure").replaceChildren(...shapes);
  $("legend-structure-head").hidden = !shapes.length;
}

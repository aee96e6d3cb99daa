// Rules 11 and 9r: the response for two kinds, or for a kind and the walls, and the velocities after restitution and stop.

import { keys, list, number } from "./tables.js";

const ELASTIC = { name: "elastic" };
const NAMES = ["elastic", "restitution", "stop", "pass"];
export const OUTWARD = { [-1]: [-1, 0], [-2]: [1, 0], [-3]: [0, -1], [-4]: [0, 1] };

export function readKind(kind, name) {
  if (typeof kind !== "string" && !Number.isInteger(kind)) throw new Error(`${name} is ${JSON.stringify(kind)}, no kind.`);
  return kind;
}

/** The rules of these tables: each {between, name}, and for restitution e, t, its contact time, and w, g, its surface and its one way, 0 or none by default. A rule without `between` is for all bodies and walls, but pass only for bodies. */
export function readResponses(tables) {
  return tables.flatMap((table, i) => {
    const at = `responses[${i}]`;
    keys(table, ["between", "response", "options"], at);
    const name = table.response;
    if (!NAMES.includes(name)) throw new Error(`${at}.response is ${JSON.stringify(name)}, not ${NAMES.join(", ")}.`);
    const forAll = name === "pass" ? [["*", "*"]] : [["*", "*"], ["*", "wall"]];
    const named = table.between === undefined ? forAll : [list(table.between, `${at}.between`)];
    const pairs = named.map((between) => between.map((kind) => readKind(kind, `${at}.between`)));
    if ((name === "pass" || table.options?.one_way) && pairs[0].includes("wall")) throw new Error(`${at}: walls cannot be passed.`);
    if (name !== "restitution") return pairs.map((between) => ({ between, name }));
    keys(table.options ?? {}, ["e", "contact_time", "settle", "grip", "surface", "one_way"], `${at}.options`);
    const { e, contact_time, settle, grip, surface, one_way } = table.options ?? {};
    const w = number(settle ?? 0, `${at}.options.settle`);
    const g = number(grip ?? 0, `${at}.options.grip`);
    if (!(g >= 0 && g <= 1)) throw new Error(`${at}.options.grip is ${g}, not from 0 to 1.`);
    if (!(e >= 0 && e <= 1)) throw new Error(`${at}.options.e is ${e}, not from 0 to 1.`);
    const numbers = { e: number(e, `${at}.options.e`), t: number(contact_time ?? 0, `${at}.options.contact_time`), w, g, surface: (surface ?? [0, 0]).map((each) => number(each, `${at}.options.surface`)) };
    const way = one_way?.map((each) => number(each, `${at}.options.one_way`)) ?? null;
    return (way ? pairs.slice(0, 1) : pairs).map((between) => ({ between, name, way, ...numbers }));
  });
}

/** The lowest kind that these rules name: whole numbers are before names, and names in the order of their code points. */
export function lowestKind(rules) {
  const named = rules.flatMap(({ between }) => between).filter((kind) => kind !== "*" && kind !== "wall");
  const key = (kind) => (typeof kind === "number" ? [0, kind] : [1, ...Array.from(kind, (each) => each.codePointAt(0))]);
  const isLower = (a, b, i = 0) => (a[i] === b[i] && i < a.length ? isLower(a, b, i + 1) : i === a.length || a[i] < b[i]);
  return named.reduce((low, kind) => (low === undefined || isLower(key(kind), key(low)) ? kind : low), undefined);
}

/** The response for two kinds. */
export function pairResponse(rules, one, two) {
  return said(rules, one, two) ?? said(rules, one, "*") ?? said(rules, two, "*") ?? said(rules, "*", "*") ?? ELASTIC;
}

/** True if two with a response may pass (rules 11 and 11w). */
export function mayPass({ name, way = null }) {
  return name === "pass" || way !== null;
}

/** True if two that may pass do so when they meet with this normal from a to b (rule 11w). */
export function goThrough({ way = null }, a, b, [nx, ny]) {
  if (way === null || (a.m === Infinity) === (b.m === Infinity)) return true;
  const side = nx * way[0] + ny * way[1];
  return !(a.m === Infinity ? side > 0 : side < 0);
}

/** The response for a kind and the walls. */
export function wallResponse(rules, kind) {
  return said(rules, kind, "wall") ?? said(rules, "*", "wall") ?? ELASTIC;
}

function said(rules, one, two) {
  return rules.find(({ between: [k, l] }) => (k === one && l === two) || (k === two && l === one));
}

/** The k of a response `since` the last contact: the share of the closing speed that comes back. */
export function returned({ name, e, t }, since) {
  return name !== "restitution" || since <= t ? 1 : e;
}

/** The same for a response that stops, or null if it brings bodies to rest; `accelerated`: with accelerations (rule 11h). */
export function softened(since, q, accelerated) {
  return accelerated && since <= 2 ** 37 * q ? 0 : null;
}

/** The velocity [vx, vy] of a body after it has met a wall. */
export function offWall({ vx, vy }, wall, response, k) {
  if (k === null) return [0, 0];
  const [nx, ny] = OUTWARD[wall];
  if (response.name === "elastic") return [nx === 0 ? vx : -vx, ny === 0 ? vy : -vy];
  const w = (1 + k) * (vx * nx + vy * ny);
  return [vx - w * nx, vy - w * ny];
}

/** The velocities [vxa, vya, vxb, vyb] of two bodies that stop. */
export function stopped(a, b, ma, mb) {
  const { vx, vy } = ma === mb || (ma < Infinity && mb < Infinity) ? { vx: 0, vy: 0 } : ma === Infinity ? a : b;
  return [vx, vy, vx, vy];
}

// Signs of polynomials at whole numbers, which decide the rules.
//
// A polynomial is the list of its coefficients, BigInts, from n^0 on, up to a common factor. Between two zeros of its derivative it is monotone.

import { add, dot, multiply, sign, squareRoot, subtract } from "./exact.js";

export const FAR = 1n << 62n;
const TWO = { n: 1n, e: 1 };

/** The polynomial of exact coefficients. */
export function polynomial(numbers) {
  const lowest = Math.min(...numbers.map(({ n, e }) => (n === 0n ? Infinity : e)));
  const p = numbers.map(({ n, e }) => (n === 0n ? 0n : n << BigInt(e - lowest)));
  while (p.at(-1) === 0n) p.pop();
  return p;
}

/** The polynomial |d + step n + bend n^2|^2 - c. */
export function squareLess([d, step, bend], c) {
  const twice = (one, other) => multiply(TWO, dot(one, other));
  return polynomial([subtract(dot(d, d), c), twice(d, step), add(dot(step, step), twice(d, bend)), twice(step, bend), dot(bend, bend)]);
}

export function at(p, n) {
  return p.reduceRight((value, each) => value * n + each, 0n);
}

/** p(n + 1) - p(n). */
export function growth(p) {
  const next = [...p];
  p.forEach((_, i) => {
    for (let j = p.length - 2; j >= i; j -= 1) next[j] += next[j + 1];
  });
  return next.slice(0, -1).map((each, i) => each - p[i]);
}

/** True if p, which grows by `grows`, is on a side of 0 at n + 1, farther than at n. */
export function goes(side, p, grows, n) {
  return sign({ n: at(p, n + 1n) }) === side && sign({ n: at(grows, n) }) === side;
}

/** The first n from 0 on with p(n + 1) < min(0, p(n)). */
export function firstFall(p) {
  const grows = growth(p);
  return firstWhere((n) => goes(-1, p, grows, n), [p, grows], 0n);
}

/** The first n from `start` on, before `end`, with `holds(n)`, which depends only on the signs of some polynomials at n and at n + 1. */
export function firstWhere(holds, polynomials, start, end = FAR) {
  const changes = polynomials.flatMap((p) => signChanges(p, start, end));
  const every = [start, ...changes.flatMap((n) => [n - 1n, n])].filter((n) => n >= start && n < end);
  return every.sort(inOrder).find(holds) ?? null;
}

export function inOrder(one, two) {
  return one < two ? -1 : one > two ? 1 : 0;
}

/** Each n after `start`, up to `end`, with another sign of p than at n - 1. */
export function signChanges(p, start, end = FAR) {
  const signAt = (n) => sign({ n: at(p, n) });
  return pieces(p, start, end).flatMap((high, i, ends) => {
    const [low, here, there] = [ends[i - 1] ?? high, signAt(ends[i - 1] ?? high), signAt(high)];
    if (here === there) return [];
    return [(n) => signAt(n) !== here, (n) => signAt(n) === there].map((holds) => lastBefore(holds, low, high, p) + 1n);
  });
}

/** Whole numbers from `start` to `end`, in their order: between two neighbours p is monotone, or their difference is 1. */
function pieces(p, start, end) {
  if (p.length < 3 || start >= end) return start < end ? [start, end] : [];
  const derivative = p.slice(1).map((each, i) => each * BigInt(i + 1));
  const ends = pieces(derivative, start, end);
  const zeros = ends.flatMap((high, i) => {
    const low = ends[i - 1] ?? high;
    const [here, there] = [at(derivative, low), at(derivative, high)];
    if (here === 0n || there === 0n || here > 0n === there > 0n) return [high];
    const last = lastBefore((n) => here > 0n !== at(derivative, n) > 0n || at(derivative, n) === 0n, low, high, derivative);
    return [last, last + 1n, high];
  });
  return zeros.filter((each, i) => i === 0 || each > zeros[i - 1]);
}

/** The last whole number before the first with `holds(n)`, which is true from there to `high`, false at `low`, and changes near a zero of p. */
function lastBefore(holds, low, high, p) {
  const narrow = (n) => {
    if (low < n && n < high) [low, high] = holds(n) ? [low, n] : [n, high];
  };
  for (const zero of roughZeros(p)) for (const n of [0n, 1n, -1n, 2n]) narrow(zero + n);
  while (high - low > 1n) narrow((low + high) >> 1n);
  return low;
}

/** Whole numbers near the zeros of a polynomial of degree 1 or 2, else []: guesses, which its signs there confirm. */
function roughZeros([c, b, a, ...more]) {
  if (more.length || b === undefined) return [];
  if (a === undefined) return [-c / b];
  const square = b * b - 4n * a * c;
  if (square < 0n) return [];
  return [-1n, 1n].map((side) => (side * squareRoot(square) - b) / (2n * a));
}

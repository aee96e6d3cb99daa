// Rule 1: exact numbers.
//
// Every double is a whole number times a power of two, and sums, differences and products of such numbers are again such numbers. So an
// exact number is {n, e}, worth n * 2^e, with n a BigInt and e an ordinary integer. Only quotients leave this set, and the rules need
// only a whole number near them. A vector is a pair of exact numbers.

const FRACTION = (1n << 52n) - 1n;
const view = new DataView(new ArrayBuffer(8));

/** A finite double as an exact number. */
export function exact(double) {
  view.setFloat64(0, double);
  const bits = view.getBigUint64(0);
  const power = Number((bits >> 52n) & 2047n);
  const fraction = bits & FRACTION;
  if (power === 2047) throw new Error(`${double} is no finite number`);
  const n = power === 0 ? fraction : fraction | (1n << 52n);
  return { n: bits >> 63n ? -n : n, e: Math.max(power, 1) - 1075 };
}

/** A whole number as an exact number. */
export function whole(n) {
  return { n, e: 0 };
}

export function add(a, b) {
  if (a.n === 0n || b.n === 0n) return a.n === 0n ? b : a;
  if (a.e === b.e) return { n: a.n + b.n, e: a.e };
  return a.e > b.e ? { n: at(a, b.e) + b.n, e: b.e } : { n: a.n + at(b, a.e), e: a.e };
}

export function minus(a) {
  return { n: -a.n, e: a.e };
}

export function subtract(a, b) {
  return add(a, minus(b));
}

export function multiply(a, b) {
  return { n: a.n * b.n, e: a.e + b.e };
}

export function square(a) {
  return multiply(a, a);
}

/** The square with the sign of a: it grows with a. */
export function signedSquare(a) {
  return sign(a) < 0 ? minus(square(a)) : square(a);
}

export function compare(a, b) {
  return sign(subtract(a, b));
}

/** -1, 0 or 1. */
export function sign(a) {
  return a.n > 0n ? 1 : a.n < 0n ? -1 : 0;
}

/** The nearest double, ties to even. */
export function nearest(a) {
  const size = a.n < 0n ? -a.n : a.n;
  if (size === 0n) return 0;
  let last = Math.max(length(size) + a.e - 53, -1074); // the power of two of the double's last place
  let n = last > a.e ? halfToEven(size, BigInt(last - a.e)) : size << BigInt(a.e - last);
  if (n >> 53n) [n, last] = [n >> 1n, last + 1]; // rounded up to 2^53
  if (last > 971) return a.n < 0n ? -Infinity : Infinity;
  const power = n >> 52n ? BigInt(last + 1075) : 0n;
  view.setBigUint64(0, ((a.n < 0n ? 1n : 0n) << 63n) | (power << 52n) | (n & FRACTION));
  return view.getFloat64(0);
}

/** floor(a / b), for b > 0. */
export function floorQuotient(a, b) {
  const e = Math.min(a.e, b.e);
  return floorDivide(at(a, e), at(b, e));
}

/** The whole number nearest to a / b, the even one if there are two, for b > 0. */
export function nearestQuotient(a, b) {
  const e = Math.min(a.e, b.e);
  const [twice, whole] = [2n * at(a, e), 2n * at(b, e)];
  const up = floorDivide(twice + at(b, e), whole);
  return up * whole === twice + at(b, e) && up & 1n ? up - 1n : up;
}

export function dot([x1, y1], [x2, y2]) {
  return add(multiply(x1, x2), multiply(y1, y2));
}

export function less([x1, y1], [x2, y2]) {
  return [subtract(x1, x2), subtract(y1, y2)];
}

/** The whole number that `a` is in units of 2^e, for e <= a.e. */
function at(a, e) {
  return a.n << BigInt(a.e - e);
}

function floorDivide(a, b) {
  const quotient = a / b; // towards zero
  return a < 0n && quotient * b !== a ? quotient - 1n : quotient;
}

/** floor(sqrt(n)), by Newton's iteration from above. */
export function squareRoot(n) {
  if (n === 0n) return 0n;
  let root = 1n << BigInt((length(n) + 1) >> 1);
  for (;;) {
    const next = (root + n / root) >> 1n;
    if (next >= root) return root;
    root = next;
  }
}

function halfToEven(n, bits) {
  const kept = n >> bits;
  const rest = n - (kept << bits);
  const half = 1n << (bits - 1n);
  return rest > half || (rest === half && kept & 1n) ? kept + 1n : kept;
}

function length(n) {
  const digits = n.toString(16);
  return 4 * (digits.length - 1) + (32 - Math.clz32(parseInt(digits[0], 16)));
}

// Parts of doubles: the rounding error of a sum or a product, and a double as a whole number and a power of two.

const SPLITTER = 134217729; // 2^27 + 1

/** a + b as a double and its rounding error: together exact. */
export function twoSum(a, b) {
  const sum = a + b;
  const part = sum - a;
  return [sum, (a - (sum - part)) + (b - part)];
}

/** a * b as a double and its rounding error: together exact (no overflow, no underflow). */
export function twoProduct(a, b) {
  const product = a * b;
  const [highA, lowA] = halves(a);
  const [highB, lowB] = halves(b);
  return [product, lowA * lowB - (product - highA * highB - lowA * highB - highA * lowB)];
}

function halves(number) {
  const far = SPLITTER * number;
  const high = far - (far - number);
  return [high, number - high];
}

/** A finite double as [whole, exponent]: whole * 2^exponent, whole a BigInt. */
export function parts(number) {
  const view = new DataView(new ArrayBuffer(8));
  view.setFloat64(0, number);
  const bits = view.getBigUint64(0);
  const exponent = Number((bits >> 52n) & 0x7ffn);
  const fraction = bits & 0xfffffffffffffn;
  const whole = exponent ? fraction | 0x10000000000000n : fraction;
  return [bits >> 63n ? -whole : whole, (exponent || 1) - 1075];
}

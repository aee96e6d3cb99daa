// SHA-256 (FIPS 180-4), of bytes, in hexadecimal digits. Its constants are the first 32 bits behind the point of the square and cube roots
// of the first primes; they are computed here with whole numbers.

const PRIMES = [];
for (let n = 2; PRIMES.length < 64; n += 1) if (PRIMES.every((p) => n % p)) PRIMES.push(n);
const ROUND = PRIMES.map((p) => rootFraction(p, 3));
const START = PRIMES.slice(0, 8).map((p) => rootFraction(p, 2));

export function sha256(bytes) {
  const padded = new DataView(new ArrayBuffer(64 * Math.ceil((bytes.length + 9) / 64)));
  bytes.forEach((byte, i) => padded.setUint8(i, byte));
  padded.setUint8(bytes.length, 0x80);
  padded.setBigUint64(padded.byteLength - 8, 8n * BigInt(bytes.length));
  let state = START;
  for (let block = 0; block < padded.byteLength; block += 64) state = compress(state, padded, block);
  return state.map((word) => word.toString(16).padStart(8, "0")).join("");
}

function compress(state, bytes, block) {
  const w = [];
  for (let i = 0; i < 16; i += 1) w.push(bytes.getUint32(block + 4 * i));
  for (let i = 16; i < 64; i += 1) {
    const s0 = turn(w[i - 15], 7) ^ turn(w[i - 15], 18) ^ (w[i - 15] >>> 3);
    const s1 = turn(w[i - 2], 17) ^ turn(w[i - 2], 19) ^ (w[i - 2] >>> 10);
    w.push((w[i - 16] + s0 + w[i - 7] + s1) >>> 0);
  }
  let [a, b, c, d, e, f, g, h] = state;
  for (let i = 0; i < 64; i += 1) {
    const s1 = turn(e, 6) ^ turn(e, 11) ^ turn(e, 25);
    const one = h + s1 + ((e & f) ^ (~e & g)) + ROUND[i] + w[i];
    const s0 = turn(a, 2) ^ turn(a, 13) ^ turn(a, 22);
    const two = s0 + ((a & b) ^ (a & c) ^ (b & c));
    [a, b, c, d, e, f, g, h] = [(one + two) >>> 0, a, b, c, (d + one) >>> 0, e, f, g];
  }
  return [a, b, c, d, e, f, g, h].map((word, i) => (word + state[i]) >>> 0);
}

function turn(word, bits) {
  return (word >>> bits) | (word << (32 - bits));
}

/** The first 32 bits behind the point of the square (2) or cube (3) root of p. */
function rootFraction(p, degree) {
  const target = BigInt(p) << BigInt(32 * degree);
  let root = 0n;
  for (let bit = 1n << 40n; bit; bit >>= 1n) if ((root + bit) ** BigInt(degree) <= target) root += bit;
  return Number(root & 0xffffffffn);
}

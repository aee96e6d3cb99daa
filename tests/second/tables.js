// The permitted values of a table in a scene file. A mistake becomes a sentence.

export function keys(table, known, name) {
  if (typeof table !== "object" || table === null || Array.isArray(table)) throw new Error(`${name} is no table.`);
  const unknown = Object.keys(table).filter((key) => !known.includes(key));
  if (unknown.length) throw new Error(`${name} has an unknown key: ${unknown[0]}.`);
}

export function list(value, name) {
  if (!Array.isArray(value)) throw new Error(`${name} is no list.`);
  return value;
}

export function pair(value, name) {
  if (list(value, name).length !== 2) throw new Error(`${name} has ${value.length} numbers, not two.`);
  return value.map((each) => number(each, name));
}

export function positive(value, name) {
  if (!(number(value, name) > 0)) throw new Error(`${name} is ${value}, not above 0.`);
  return value;
}

export function number(value, name) {
  if (value === undefined) throw new Error(`${name} is missing.`);
  if (typeof value !== "number" || !Number.isFinite(value)) throw new Error(`${name} is ${JSON.stringify(value)}, no finite number.`);
  return value;
}

/** A mass, which may be infinite; 1 if it is left out. */
export function mass(value, name) {
  return value === "inf" ? Infinity : positive(value ?? 1, name);
}

/** A whole number from 0 on. */
export function count(value, name) {
  if (!Number.isInteger(number(value, name)) || value < 0) throw new Error(`${name} is ${value}, no whole number from 0 on.`);
  return value;
}

/** A moment, [epoch, tick, contacts]: {tick, contacts}, with the tick as a BigInt that counts from the start. */
export function moment(value, name) {
  if (list(value, name).length !== 3) throw new Error(`${name} has ${value.length} numbers, not three.`);
  const [epoch, tick, contacts] = value.map((each) => count(each, name));
  return { tick: (BigInt(epoch) << 52n) + BigInt(tick), contacts };
}

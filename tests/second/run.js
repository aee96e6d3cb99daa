// node run.js SCENE.json [--until T]: the contacts of a scene, a line each, and their fingerprint.

import { readFileSync } from "node:fs";

import { contacts, fingerprint } from "./answer.js";
import { readScene } from "./scene.js";

const USE = "node run.js SCENE.json [--until T]";

function main(words) {
  const told = words.indexOf("--until");
  const [, until] = told < 0 ? [] : words.splice(told, 2);
  if (words.length !== 1 || words[0].startsWith("--")) throw new Error(`Say ${USE}.`);
  if (told >= 0 && !isNumber(until)) throw new Error(`--until is followed by a time, not by ${until ?? "nothing"}.`);
  const scene = readScene(JSON.parse(readFileSync(words[0], "utf8")));
  const end = told < 0 ? scene.until : Number(until);
  if (end === null) throw new Error("The scene says no `until`; say --until T.");
  const list = [];
  for (const contact of contacts(scene, end)) {
    list.push(contact);
    process.stdout.write(`${contact.epoch} ${contact.tick} ${contact.a} ${contact.b}\n`);
  }
  process.stdout.write(`fingerprint ${fingerprint(list)}\n`);
}

function isNumber(text) {
  return text !== undefined && text.trim() !== "" && Number.isFinite(Number(text));
}

try {
  main(process.argv.slice(2));
} catch (error) {
  process.stderr.write(`${error.message}\n`);
  process.exitCode = 1;
}

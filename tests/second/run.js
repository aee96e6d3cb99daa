// node run.js SCENE.json [--until T] [--contacts N]: the contacts of a scene, or the first N, a line each, an early end of the answer, and their fingerprint.

import { readFileSync } from "node:fs";

import { contacts, fingerprint, Run } from "./answer.js";
import { readScene } from "./scene.js";

const USE = "node run.js SCENE.json [--until T] [--contacts N]";

function main(words) {
  const until = option(words, "--until");
  const most = option(words, "--contacts") ?? Infinity;
  if (words.length !== 1 || words[0].startsWith("--")) throw new Error(`Say ${USE}.`);
  const scene = readScene(JSON.parse(readFileSync(words[0], "utf8")));
  if ((until ?? scene.until ?? scene.end) === null) throw new Error("The scene says no `until`; say --until T.");
  const run = new Run(scene);
  const list = [];
  for (const contact of contacts(run, until)) {
    list.push(contact);
    process.stdout.write(`${contact.epoch} ${contact.tick} ${contact.a} ${contact.b}\n`);
    if (list.length >= most) break;
  }
  if (run.ended !== null && run.ended !== "end") process.stdout.write(`${run.ended}\n`);
  process.stdout.write(`fingerprint ${fingerprint(list)}\n`);
}

/** The number after a word, both removed from the words, or null without the word. */
function option(words, word) {
  const at = words.indexOf(word);
  if (at < 0) return null;
  const [, text] = words.splice(at, 2);
  if (text === undefined || text.trim() === "" || !Number.isFinite(Number(text))) {
    throw new Error(`${word} is followed by a number, not by ${text ?? "nothing"}.`);
  }
  return Number(text);
}

try {
  main(process.argv.slice(2));
} catch (error) {
  process.stderr.write(`${error.message}\n`);
  process.exitCode = 1;
}

// node pipe.js: a line of JSON with a scene in, a line with its contacts out, for `kinetile conform --command "node pipe.js"`.

import { createInterface } from "node:readline";

import { contacts, Run } from "./answer.js";
import { readScene } from "./scene.js";

function answer(line) {
  let run;
  try {
    run = new Run(readScene(JSON.parse(line)));
  } catch (error) {
    return { refused: error.message };
  }
  const list = Array.from(contacts(run), ({ epoch, tick, a, b }) => [Number(epoch), Number(tick), a, b]);
  return run.ended === "jam" ? { refused: "Bodies meet without end at one tick." } : { contacts: list };
}

for await (const line of createInterface({ input: process.stdin })) process.stdout.write(`${JSON.stringify(answer(line))}\n`);

// node pipe.js: a line of JSON with a scene in, a line with its contacts out, as `kinetile conform --command "node pipe.js"` asks for.

import { createInterface } from "node:readline";

import { contacts } from "./answer.js";
import { readScene } from "./scene.js";

function answer(line) {
  let scene;
  try {
    scene = readScene(JSON.parse(line));
  } catch (error) {
    return { refused: error.message };
  }
  return { contacts: Array.from(contacts(scene, scene.until), ({ epoch, tick, a, b }) => [Number(epoch), Number(tick), a, b]) };
}

for await (const line of createInterface({ input: process.stdin })) process.stdout.write(`${JSON.stringify(answer(line))}\n`);

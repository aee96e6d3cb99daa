// The script of a page under node, with just enough of a document to press every key and button. Prints what
// came of it as JSON. Usage: node player_dom.mjs PAGE.html
import { readFileSync } from "node:fs";

const html = readFileSync(process.argv[2], "utf8");
const held = html.match(/<script type="application\/json" id="recording">([\s\S]*?)<\/script>/)[1];
const script = html.match(/<script type="module">([\s\S]*?)<\/script>/)[1];
const drawn = {};
const pen = new Proxy({}, {
  get: (own, name) => own[name] ?? ((...numbers) => {
    drawn[name] = (drawn[name] ?? 0) + 1;
    if (numbers.some(Number.isNaN)) throw new Error(`${name}(${numbers})`);
    return { width: 40 };
  }),
});

class Element {
  constructor(tagName = "DIV", attributes = {}) {
    Object.assign(this, { tagName, attributes, children: [], listeners: {}, style: {}, value: "", clientWidth: 800, clientHeight: 500 });
    this.dataset = "data-key" in attributes ? { key: attributes["data-key"] } : {};
    this.checked = true;
    this.style = {};
    const names = new Set();
    this.classList = { add: (name) => names.add(name), remove: (name) => names.delete(name), contains: (name) => names.has(name),
      toggle: (name, on = !names.has(name)) => (on ? names.add(name) : names.delete(name), on) };
  }
  addEventListener(kind, listener) { this.listeners[kind] = listener; }
  setAttribute(name, value) { this.attributes[name] = value; }
  get childNodes() { return this.children; }
  get rows() { return this.children; }
  get cells() { return this.children; }
  append(...children) { this.children.push(...children); }
  replaceChildren(...children) { this.children = children; }
  getContext() { return pen; }
  getBoundingClientRect() { return { left: 0, top: 0, width: 800, height: 500 }; }
  setPointerCapture() {}
  remove() {}
  focus() {}
  click() {}
  removeAttribute(name) { delete this.attributes[name]; }
  showModal() { this.opened = true; }
}

const elements = Object.fromEntries([...html.matchAll(/ id="([\w-]+)"/g)].map(([, id]) => [id, new Element()]));
const stages = [...html.matchAll(/class="stage"/g)].map(() => new Element("CANVAS"));
const matrices = stages.map(() => new Element("CANVAS"));
const buttons = [...html.matchAll(/data-key="([^"]*)"/g)].map(([, key]) => new Element("BUTTON", { "data-key": key }));
const listeners = {};
let frames = [];
globalThis.window = globalThis;
globalThis.addEventListener = () => {};
globalThis.location = { hash: "", href: "file:///page.html" };
globalThis.ResizeObserver = class { observe() {} };
globalThis.devicePixelRatio = 2;
globalThis.requestAnimationFrame = (frame) => frames.push(frame);
globalThis.getComputedStyle = () => ({ getPropertyValue: () => "#123456" });
globalThis.matchMedia = () => ({ addEventListener() {} });
globalThis.document = {
  documentElement: new Element(),
  createElement: (tag) => new Element(tag.toUpperCase()),
  getElementById: (id) => elements[id],
  querySelectorAll: (query) => ({ "canvas.stage": stages, "canvas.matrix": matrices })[query] ?? buttons,
  addEventListener: (kind, listener) => { listeners[kind] = listener; },
};
elements.recording.textContent = held;

let now = performance.now();
function draw(times = 1) {
  for (let time = 0; time < times; time += 1) {
    const due = frames;
    frames = [];
    now += 50;
    due.forEach((frame) => frame(now));
  }
}
function press(key, shiftKey = false) {
  listeners.keydown({ key, shiftKey, target: new Element("BODY"), preventDefault() {} });
  draw();
}
function touch(stage, kind, clientX, clientY, pointerId = 1) {
  stage.listeners[kind]({ type: kind, clientX, clientY, pointerId, deltaY: -100, buttons: 1, preventDefault() {} });
  draw();
}

const text = script.replace(/begin\(\);\s*$/, "await begin();");
await import(`data:text/javascript;base64,${Buffer.from(text).toString("base64")}`);
draw();
const player = globalThis.kinetilePlayer;
const opened = player.playback.moment;
const table = (id) => elements[id].children.map((row) => row.children.map((cell) => cell.textContent));
const readings = table("readings");

for (const key of ["ArrowRight", "ArrowRight", "n", "n", "p", "f", "t", "t", "c", "ArrowLeft"]) press(key);
for (const group of [2, 3, 4, 5, 6, 1]) for (const arrow of ["ArrowRight", "ArrowLeft"]) press(String(group)) || press(arrow);
press("ArrowRight", true);
press("ArrowLeft", true);
for (const key of ["ArrowUp", "ArrowDown", "PageDown", "PageUp", "w", "a", "s", "d"]) press(key);
for (let time = 0; time < 90; time += 1) press("z");
for (let time = 0; time < 150; time += 1) press("x");
press("r");
press("Home");
press("e");
press(" ");
draw(40);
press(" ");
const evenly = player.playback.moment;
press("e");
press(" ");
draw(40);
const played = player.playback.moment;
press("End");
const [stage] = stages;
touch(stage, "pointerdown", 400, 250);
touch(stage, "pointerup", 400, 250);
const tapped = player.selected;
touch(stage, "pointerdown", 100, 100);
touch(stage, "pointermove", 150, 130);
touch(stage, "pointerdown", 300, 300, 2);
touch(stage, "pointermove", 320, 330, 2);
touch(stage, "pointerup", 320, 330, 2);
touch(stage, "pointerup", 150, 130);
touch(stage, "wheel", 10, 10);
touch(elements.timeline, "pointerdown", player.timeline.place(0.5), 10);
const half = player.playback.moment;
elements.goto.listeners.change({ target: { value: "0.1" } });
draw();
const gone = player.playback.moment;
elements.goto.listeners.change({ target: { value: "tomorrow" } });
const refused = elements.said.textContent;
player.select(0);
draw();
elements.contacts.children[0]?.children[0].listeners.click();
buttons.forEach((button) => button.listeners.click() ?? draw());
console.log(JSON.stringify({ gone, refused, opened, evenly, played, half, tapped, readings, drawn, end: player.playback.end, helped: Boolean(elements.help.opened), legend: elements.legend.children.length }));

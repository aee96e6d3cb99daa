// The matrix that a phase keeps: the relations of all pairs of bodies. It is beside the scene: it has no place there.

import { prepare } from "./paper.mjs";

const FRAME = 22; // pixels, for the numbers of rows and columns
const LETTER = 12; // pixels of a square with a letter in it

/** Draws the entries of a matrix {a, b, role, label, fresh} for the present bodies; `marked` are its marked rows. */
export function drawMatrix(canvas, entries, there, { looks, fresh }, theme, marked) {
  const { pen, width, height } = prepare(canvas, devicePixelRatio);
  const bodies = [...there.keys()].filter((body) => there[body]);
  const rank = new Map(bodies.map((body, at) => [body, at]));
  const size = Math.min(width - FRAME, height - FRAME) / Math.max(bodies.length, 1);
  const place = (body) => FRAME + rank.get(body) * size;
  pen.clearRect(0, 0, width, height);
  pen.font = "12px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  const step = Math.ceil(1.4 * LETTER / size); // so that numbers do not run into each other
  bodies.forEach((body, at) => {
    const mark = marked.get(body);
    if (mark) {
      pen.fillStyle = mark.line;
      pen.globalAlpha = 0.25;
      pen.fillRect(FRAME, place(body), bodies.length * size, size);
      pen.fillRect(place(body), FRAME, size, bodies.length * size);
      pen.globalAlpha = 1;
    }
    if (at % step && !mark) return;
    pen.fillStyle = theme.text;
    pen.fillText(String(body), FRAME / 2, place(body) + size / 2);
    pen.fillText(String(body), place(body) + size / 2, FRAME / 2);
  });
  for (const entry of entries) {
    for (const [row, column] of [[entry.a, entry.b], [entry.b, entry.a]]) {
      const [x, y] = [place(column), place(row)];
      pen.globalAlpha = entry.role === "pair" ? 0.9 : 0.35;
      pen.fillStyle = looks[entry.role].colour;
      pen.fillRect(x, y, size, size);
      pen.globalAlpha = 1;
      if (size > LETTER) {
        pen.fillStyle = entry.role === "pair" ? "#000" : theme.text;
        pen.fillText(entry.role === "pair" ? "xy" : entry.label, x + size / 2, y + size / 2);
      }
      if (!entry.fresh) continue;
      pen.strokeStyle = fresh.colour;
      pen.lineWidth = 2.5;
      pen.strokeRect(x + 1, y + 1, size - 2, size - 2);
    }
  }
  pen.strokeStyle = theme.line;
  pen.lineWidth = 1;
  pen.strokeRect(FRAME, FRAME, bodies.length * size, bodies.length * size);
}

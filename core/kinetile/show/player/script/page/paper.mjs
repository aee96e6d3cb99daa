// A canvas, and paths on it: of a disc, a body, an area, a line. Invisible parts are left out.

import { clip, edge } from "./camera.mjs";

export const HUGE = 20000; // pixels: beyond, a canvas no longer draws circles truly

const TINY = 2.5; // pixels: a disc below this radius is drawn as a square, which looks the same

// Pixels: the greatest radius at which a square, or a wide and a high rectangle, fills all within the edge of a disc and
// has its corners under that edge. Without a GPU, one path of thousands of arcs is much slower to fill.
const SQUARE = 2.9;
export const SMALL = 4.9;

/** The canvas as a view: its context, and its size in CSS pixels. */
export function prepare(canvas, ratio) {
  const width = canvas.clientWidth;
  const height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.font = "12px system-ui, sans-serif";
  return { pen, width, height };
}

/** The picture under the moving parts: it is redrawn only for another key, other colours or another size. */
export class Backdrop {
  /** Shows it on a canvas, and returns the canvas as a view. */
  show(canvas, theme, key, draw) {
    const view = prepare(canvas, devicePixelRatio);
    const { pen, width, height } = view;
    const whole = [key, canvas.width, canvas.height, theme.paper].join(" ");
    pen.clearRect(0, 0, width, height);
    if (!canvas.width || !canvas.height) return view;
    if (this.key === whole) {
      pen.drawImage(this.picture, 0, 0, width, height);
      return view;
    }
    this.key = whole;
    draw(view);
    this.picture = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
    this.picture.getContext("2d").drawImage(canvas, 0, 0);
    return view;
  }
}

const within = (pixels) => Math.min(Math.max(pixels, -1e6), 1e6);

/** The position of a coordinate of the scene on the canvas. */
export function across({ camera, width }, x) {
  return width / 2 + within((x - camera.x - camera.dx) * camera.scale);
}

/** The position of a height of the scene on the canvas, whose y axis points down. */
export function down({ camera, height }, y) {
  return height / 2 - within((y - camera.y - camera.dy) * camera.scale);
}

/** Adds a disc to the path: whole, or the part of its edge that is near. Returns true if it is visible. */
export function addDisc(view, x, y, r) {
  const { pen, camera, width, height } = view;
  const [right, up] = camera.see(x, y);
  const radius = Math.max(r * camera.scale, 0.75);
  if (radius < HUGE) {
    if (Math.abs(right) > radius + width / 2 + 2 || Math.abs(up) > radius + height / 2 + 2) return false;
    if (radius < TINY) {
      pen.rect(width / 2 + right - radius, height / 2 - up - radius, 2 * radius, 2 * radius);
    } else {
      pen.moveTo(width / 2 + right + radius, height / 2 - up);
      pen.arc(width / 2 + right, height / 2 - up, radius, 0, 2 * Math.PI);
    }
    return true;
  }
  const reach = Math.hypot(width, height) / 2;
  const points = edge(camera, x, y, r, reach);
  if (points === null) {
    if (Math.hypot(right, up) > radius) return false;
    pen.rect(0, 0, width, height); // far inside it
    return true;
  }
  const { ux, uy } = camera.toDisc(x, y, r);
  const [first, last] = [points[0], points[points.length - 1]];
  const behind = [last, first].map(([px, py]) => [px + 4 * reach * ux, py + 4 * reach * uy]);
  for (const [at, [px, py]] of [...points, ...behind].entries()) {
    const [ax, ay] = [width / 2 + within(px), height / 2 - within(py)];
    if (at) pen.lineTo(ax, ay);
    else pen.moveTo(ax, ay);
  }
  pen.closePath();
  return true;
}

/** Fills the inside of a small disc, or square: its edge is a pixel wide, and is drawn over the filling. */
export function fillSmall(view, x, y, r) {
  const { pen, camera } = view;
  const [left, top] = [across(view, x), down(view, y)];
  const radius = Math.max(r * camera.scale, 0.75);
  const long = radius < TINY ? radius : radius - 0.4;
  const short = radius < SQUARE ? long : long * Math.SQRT1_2;
  pen.fillRect(left - long, top - short, 2 * long, 2 * short);
  if (short < long) pen.fillRect(left - short, top - long, 2 * short, 2 * long);
}

/** Adds a body to the path: its outline at its place, or a disc without one. Returns true if it is visible. */
export function addBody(view, x, y, radius, outline) {
  if (!outline) return addDisc(view, x, y, radius);
  addArea(view, outline.map(([right, up]) => [x + right, y + up]));
  return true;
}

/** A rectangle of the scene on the canvas: left, top, width, height; null if it is invisible. */
export function boxOf(view, x, y, otherX, otherY) {
  const [one, other] = [across(view, x), across(view, otherX)];
  const [low, high] = [down(view, y), down(view, otherY)];
  const [left, top] = [Math.min(one, other), Math.min(low, high)];
  const [width, height] = [Math.abs(other - one), Math.abs(low - high)];
  if (left + width < -4 || left > view.width + 4 || top + height < -4 || top > view.height + 4) return null;
  return [left, top, width, height];
}

/** Adds an area to the path, by its corners [x, y] in the scene. */
export function addArea(view, corners) {
  const { pen } = view;
  corners.forEach(([x, y], at) => (at ? pen.lineTo(across(view, x), down(view, y)) : pen.moveTo(across(view, x), down(view, y))));
  pen.closePath();
}

/** Adds the near part of a line of the scene to the path. Frames have thousands: most allocate nothing. */
export function addLine(view, x, y, otherX, otherY) {
  const { pen, camera, width, height } = view;
  let [ax, ay] = [(x - camera.x - camera.dx) * camera.scale, (y - camera.y - camera.dy) * camera.scale];
  let [bx, by] = [(otherX - camera.x - camera.dx) * camera.scale, (otherY - camera.y - camera.dy) * camera.scale];
  const [right, up] = [width / 2 + 4, height / 2 + 4];
  if ((ax < -right && bx < -right) || (ax > right && bx > right)) return;
  if ((ay < -up && by < -up) || (ay > up && by > up)) return;
  if (Math.max(Math.abs(ax), Math.abs(ay), Math.abs(bx), Math.abs(by)) > 1e4) {
    const near = clip([ax, ay], [bx, by], 1e4);
    if (!near.length) return;
    [[ax, ay], [bx, by]] = near;
  }
  pen.moveTo(width / 2 + ax, height / 2 - ay);
  pen.lineTo(width / 2 + bx, height / 2 - by);
}

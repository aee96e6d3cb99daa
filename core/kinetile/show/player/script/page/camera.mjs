// The view: a centre and a scale, in pixels a length. The centre is x + dx, y + dy, where dx is the part that the
// double x cannot hold: so one can zoom in until the last bit of a coordinate is a wide strip, and still pan.

import { twoProduct, twoSum } from "../run/doubles.mjs";

/** |d| - r for d = (dx + ex, dy + ey), e being small: without the cancellation of the difference. */
export function gap(dx, dy, r, ex = 0, ey = 0) {
  const [xx, lackX] = twoProduct(dx, dx);
  const [yy, lackY] = twoProduct(dy, dy);
  const [rr, lackR] = twoProduct(r, r);
  const [sum, lackSum] = twoSum(xx, yy);
  const [rest, lackRest] = twoSum(sum, -rr);
  const length = Math.sqrt(sum);
  if (length === 0) return -r;
  const squares = rest + (lackRest + lackSum + (lackX + lackY - lackR));
  return squares / (length + r) + (dx * ex + dy * ey) / length;
}

/** The gap between the surfaces of two discs at [x, y] with radii; negative if they overlap. */
export function gapOf([ax, ay], ar, [bx, by], br) {
  const [dx, ex] = twoSum(bx, -ax);
  const [dy, ey] = twoSum(by, -ay);
  const [r, lack] = twoSum(ar, br);
  return gap(dx, dy, r, ex, ey) - lack;
}

export class Camera {
  constructor() {
    Object.assign(this, { x: 0, y: 0, dx: 0, dy: 0, scale: 1, box: null });
  }

  /** Shows a box [left, bottom, right, top] in a window of this size in pixels; it stays until another view is chosen. */
  fit(box, width, height) {
    const [left, bottom, right, top] = box;
    this.look((left + right) / 2, (bottom + top) / 2);
    this.box = box;
    const [wide, high] = [Math.max(right - left, 1e-300), Math.max(top - bottom, 1e-300)];
    this.scale = 0.95 * Math.min(width / wide, height / high);
  }

  /** Puts the centre at a point, plus a small difference. */
  look(x, y, dx = 0, dy = 0) {
    [this.x, this.dx] = twoSum(x, dx);
    [this.y, this.dy] = twoSum(y, dy);
    this.box = null;
  }

  /** Moves the view by pixels: right and up. */
  pan(right, up) {
    this.look(this.x, this.y, this.dx + right / this.scale, this.dy + up / this.scale);
  }

  /** Zooms by a factor; the point at this distance in pixels right of and above the centre stays. */
  zoom(factor, right = 0, up = 0) {
    const scale = Math.min(Math.max(this.scale * factor, 1e-60), 1e60);
    this.pan(right - (right * this.scale) / scale, up - (up * this.scale) / scale);
    this.scale = scale;
  }

  /** A point in pixels right of and above the centre. */
  see(x, y) {
    return [(x - this.x - this.dx) * this.scale, (y - this.y - this.dy) * this.scale];
  }

  /** From the centre to a disc: the gap to its surface in lengths, and the direction [ux, uy] of its centre. */
  toDisc(x, y, r) {
    const [hx, lx] = twoSum(x, -this.x);
    const [hy, ly] = twoSum(y, -this.y);
    const length = Math.hypot(hx, hy) || 1;
    return { gap: gap(hx, hy, r, lx - this.dx, ly - this.dy), ux: hx / length, uy: hy / length };
  }
}

/**
 * The edge of a huge disc near the centre, as points in pixels right and up, from one side to the other, within
 * about `reach` pixels; null if it is not so near.
 */
export function edge(camera, x, y, r, reach, points = 65) {
  const { gap: away, ux, uy } = camera.toDisc(x, y, r);
  if (!(Math.abs(away) * camera.scale < 2 * reach)) return null;
  const found = [];
  for (let point = 0; point < points; point += 1) {
    const along = ((2 * point) / (points - 1) - 1) * Math.min((2 * reach) / camera.scale, r);
    const sag = (along * along) / (r + Math.sqrt(r * r - along * along));
    const out = (away + sag) * camera.scale;
    const side = along * camera.scale;
    found.push([ux * out - uy * side, uy * out + ux * side]);
  }
  return found;
}

/** The part of a line between two points [x, y] in the square of points up to `limit`: two points, or []. */
export function clip([ax, ay], [bx, by], limit) {
  let [first, last] = [0, 1];
  for (const [at, way] of [[ax, bx - ax], [ay, by - ay]]) {
    const [one, other] = [(-limit - at) / way, (limit - at) / way];
    if (way === 0) {
      if (Math.abs(at) > limit) return [];
    } else {
      first = Math.max(first, Math.min(one, other));
      last = Math.min(last, Math.max(one, other));
    }
  }
  if (first > last) return [];
  const point = (part) => [ax + (bx - ax) * part, ay + (by - ay) * part];
  return [first > 0 ? point(first) : [ax, ay], last < 1 ? point(last) : [bx, by]];
}

/** The point of the box around an outline that is nearest to a point. */
export function nearest(outline, x, y) {
  return [x, y].map((place, axis) => {
    const side = outline.map((corner) => corner[axis]);
    return Math.min(Math.max(place, Math.min(...side)), Math.max(...side));
  });
}

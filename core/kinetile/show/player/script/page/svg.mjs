// A canvas that writes SVG: it accepts the calls of a canvas, and keeps them as text.

const round = (number) => Number(number.toFixed(2));
const escape = (text) => text.replace(/[&<>"]/g, (letter) => `&#${letter.charCodeAt(0)};`);
const ANCHORS = { left: "start", center: "middle", right: "end" };
const BASELINES = { middle: "central", top: "hanging" };

/** The part of a canvas context that the drawings here use. */
class VectorPen {
  constructor(name) {
    Object.assign(this, { name, path: "", elements: [], clips: 0, globalAlpha: 1, dashes: [], lineJoin: "miter", isVector: true });
  }

  setTransform() {} // to the pixels of a screen, which vectors do not have

  clearRect() {}

  measureText(text) {
    return { width: 6.5 * text.length };
  }

  beginPath() {
    this.path = "";
  }

  moveTo(x, y) {
    this.path += `M${round(x)} ${round(y)}`;
  }

  lineTo(x, y) {
    this.path += `L${round(x)} ${round(y)}`;
  }

  closePath() {
    this.path += "Z";
  }

  rect(x, y, width, height) {
    this.path += `M${round(x)} ${round(y)}h${round(width)}v${round(height)}h${round(-width)}Z`;
  }

  /** A whole circle: other arcs do not occur. The path is at its right end already. */
  arc(x, y, radius) {
    const r = round(radius);
    this.path += `a${r} ${r} 0 1 1 ${-2 * r} 0a${r} ${r} 0 1 1 ${2 * r} 0Z`;
  }

  fill() {
    this.#add(`<path d="${this.path}" ${this.#filled()}/>`);
  }

  stroke() {
    this.#add(`<path d="${this.path}" ${this.#stroked()}/>`);
  }

  fillRect(x, y, width, height) {
    this.elements.push(`<rect x="${round(x)}" y="${round(y)}" width="${round(width)}" height="${round(height)}" ${this.#filled()}/>`);
  }

  fillText(text, x, y) {
    this.#text(text, x, y, this.#filled());
  }

  strokeText(text, x, y) {
    this.#text(text, x, y, `${this.#stroked()} stroke-linejoin="${this.lineJoin}"`);
  }

  setLineDash(dashes) {
    this.dashes = dashes;
  }

  save() {}

  clip() {
    const name = `${this.name}-${(this.clips += 1)}`;
    this.elements.push(`<clipPath id="${name}"><path d="${this.path}"/></clipPath><g clip-path="url(#${name})">`);
  }

  /** Ends the clipping: nothing else is saved here. */
  restore() {
    this.elements.push("</g>");
  }

  #filled() {
    return `fill="${this.fillStyle}"${this.#alpha("fill")}`;
  }

  #stroked() {
    const dashes = this.dashes.length ? ` stroke-dasharray="${this.dashes.join(" ")}"` : "";
    return `fill="none" stroke="${this.strokeStyle}" stroke-width="${this.lineWidth}"${dashes}${this.#alpha("stroke")}`;
  }

  #alpha(of) {
    return this.globalAlpha < 1 ? ` ${of}-opacity="${round(this.globalAlpha)}"` : "";
  }

  #text(text, x, y, look) {
    const place = `x="${round(x)}" y="${round(y)}" text-anchor="${ANCHORS[this.textAlign]}"`;
    const font = `dominant-baseline="${BASELINES[this.textBaseline]}" style="font: ${this.font}"`;
    this.elements.push(`<text ${place} ${font} ${look}>${escape(text)}</text>`);
  }

  #add(element) {
    if (this.path && this.globalAlpha > 0) this.elements.push(element);
  }
}

/** The panes of a player as one SVG, side by side, each with its name, and the present moment in words below. */
export function svgOf(player) {
  const parts = [];
  let [left, height] = [0, 0];
  player.panes.forEach(({ clientWidth, clientHeight }, at) => {
    const pen = new VectorPen(`pane-${at}`);
    player.drawPane({ clientWidth, clientHeight, getContext: () => pen }, at);
    const frame = `<svg x="${left}" width="${clientWidth}" height="${clientHeight}">${pen.elements.join("\n")}</svg>`;
    parts.push(frame, `<text x="${left + 8}" y="${clientHeight + 18}">${escape(player.held.runs[at].label)}</text>`);
    left += clientWidth + 12;
    height = Math.max(height, clientHeight);
  });
  const words = escape(player.momentInWords());
  const { paper, text } = player.theme;
  const size = `width="${left}" height="${height + 48}" viewBox="0 0 ${left} ${height + 48}"`;
  return `<svg xmlns="http://www.w3.org/2000/svg" ${size} style="font: 13px system-ui, sans-serif; background: ${paper}" fill="${text}">
<title>${words}</title>
${parts.join("\n")}
<text x="8" y="${height + 38}">${words}</text>
</svg>
`;
}

/** Saves the present picture as a file, named after its moment. */
export function saveSvg(player) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([svgOf(player)], { type: "image/svg+xml" }));
  link.download = `moment-${player.playback.moment.join("-")}.svg`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  player.say(`this moment is saved as ${link.download}`);
}

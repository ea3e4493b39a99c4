// The drawing of an arch: stones at an instant, faint ones of other runs, thrust line and hinges.
"use strict";
class Stage {
  constructor(canvas) {
    Object.assign(this, { canvas, pen: canvas.getContext("2d"), picture: null, backdrop: null, handles: [] });
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }
  /** Fit an arch: what is in view is its box with room for stones that fall. */
  fit(arch, box) {
    const { centre, arms, owner, piece_starts: starts, level } = arch.bodies;
    const points = owner.flatMap((body, piece) => arms.slice(starts[piece], starts[piece + 1]).map((arm) => plus(arm, centre[body])));
    const [xs, ys] = [0, 1].map((k) => points.map((point) => point[k])), room = 0.12 * (Math.max(...xs) - Math.min(...xs));
    if (!box) this.backdrop = null;
    this.frame(box ?? [Math.min(...xs) - room, Math.min(level, ...ys) - 0.3 * room, Math.max(...xs) + room, Math.max(...ys) + 0.6 * room]);
  }
  /** Show a box, its left, low, right and high ends. */
  frame(box) {
    this.box = box;
    this.canvas.style.aspectRatio = (box[2] - box[0]) / (box[3] - box[1]);
  }
  /** Show a picture {arch, poses, ghosts, lines, hinges, handles}; without one, the last again. */
  draw(picture = this.picture) {
    this.picture = picture;
    if (!picture || !this.canvas.clientWidth) return;
    const { canvas, pen } = this, ratio = window.devicePixelRatio || 1, [left, low, right, high] = this.box;
    canvas.width = ratio * canvas.clientWidth;
    canvas.height = ratio * canvas.clientHeight;
    this.scale = Math.min(canvas.width / (right - left), canvas.height / (high - low));
    this.origin = [0.5 * canvas.width - 0.5 * this.scale * (left + right), canvas.height + this.scale * low];
    const style = getComputedStyle(canvas), colour = (name) => style.getPropertyValue(`--${name}`).trim();
    const { arch, hinges = [], handles } = picture;
    if (this.backdrop) this.drawBackdrop();
    if (arch) this.drawArch(picture, colour, ratio);
    for (const [points, kind] of [[hinges, "hinge"], [handles, "chosen"]]) for (const point of points) this.dot(this.place(point), 6 * ratio, colour(kind), colour("paper"));
  }
  drawArch({ arch, poses, ghosts, lines }, colour, ratio) {
    const { canvas, pen } = this, width = 1.2 * ratio;
    const [, ground] = this.place([0, arch.bodies.level]);
    this.stroke([[0, ground], [canvas.width, ground]], colour("edge"), width);
    pen.globalAlpha = 0.16;
    for (const ghost of ghosts) this.stones(arch, ghost, () => null, colour("ink"), 0.8 * ratio);
    pen.globalAlpha = this.backdrop ? 0.75 : 1;
    this.stones(arch, poses, (body) => colour(arch.bodies.inverse_mass[body][0] ? "stone" : "support"), colour("edge"), width);
    pen.globalAlpha = 1;
    for (const points of lines) {
      const line = points.map((point) => this.place(point));
      this.stroke(line, colour("paper"), 4.6 * width);
      this.stroke(line, colour("thrust"), 2.2 * width);
    }
  }
  place([x, y]) { return [this.origin[0] + this.scale * x, this.origin[1] - this.scale * y]; }
  /** The point of the ground plan at a pointer. */
  pointAt({ clientX, clientY }) {
    const box = this.canvas.getBoundingClientRect(), ratio = this.canvas.width / box.width;
    return [(ratio * (clientX - box.left) - this.origin[0]) / this.scale, (this.origin[1] - ratio * (clientY - box.top)) / this.scale];
  }
  /** A picture behind the arch: its lower left corner stands at the origin. */
  drawBackdrop() {
    const { image, metres } = this.backdrop, [wide, high] = [metres * image.width, metres * image.height];
    this.pen.drawImage(image, ...this.place([0, high]), this.scale * wide, this.scale * high);
  }
  stroke(points, colour, width) {
    const { pen } = this;
    Object.assign(pen, { strokeStyle: colour, lineWidth: width, lineJoin: "round", lineCap: "round" });
    pen.beginPath();
    points.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    pen.stroke();
  }
  dot([x, y], radius, fill, rim) {
    const { pen } = this;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    Object.assign(pen, { fillStyle: fill, strokeStyle: rim, lineWidth: 0.25 * radius });
    pen.fill();
    pen.stroke();
  }
  /** All stones in their poses: pieces are filled, and the sides of stones drawn. */
  stones({ bodies: { centre, arms, owner, piece_starts: starts, outer } }, poses, fillOf, edge, width) {
    const { pen } = this;
    owner.forEach((body, piece) => {
      const [x, y, turn] = poses.subarray(3 * body, 3 * body + 3), middle = plus(centre[body], [x, y]);
      const points = arms.slice(starts[piece], starts[piece + 1]).map((arm) => this.place(plus(middle, rotate(arm, turn))));
      const fill = fillOf(body);
      if (fill) {
        pen.beginPath();
        points.forEach((point, k) => (k ? pen.lineTo(...point) : pen.moveTo(...point)));
        pen.closePath();
        // a hair beyond its edge, so that no gap shows between two pieces
        Object.assign(pen, { fillStyle: fill, strokeStyle: fill, lineWidth: 0.5 });
        pen.fill();
        pen.stroke();
      }
      sides(points).forEach((side, k) => { if (outer[starts[piece] + k]) this.stroke(side, edge, width); });
    });
  }
}

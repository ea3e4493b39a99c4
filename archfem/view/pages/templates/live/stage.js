// The drawing of an arch: stones at an instant, faint ones of other runs, thrust line and hinges.
"use strict";

class Stage {
  constructor(svg) {
    Object.assign(this, { svg, layers: svg.querySelector("g"), photo: null, handles: [], cross: [] });
  }
  /** Fit an arch: what is in view is its box with room for stones that fall. */
  fit({ bodies }, box) {
    const points = placePieces(bodies).flat();
    const [xs, ys] = [0, 1].map((k) => points.map((point) => point[k])), room = 0.12 * (Math.max(...xs) - Math.min(...xs));
    if (!box) this.placePhoto(null);
    this.frame(box ?? [Math.min(...xs) - room, Math.min(bodies.level, ...ys) - 0.3 * room, Math.max(...xs) + room, Math.max(...ys) + 0.6 * room]);
  }
  /** Show a box, its left, low, right and high ends; y is upwards. */
  frame(box) {
    const [left, low, right, high] = this.box = box;
    this.svg.setAttribute("viewBox", `${left} ${-high} ${right - left} ${high - low}`);
  }
  /** Show stones in their poses, and what belongs to them. */
  draw({ bodies, poses, ghosts = [], lines = [], hinges = [], handles = [] }) {
    const trace = (points) => `M${points.map(([x, y]) => `${x.toFixed(4)} ${y.toFixed(4)}`).join("L")}`;
    const set = (layer, parts) => this.svg.querySelector(`.${layer}`).setAttribute("d", parts.join(""));
    const pieces = bodies ? placePieces(bodies, poses) : [], isFree = (piece) => bodies.inverse_mass[bodies.owner[piece]][0] > 0;
    /** Sides of stones, without those between the pieces of one. */
    const rims = (own) => own.flatMap((points, piece) => sides(points).filter((_, k) => bodies.outer[bodies.piece_starts[piece] + k]).map(trace));
    set("level", bodies ? [`M-1e3 ${bodies.level}H1e3`] : []);
    set("stones", pieces.filter((_, piece) => isFree(piece)).map((points) => `${trace(points)}Z`));
    set("supports", pieces.filter((_, piece) => !isFree(piece)).map((points) => `${trace(points)}Z`));
    set("rims", rims(pieces));
    set("halo", lines.map(trace));
    set("thrust", lines.map(trace));
    set("hinges", hinges.map((point) => `${trace([point])}h0`)); // a stroke without length is a disc
    set("handles", handles.map((point) => `${trace([point])}h0`));
    this.svg.querySelector(".ghosts").replaceChildren(...ghosts.map((ghost) => {
      const path = document.createElementNS(this.svg.namespaceURI, "path");
      path.setAttribute("d", rims(placePieces(bodies, ghost)).join(""));
      return path;
    }));
  }
  /** Size of a pixel [m]. */
  get pixel() { return 1 / this.layers.getScreenCTM().a; }
  /** The point of the elevation at a pointer [m]. */
  pointAt({ clientX, clientY }) {
    const { x, y } = new DOMPoint(clientX, clientY).matrixTransform(this.layers.getScreenCTM().inverse());
    return [x, y];
  }
  /** Place a photo behind the arch, its pixels so many metres large, with its lower left corner at the origin; or none. */
  placePhoto(photo, metres) {
    const image = this.svg.querySelector("image");
    Object.assign(this, { photo, metres });
    if (!photo) return image.removeAttribute("href");
    const [wide, high] = [photo.naturalWidth, photo.naturalHeight].map((size) => metres * size);
    for (const [name, value] of Object.entries({ href: photo.src, y: -high, width: wide, height: high })) image.setAttribute(name, value);
    this.frame([0, 0, wide, high]);
  }
}

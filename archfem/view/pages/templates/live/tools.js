// Start from an example, a photo or a drawing; take the arch away as a case, a picture or a link.
"use strict";
const MAX_BYTES = 2e7; // of a file that a reader opens
const MARKS = ["the left springing, on the inner side", "the right springing, on the inner side", "the crown, on the inner side"];

class Tools {
  constructor(live) {
    Object.assign(this, { live, source: { example: 0 }, marks: [], scaleMarks: [], mode: null, dragged: -1, chosen: [], grip: null });
    this.find = (name) => document.querySelector(`#${name}`);
    live.data.arches.forEach(({ name }, k) => this.find("example").append(new Option(name, k)));
    const actions = {
      example: () => this.startFrom({ example: Number(this.find("example").value) }),
      photo: (file) => this.placePhoto(file), drawing: (file) => this.openDrawing(file), record: (file) => this.openRecord(file),
      kind: () => this.drawMarked(), length: () => this.setScale(),
    };
    for (const [name, action] of Object.entries(actions)) this.find(name).addEventListener("change", () => this.attempt(() => action(this.find(name).files?.[0])));
    for (const mode of ["scale", "mark"]) this.find(mode).addEventListener("click", () => this.attempt(() => this.begin(mode)));
    for (const [name, action] of [["stones-move", this.beginMoving], ["case", this.saveCase], ["png", this.savePicture], ["link", this.makeLink]]) this.find(name).addEventListener("click", () => this.attempt(() => action.call(this)));
    const canvas = live.stage.canvas;
    canvas.addEventListener("pointerdown", (event) => this.attempt(() => this.press(event)));
    canvas.addEventListener("pointermove", (event) => this.attempt(() => this.drag(event)));
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, () => Object.assign(this, { dragged: -1, grip: null }));
    canvas.addEventListener("keydown", (event) => this.attempt(() => this.pressKey(event)));
    if (location.hash.length > 1) this.attempt(() => this.openLink());
  }
  /** Do something; what is wrong stands in words below the buttons. */
  async attempt(action) {
    try {
      await action();
    } catch (error) {
      this.say(error.message, true);
    }
  }
  say(words, isWrong = false) {
    this.find("message").textContent = words;
    this.find("message").classList.toggle("doubt", isWrong);
  }
  async read(file) {
    if (file.size > MAX_BYTES) refuse(`${file.name} has ${(file.size / 1e6).toFixed(0)} MB: give a file of at most 20 MB`);
    return file.text();
  }

  /** Show the arch of a source: an example, a marked ring or outlines; with a design of a link. */
  startFrom(source, design = {}) {
    const { data } = this.live, { parameters } = data.arches[0];
    let arch = data.arches[source.example ?? 0];
    if (source.outlines) arch = assembleOutlines(source.outlines, source.unit, parameters);
    if (source.drawn) {
      const ring = drawRing(source.drawn);
      arch = { name: "a drawn arch", ...cutRing(ring, { factor: 1, stones: ring.stones, friction: 0.6 }, parameters), ring, thrust: null };
      ring.level = arch.bodies.level;
    }
    this.source = source;
    this.live.isMarking = false;
    if (!source.drawn) Object.assign(this, { marks: [], mode: source.moved ? this.mode : null });
    const { stage } = this.live, isMoving = this.mode === "stones", box = isMoving || (stage.backdrop && source.drawn) ? stage.box : null;
    Object.assign(stage.canvas, { tabIndex: isMoving ? 0 : -1 }).style.touchAction = isMoving || source.drawn ? "none" : "";
    this.live.open(arch, design, box);
    this.say(`${arch.name}: ${arch.joints.length} joints`);
  }

  async placePhoto(file) {
    if (file.size > MAX_BYTES) refuse(`${file.name} has ${(file.size / 1e6).toFixed(0)} MB: give a picture of at most 20 MB`);
    const image = await createImageBitmap(file).catch(() => refuse(`${file.name} is no picture: give a JPEG or a PNG`));
    this.live.stage.backdrop = { image, corner: [0, (10 * image.height) / image.width], metres: 10 / image.width };
    Object.assign(this, { marks: [], scaleMarks: [], isScaled: false });
    this.showPhoto();
    this.begin("scale");
  }
  showPhoto() {
    const { stage } = this.live, { image, metres } = stage.backdrop;
    stage.backdrop.corner = [0, metres * image.height];
    stage.box = [0, 0, metres * image.width, metres * image.height];
    stage.canvas.style.aspectRatio = image.width / image.height;
    this.drawMarks();
  }
  begin(mode) {
    const { backdrop } = this.live.stage;
    if (!backdrop) refuse("place a photo or an elevation first");
    if (mode === "mark" && !this.isScaled) refuse("this photo has no scale yet: click two points of known distance, and give it in metres");
    this.mode = mode;
    this[mode === "scale" ? "scaleMarks" : "marks"] = [];
    this.say(mode === "scale" ? "Click two points whose distance you know." : `Click ${MARKS[0]}.`);
    this.drawMarks();
  }
  drawMarks() {
    this.live.isMarking = true;
    this.live.stage.draw({ arch: null, ghosts: [], lines: [], hinges: [], handles: this.mode === "scale" ? this.scaleMarks : this.marks });
  }
  /** Let the reader move stones and corners; those of neighbours go along. */
  beginMoving() {
    this.mode = "stones";
    this.chosen = [];
    this.showMoved(traceStones(this.live.arch));
    this.live.stage.canvas.focus();
    this.say("Drag a stone or a corner. Keys: Enter chooses the next stone, arrows move it by 1 cm.");
  }
  showMoved(outlines) {
    const { design: { friction, finish, strength }, stage } = this.live;
    this.startFrom({ outlines, unit: 1, file: "stones.geojson", moved: true }, { friction, finish, strength });
    stage.handles = this.chosen.map(([k, i]) => outlines[k].points[i]);
    this.live.show(0);
  }
  /** Choose the corner or the stone at a point. */
  choose(point) {
    const { outlines } = this.source, far = ([x, y]) => this.live.stage.scale * Math.hypot(x - point[0], y - point[1]);
    const corner = outlines.flatMap(({ points }) => points).reduce((best, each) => (far(each) < far(best) ? each : best));
    const isInside = ({ points }) => points.every(([x, y], k) => { const [u, v] = points[(k + 1) % points.length]; return (u - x) * (point[1] - y) >= (v - y) * (point[0] - x); });
    this.chosen = findCorners(outlines, far(corner) < 16 * devicePixelRatio ? [corner] : outlines.find(isInside)?.points ?? []);
    this.grip = { point, outlines };
  }
  pressKey(event) {
    if (this.mode !== "stones") return;
    const { outlines } = this.source, move = { ArrowLeft: [-0.01, 0], ArrowRight: [0.01, 0], ArrowUp: [0, 0.01], ArrowDown: [0, -0.01] }[event.key];
    if (!move && event.key !== "Enter") return;
    event.preventDefault();
    if (move) return this.showMoved(moveCorners(outlines, this.chosen, move));
    this.number = ((this.number ?? -1) + 1) % outlines.length;
    this.chosen = findCorners(outlines, outlines[this.number].points);
    this.showMoved(outlines);
    this.say(`stone ${this.number + 1} is chosen`);
  }
  press(event) {
    const { stage } = this.live, point = stage.pointAt(event);
    if (this.mode === "stones") {
      this.choose(point);
      stage.canvas.setPointerCapture(event.pointerId);
      this.showMoved(this.source.outlines);
      return;
    }
    if (this.mode === "scale" && this.scaleMarks.length < 2) {
      this.scaleMarks.push(point);
      this.say(this.scaleMarks.length < 2 ? "Click the second point." : "Give their distance in metres, and press Enter.");
      this.drawMarks();
      if (this.scaleMarks.length === 2) this.find("length").focus();
    } else if (this.mode === "mark" && this.marks.length < 3) {
      this.marks.push(point);
      this.drawMarks();
      if (this.marks.length < 3) this.say(`Click ${MARKS[this.marks.length]}.`); else this.drawMarked();
    } else if (this.source.drawn) {
      const near = this.marks.findIndex(([x, y]) => stage.scale * Math.hypot(x - point[0], y - point[1]) < 24 * devicePixelRatio);
      if (near >= 0) { this.dragged = near; stage.canvas.setPointerCapture(event.pointerId); }
    }
  }
  drag(event) {
    const point = this.live.stage.pointAt(event);
    if (this.grip) this.showMoved(moveCorners(this.grip.outlines, this.chosen, point.map((value, k) => value - this.grip.point[k])));
    if (this.dragged < 0) return;
    this.marks[this.dragged] = point;
    this.drawMarked();
  }
  setScale() {
    const length = Number(this.find("length").value), [one, other] = this.scaleMarks, { backdrop } = this.live.stage;
    if (!other) refuse("click two points of the photo first");
    if (!(length > 0.01 && length < 1000)) refuse("give the distance of the two points in metres");
    backdrop.metres *= length / Math.hypot(one[0] - other[0], one[1] - other[1]);
    this.isScaled = true;
    this.showPhoto();
    this.begin("mark");
  }
  /** The ring through the marks; its springings are level. */
  drawMarked() {
    if (this.marks.length < 3) return;
    const [[x0, y0], [x1, y1], [, top]] = this.marks, level = 0.5 * (y0 + y1), span = Math.abs(x1 - x0);
    if (Math.abs(y1 - y0) > 0.1 * span) refuse(`the springings differ by ${Math.abs(y1 - y0).toFixed(2)} m in height: a drawn ring has level ones; give the outlines of its stones instead`);
    const thickness = this.source.drawn ? this.live.design.thickness : Math.round(10 * Math.max(span, 1)) / 100;
    this.startFrom({ drawn: { kind: this.find("kind").value, span, rise: top - level, thickness, left: [Math.min(x0, x1), level] } }, this.source.drawn ? { stones: this.live.design.stones } : {});
    this.live.stage.handles = this.marks;
    this.live.show(0);
    this.say("Drag the three points; set thickness and number of stones at the side.");
  }

  async openDrawing(file) {
    const text = await this.read(file), isDxf = /\.dxf$/i.test(file.name), unit = Number(this.find("unit").value);
    let outlines = [];
    try { outlines = isDxf ? readDxf(text) : readGeoJson(text); } catch { refuse(`${file.name} cannot be read: give GeoJSON, or DXF as text`); }
    this.live.stage.backdrop = null;
    this.startFrom({ outlines, unit, file: file.name });
  }
  async openRecord(file) {
    const record = readRecord(await this.read(file), file.name), { live } = this;
    live.data.motions.push(record);
    this.find("motion").append(new Option(file.name, live.data.motions.length - 1));
    this.find("motion").value = live.data.motions.length - 1;
    this.find("motion").dispatchEvent(new Event("input"));
    this.say(`${file.name}: ${record.x.length} values every ${record.dt} s, up to ${record.strength.toFixed(2)} g`);
  }

  /** The case as `archfem run` reads it. */
  writeCase() {
    const { live } = this, { design, data } = live, { drawn, outlines, unit, file } = this.source, motion = data.motions[this.find("motion").value];
    const shapes = { circle: "circular_arch", ellipse: "elliptical_arch", pointed: "pointed_arch" };
    const model = '\n[model]\nfidelity = "rigid"\ndisplacements = "large"\n\n[analysis]\ndamping = { ratio = 0.05, modes = "effective" }\n';
    let text = data.arches[this.source.example ?? 0].case;
    if (drawn) text = `title = "a drawn arch"\n\n[structure]\nshape = "${shapes[drawn.kind]}"\nspan = ${drawn.span.toFixed(4)}\nrise = ${drawn.rise.toFixed(4)}\nthickness = 0\nvoussoirs = 0\n${model}`;
    if (outlines) text = `title = "a drawing"\n\n[structure]\nshape = "outlines"\nfile = "${file}"  # beside this file\nunit = "${{ 1: "m", 0.01: "cm", 0.001: "mm" }[unit]}"\nsnap = "3 mm"\n${model}`;
    if (design.stones) text = text.replace(/^thickness = .*$/m, `thickness = ${design.thickness}`).replace(/^voussoirs = .*$/m, `voussoirs = ${design.stones}`);
    const law = live.finishes.find(({ name }) => name === design.finish);
    text += `\n[contacts."stone to stone"]\nfriction = ${design.friction}\n`;
    if (law) text += `normal_stiffness = ${law.stiffness}  # ${law.name}\nshear_stiffness = ${law.shear}\nclosure = ${law.closure}\n`;
    const seed = motion.name.match(/^earthquake (\d)$/);
    if (seed) return `${text}\n[motion]\nsynthetic = { seed = ${seed[1]}, duration = 8.0, dt = 0.01, pga = ${(design.strength * G).toFixed(4)} }\n`;
    return `${text}\n# moved by "${motion.name}", ${design.strength} g at most: give your own record in [motion]\n`;
  }
  saveCase() {
    const { moved, outlines, file } = this.source;
    if (moved) this.save(new Blob([writeGeoJson(outlines)], { type: "application/geo+json" }), file);
    this.save(new Blob([this.writeCase()], { type: "text/plain" }), "arch.toml");
  }
  savePicture() { this.live.stage.canvas.toBlob((blob) => this.save(blob, "arch.png")); }
  save(blob, name) {
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1e3);
    this.say(`saved as ${name}`);
  }
  /** The arch and what was chosen, in the address of this page. */
  async makeLink() {
    location.hash = encodeURIComponent(JSON.stringify({ source: this.source, design: this.live.design, motion: Number(this.find("motion").value) }));
    await navigator.clipboard?.writeText(location.href).catch(() => {});
    this.say("The address of this page holds the arch now: copy it.");
  }
  openLink() {
    let found;
    try { found = JSON.parse(decodeURIComponent(location.hash.slice(1))); } catch { refuse("the link is not complete: copy all of it"); }
    this.startFrom(found.source, found.design);
    this.find("motion").value = this.live.data.motions[found.motion] ? found.motion : 0;
    this.live.design.strength = found.design.strength;
    this.live.change("motion");
  }
}

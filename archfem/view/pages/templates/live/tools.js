// Start from an example, a photo or a drawing; take the arch away as a case, a picture or a link.
"use strict";
const MAX_BYTES = 2e7; // of a file that a reader opens
const MAX_LINKED = 6000; // values of a record that a link holds, about 30 kB
/** What a reader chose, but for the thickness: it stays where the arch is drawn anew. */
const keep = ({ stones, friction, finish, strength }) => ({ stones, friction, finish, strength });
const MARKS = ["the left springing, on the inner side", "the right springing, on the inner side", "the crown, on the inner side"];

class Tools {
  constructor(live) {
    Object.assign(this, { live, source: { example: 0 }, marks: [], scaleMarks: [], mode: null, dragged: -1, chosen: [], grip: null });
    this.find = (name) => document.querySelector(`#${name}`);
    live.data.arches.forEach(({ name }, k) => this.find("example").append(new Option(name, k)));
    const actions = {
      example: () => { this.mode = null; this.startFrom({ example: Number(this.find("example").value) }); },
      photo: (file) => this.placePhoto(file), drawing: (file) => this.openDrawing(file), record: (file) => this.openRecord(file),
      "record-unit": () => this.openRecord(this.find("record").files[0]), kind: () => this.drawMarked(), length: () => this.setScale(),
    };
    for (const [name, action] of Object.entries(actions)) this.find(name).addEventListener("change", () => this.attempt(() => action(this.find(name).files?.[0])));
    for (const mode of ["scale", "mark"]) this.find(mode).addEventListener("click", () => this.attempt(() => this.begin(mode)));
    for (const [name, action] of [["stones-move", this.beginMoving], ["undo", this.undoMove], ["case", this.saveCase], ["png", this.savePicture], ["link", this.makeLink]]) this.find(name).addEventListener("click", () => this.attempt(() => action.call(this)));
    this.find("length").addEventListener("keydown", (event) => { if (event.key === "Enter") this.attempt(() => this.setScale()); });
    live.reset = () => this.restore();
    const canvas = live.stage.canvas;
    // a tap or a click places a point; a swipe scrolls the page but where it takes hold of something
    canvas.addEventListener("click", (event) => this.attempt(() => this.placePoint(live.stage.pointAt(event))));
    canvas.addEventListener("touchstart", (event) => { if (event.touches.length === 1 && this.catches(live.stage.pointAt(event.touches[0]))) event.preventDefault(); }, { passive: false });
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
    if (!source.moved) Object.assign(this, { begun: source, history: [] });
    if (!source.drawn) Object.assign(this, source.moved ? {} : { marks: [], mode: null });
    if (source.example === undefined) this.find("example").selectedIndex = -1;
    const { stage } = this.live, isMoving = this.mode === "stones", box = isMoving || (stage.backdrop && source.drawn) ? stage.box : null;
    stage.canvas.tabIndex = isMoving ? 0 : -1;
    this.find("undo").hidden = !isMoving;
    this.live.open(arch, design, box);
    const { joints, bodies } = this.live.arch, supports = bodies.inverse_mass.slice(0, -1).filter(([value]) => value === 0).length;
    this.say(`${arch.name}: ${joints.length} joints; ${supports} of its blocks ${supports > 1 ? "are supports" : "is a support"}, which follow${supports > 1 ? "" : "s"} the ground`);
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
    this.live.tell();
    this.live.stage.draw({ arch: null, ghosts: [], lines: [], hinges: [], handles: this.mode === "scale" ? this.scaleMarks : this.marks });
  }
  /** Let the reader move stones and corners; those of neighbours go along. */
  beginMoving() {
    this.mode = "stones";
    this.chosen = [];
    if (!this.source.moved) this.history = [];
    this.showMoved(traceStones(this.live.arch));
    this.live.stage.canvas.focus();
    this.say("Drag a stone by its middle, or a corner. Keys: Enter chooses the next stone, arrows move it by 1 cm.");
  }
  undoMove() {
    const before = this.history.pop();
    if (!before) refuse("no stone was moved");
    this.chosen = [];
    this.showMoved(before);
  }
  /** The arch before its stones were moved and sliders were used; motion and photo stay. */
  restore() {
    this.mode = null;
    const { marks, live: { design: { strength } } } = this;
    this.startFrom(this.begun, { strength });
    if (this.begun.drawn) { Object.assign(this, { marks }); this.live.stage.handles = marks; this.live.show(0); }
  }
  showMoved(outlines) {
    const { design: { friction, finish, strength }, stage } = this.live;
    this.startFrom({ outlines, unit: 1, file: "stones.geojson", moved: true }, { friction, finish, strength });
    stage.handles = this.chosen.map(([k, i]) => outlines[k].points[i]);
    this.live.show(0);
  }
  /** Corners at a point, with those of neighbours: of one corner, or of the stone around it. */
  cornersAt(point) {
    const { outlines } = this.source, far = ([x, y]) => this.live.stage.scale * Math.hypot(x - point[0], y - point[1]);
    const corner = outlines.flatMap(({ points }) => points).reduce((best, each) => (far(each) < far(best) ? each : best));
    const isInside = ({ points }) => points.every(([x, y], k) => { const [u, v] = points[(k + 1) % points.length]; return (u - x) * (point[1] - y) >= (v - y) * (point[0] - x); });
    const stone = outlines.find(isInside)?.points ?? [], middle = [0, 1].map((k) => stone.reduce((sum, each) => sum + each[k], 0) / stone.length);
    const isCorner = far(corner) < 16 * devicePixelRatio && !(far(middle) < far(corner)); // a stone may be as small as a finger
    return findCorners(outlines, isCorner ? [corner] : stone);
  }
  /** Whether a press at a point takes hold of a mark, a corner or a stone. */
  catches(point) {
    if (this.mode === "stones") return this.cornersAt(point).length > 0;
    return Boolean(this.source.drawn) && !this.live.isMarking && this.findMark(point) >= 0;
  }
  findMark([u, v]) { return this.marks.findIndex(([x, y]) => this.live.stage.scale * Math.hypot(x - u, y - v) < 24 * devicePixelRatio); }
  pressKey(event) {
    if (this.mode !== "stones") return;
    const { outlines } = this.source, move = { ArrowLeft: [-0.01, 0], ArrowRight: [0.01, 0], ArrowUp: [0, 0.01], ArrowDown: [0, -0.01] }[event.key];
    if (!move && event.key !== "Enter") return;
    event.preventDefault();
    if (move) { this.history.push(outlines); return this.showMoved(moveCorners(outlines, this.chosen, move)); }
    this.number = ((this.number ?? -1) + 1) % outlines.length;
    this.chosen = findCorners(outlines, outlines[this.number].points);
    this.showMoved(outlines);
    this.say(`stone ${this.number + 1} is chosen`);
  }
  press(event) {
    const { stage } = this.live, point = stage.pointAt(event);
    if (this.mode === "stones") {
      const { outlines } = this.source;
      this.chosen = this.cornersAt(point);
      if (this.chosen.length) {
        this.grip = { point, outlines };
        this.history.push(outlines);
        stage.canvas.setPointerCapture(event.pointerId);
      }
      this.showMoved(outlines);
    } else if (this.source.drawn && !this.live.isMarking && this.findMark(point) >= 0) {
      this.dragged = this.findMark(point);
      stage.canvas.setPointerCapture(event.pointerId);
    }
  }
  /** Place a point of the scale, of which a third one moves the nearest, or a springing or the crown. */
  placePoint(point) {
    const { scaleMarks: two } = this, far = ([x, y]) => Math.hypot(x - point[0], y - point[1]);
    if (!this.live.isMarking) return;
    if (this.mode === "scale") {
      if (two.length === 2) two[far(two[0]) < far(two[1]) ? 0 : 1] = point; else two.push(point);
      this.say(two.length < 2 ? "Click the second point." : "Give their distance in metres, and press Enter. Another click moves the nearer point.");
      this.drawMarks();
      if (two.length === 2) this.find("length").focus();
    } else if (this.mode === "mark" && this.marks.length < 3) {
      this.marks.push(point);
      this.drawMarks();
      if (this.marks.length < 3) this.say(`Click ${MARKS[this.marks.length]}.`); else this.drawMarked();
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
    const length = Number(this.find("length").value), [one, other] = this.scaleMarks, { backdrop, scale } = this.live.stage;
    if (this.mode !== "scale") return; // Enter comes as a key and as a change
    if (!other) refuse("click two points of the photo first");
    if (scale * Math.hypot(one[0] - other[0], one[1] - other[1]) < 10 * devicePixelRatio) refuse("the two points are one: click places that are farther apart");
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
    this.startFrom({ drawn: { kind: this.find("kind").value, span, rise: top - level, thickness, left: [Math.min(x0, x1), level] } }, this.source.drawn ? keep(this.live.design) : {});
    this.live.stage.handles = this.marks;
    this.live.show(0);
    this.say("Drag the three points; set thickness and number of stones by their sliders.");
  }

  async openDrawing(file) {
    const text = await this.read(file), isDxf = /\.dxf$/i.test(file.name), unit = Number(this.find("unit").value);
    let outlines = [];
    try { outlines = isDxf ? readDxf(text) : readGeoJson(text); } catch { refuse(`${file.name} cannot be read: give GeoJSON, or DXF as text`); }
    this.live.stage.backdrop = null;
    this.startFrom({ outlines, unit, file: file.name });
  }
  async openRecord(file) {
    if (!file) return;
    const record = readRecord(await this.read(file), file.name, Number(this.find("record-unit").value));
    this.addRecord(record);
    this.find("motion").dispatchEvent(new Event("input"));
    this.say(`${file.name}: ${record.x.length} values every ${record.dt.toPrecision(3)} s, up to ${record.strength.toFixed(2)} g`);
  }
  /** Add a record to the motions, in place of one of its name, and choose it. */
  addRecord(record) {
    const { motions } = this.live.data, known = motions.findIndex(({ name }) => name === record.name), number = known < 0 ? motions.length : known;
    motions[number] = { ...record, isOwn: true };
    if (known < 0) this.find("motion").append(new Option(record.name, number));
    this.find("motion").value = number;
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
    const { motion: { dt, x, y }, scale } = makeMotion(motion, design.strength), list = (values) => values.map((value) => Number(value.toFixed(4))).join(", ");
    const upright = y.some((value) => value !== 0) ? `vertical = { samples = [${list(y)}], dt = ${dt} }\n` : "";
    return `${text}\n[motion]  # ${motion.name}, at most ${design.strength} g\nscale = ${scale}\ndt = ${dt}\nsamples = [${list(x)}]\n${upright}`;
  }
  saveCase() {
    const { moved, outlines, file } = this.source;
    if (moved) this.save(new Blob([writeGeoJson(outlines)], { type: "application/geo+json" }), file);
    this.save(new Blob([this.writeCase()], { type: "text/plain" }), "arch.toml");
    if (moved) this.say(`saved as arch.toml and ${file}: keep them in one folder`);
  }
  /** The picture, with what it shows below it. */
  savePicture() {
    const { canvas } = this.live.stage, size = Math.max(canvas.width / 60, 12), picture = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height + 6 * size });
    const pen = picture.getContext("2d"), style = getComputedStyle(document.body), texts = ["sizes", "weight", "collapse"].map((name) => `${this.find(name).previousElementSibling.textContent}: ${this.find(name).textContent}`);
    const { design } = this.live, lines = [this.find("verdict").textContent, texts.join("; "), `${design.thickness ? `thickness ${design.thickness.toFixed(3)} m, ` : ""}friction ${design.friction.toFixed(2)}, ${this.find("motion").selectedOptions[0].text} at ${this.find("strength-value").textContent}`];
    Object.assign(pen, { fillStyle: style.backgroundColor });
    pen.fillRect(0, 0, picture.width, picture.height);
    pen.drawImage(canvas, 0, 0);
    Object.assign(pen, { fillStyle: style.color, font: `${size}px ${style.fontFamily}` });
    lines.forEach((line, k) => pen.fillText(line, size, canvas.height + (1.6 + 1.7 * k) * size, picture.width - 2 * size));
    picture.toBlob((blob) => this.save(blob, "arch.png"));
  }
  save(blob, name) {
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1e3);
    this.say(`saved as ${name}`);
  }
  /** The arch and what was chosen, in the address of this page. */
  async makeLink() {
    const motion = Number(this.find("motion").value), { isOwn, x, ...rest } = this.live.data.motions[motion], fits = isOwn && x.length <= MAX_LINKED;
    // whole mm/s², joined by a sign that addresses leave as it is
    const record = fits ? { ...rest, y: null, x: x.map((value) => Math.round(1e3 * value)).join("_") } : undefined;
    location.hash = encodeURIComponent(JSON.stringify({ source: this.source, design: this.live.design, motion, record }));
    await navigator.clipboard?.writeText(location.href).catch(() => {});
    const without = [this.live.stage.backdrop ? "the photo" : "", isOwn && !fits ? `your record of ${x.length} values` : ""].filter(Boolean).join(" and ");
    this.say(`The address of this page holds the arch now: copy it.${without ? ` It leaves out ${without}.` : ""}`);
  }
  openLink() {
    let found;
    try { found = JSON.parse(decodeURIComponent(location.hash.slice(1))); } catch { refuse("the link is not complete: copy all of it"); }
    this.startFrom(found.source, found.design);
    if (found.record) {
      const x = found.record.x.split("_").map((value) => Number(value) / 1e3);
      this.addRecord({ ...found.record, x, y: x.map(() => 0) });
    } else {
      const known = this.live.data.motions[found.motion];
      this.find("motion").value = known ? found.motion : 0;
      if (!known) this.say("The record of this link was too long for it: open the record again.", true);
    }
    this.live.design.strength = found.design.strength;
    this.live.change("motion");
  }
}

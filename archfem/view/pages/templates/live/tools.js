// Start from an example, a photo or a drawing; take the arch away as a case, a picture or a link.
"use strict";
const MAX_BYTES = 2e7; // of a file that a reader opens
const MAX_LINKED = 6000; // values of a record that a link holds, about 30 kB
const MARKS = ["the left springing, on the inner side", "the right springing, on the inner side", "the crown, on the inner side", "the crown, on the outer side"];
const ARROWS = { ArrowLeft: [-0.01, 0], ArrowRight: [0.01, 0], ArrowUp: [0, 0.01], ArrowDown: [0, -0.01] }; // [m]
const SHAPES = { circle: "circular_arch", ellipse: "elliptical_arch", pointed: "pointed_arch" };
const UNITS = { 1: "m", 0.01: "cm", 0.001: "mm" };
const MODEL = '\n[model]\nfidelity = "rigid"\ndisplacements = "large"\n\n[analysis]\ndamping = { ratio = 0.05, modes = "effective" }\n';

class Tools {
  constructor(live) {
    const { stage, stage: { canvas } } = live;
    Object.assign(this, { live, source: { example: 0 }, begun: { example: 0 }, marks: [], scaleMarks: [], chosen: [], history: [], number: -1, mode: null, drag: null });
    live.data.arches.forEach(({ name }, k) => this.find("example").append(new Option(name, k)));
    live.reset = () => this.restore();
    const changes = {
      example: ({ value }) => this.startFrom({ example: Number(value) }), kind: () => this.source.drawn && this.drawMarked(),
      photo: () => this.placePhoto(this.find("photo").files[0]),
    };
    for (const name of ["drawing", "unit"]) changes[name] = () => this.openDrawing(this.find("drawing").files[0]);
    for (const name of ["record", "record-unit"]) changes[name] = () => this.openRecord(this.find("record").files[0]);
    const clicks = {
      scale: () => this.begin("scale"), mark: () => this.begin("mark"), "stones-move": () => this.beginMoving(), undo: () => this.undoMove(),
      case: () => this.saveCase(), png: () => this.savePicture(), link: () => this.makeLink(),
      stage: (event) => this.placePoint(stage.pointAt(event)),
    };
    for (const [name, action] of Object.entries(changes)) this.listen(name, "change", ({ target }) => action(target));
    for (const [name, action] of Object.entries(clicks)) this.listen(name, "click", action);
    this.listen("ask", "submit", (event) => { event.preventDefault(); this.setScale(); });
    this.listen("stage", "pointerdown", (event) => this.press(event));
    this.listen("stage", "pointermove", (event) => this.drag?.(stage.pointAt(event)));
    for (const type of ["pointerup", "pointercancel"]) this.listen("stage", type, () => { this.drag = null; });
    this.listen("stage", "keydown", (event) => this.pressKey(event));
    // a tap places a point; a swipe scrolls the page but where it takes hold of something
    canvas.addEventListener("touchstart", (event) => { if (event.touches.length === 1 && this.hold(stage.pointAt(event.touches[0]))) event.preventDefault(); }, { passive: false });
    if (location.hash.length > 1) this.attempt(() => this.openLink());
  }
  find(name) { return this.live.find(name); }
  listen(name, type, action) { this.find(name).addEventListener(type, (event) => this.attempt(() => action(event))); }
  /** Do something; what is wrong is said in words. */
  async attempt(action) {
    try {
      await action();
    } catch (error) {
      this.say(error.message, true);
    }
  }
  say(words, isWrong = false) {
    this.live.say("message", words);
    this.find("message").classList.toggle("doubt", isWrong);
  }
  /** Refuse files that would take long to read. */
  checkSize({ name, size }) {
    if (size > MAX_BYTES) refuse(`${name} has ${(size / 1e6).toFixed(0)} MB: give a file of at most 20 MB`);
  }
  /** What presses on the drawing do: set the scale, mark the arch, move stones, or nothing. */
  setMode(mode) {
    const { live } = this;
    this.mode = mode;
    live.isMarking = mode === "scale" || mode === "mark";
    live.root.classList.toggle("marking", live.isMarking);
    live.stage.canvas.tabIndex = mode === "stones" ? 0 : -1;
    this.find("ask").hidden = mode !== "scale";
    this.find("undo").hidden = mode !== "stones";
  }

  /** Show the arch of a source: an example, a marked ring or outlines; with a design of a link. */
  startFrom(source, design = {}) {
    const { live, live: { stage, data: { arches } } } = this, { outlines, unit, drawn, moved, example } = source;
    const arch = outlines ? assembleOutlines(outlines, unit, arches[0].parameters) : drawn ? assembleRing(drawn, arches[0].parameters) : arches[example];
    this.source = source;
    if (!moved) Object.assign(this, { begun: source, history: [], marks: drawn ? this.marks : [] });
    this.setMode(moved ? this.mode : null);
    if (example === undefined) this.find("example").selectedIndex = -1;
    live.open(arch, design, this.mode === "stones" || (drawn && stage.backdrop) ? stage.box : null);
    if (drawn) this.showHandles(this.marks);
    const supports = arch.bodies.inverse_mass.slice(0, -1).filter(([value]) => value === 0).length;
    this.say(outlines ? `${arch.name}: ${arch.joints.length} joints; ${supports} of its blocks ${supports > 1 ? "are supports" : "is a support"}, which follow${supports > 1 ? "" : "s"} the ground` : "");
  }
  /** The arch before its stones were moved and sliders were used; motion and photo stay. */
  restore() { this.startFrom(this.begun, { strength: this.live.design.strength }); }
  showHandles(points) {
    this.live.stage.handles = points;
    this.live.show(0);
  }

  async placePhoto(file) {
    if (!file) return;
    this.checkSize(file);
    const image = await createImageBitmap(file).catch(() => refuse(`${file.name} is no picture: give a JPEG or a PNG`));
    this.live.stage.backdrop = { image };
    this.isScaled = false;
    this.framePhoto(10 / image.width);
    this.begin("scale");
  }
  framePhoto(metres) {
    const { stage, stage: { backdrop } } = this.live;
    backdrop.metres = metres;
    stage.frame([0, 0, metres * backdrop.image.width, metres * backdrop.image.height]);
  }
  begin(mode) {
    const { stage } = this.live;
    if (!stage.backdrop) refuse("place a photo or an elevation first");
    if (mode === "mark" && !this.isScaled) refuse("this photo has no scale yet: click two points of known distance, and give it in metres");
    this[mode === "scale" ? "scaleMarks" : "marks"] = [];
    this.setMode(mode);
    this.live.root.querySelector("[value=shake]").click();
    this.live.tell();
    this.showHandles([]);
    this.say(mode === "scale" ? "Click two points whose distance you know." : `Click ${MARKS[0]}.`);
    stage.canvas.scrollIntoView({ block: "center" });
  }
  /** Place a point of the scale, of which a third one moves the nearest, or of the arch. */
  placePoint(point) {
    const { scaleMarks: two, marks } = this, far = (place) => distance(place, point);
    if (this.mode === "scale") {
      if (two.length === 2) two[far(two[0]) < far(two[1]) ? 0 : 1] = point; else two.push(point);
      this.showHandles(two);
      this.say(two.length < 2 ? "Click the second point." : "Give their distance below the photo. Another click moves the nearer point.");
      if (two.length === 2) this.find("length").focus();
    } else if (this.mode === "mark" && marks.length < MARKS.length) {
      marks.push(point);
      this.showHandles(marks);
      if (marks.length === MARKS.length) this.drawMarked(); else this.say(`Click ${MARKS[marks.length]}.`);
    }
  }
  setScale() {
    const length = Number(this.find("length").value), [one, other] = this.scaleMarks, { backdrop, scale } = this.live.stage;
    if (!other) refuse("click two points of the photo first");
    if (scale * distance(one, other) < 10 * devicePixelRatio) refuse("the two points are one: click places that are farther apart");
    this.isScaled = true;
    this.framePhoto((backdrop.metres * length) / distance(one, other));
    this.begin("mark");
  }
  /** The ring through the marks; its springings are level. A mark on its outer side gives the thickness, and goes. */
  drawMarked() {
    const [[x0, y0], [x1, y1], [, top], outer] = this.marks, level = 0.5 * (y0 + y1), span = Math.abs(x1 - x0), { design } = this.live;
    if (Math.abs(y1 - y0) > 0.1 * span) refuse(`the springings differ by ${Math.abs(y1 - y0).toFixed(2)} m in height: drag them level, or give the outlines of the stones instead`);
    if (outer && outer[1] - top < 0.01 * span) refuse("the outer side of the crown lies above its inner side: drag the last point up");
    const thickness = outer ? Math.round(200 * (outer[1] - top)) / 200 : design.thickness, { stones, friction, finish, strength } = design;
    const drawn = { kind: this.find("kind").value, span, rise: top - level, thickness, left: [Math.min(x0, x1), level] };
    this.startFrom({ drawn }, this.source.drawn ? { stones, friction, finish, strength } : {});
    this.marks.length = 3;
    this.showHandles(this.marks);
    this.say("Now match the photo: drag the three points; set thickness and number of stones by their sliders.");
  }

  /** Let the reader move stones and corners; those of neighbours go along. */
  beginMoving() {
    if (this.live.isMarking) refuse("mark the arch first, or start from an example");
    this.setMode("stones");
    this.chosen = [];
    this.showMoved(traceStones(this.live.arch));
    this.live.stage.canvas.focus();
    this.say("Drag a stone by its middle, or a corner. Keys: Enter chooses the next stone, arrows move it by 1 cm.");
  }
  undoMove() {
    const before = this.history.pop() ?? refuse("no stone was moved");
    this.chosen = [];
    this.showMoved(before);
  }
  showMoved(outlines) {
    const { friction, finish, strength } = this.live.design;
    this.startFrom({ outlines, unit: 1, file: "stones.geojson", moved: true }, { friction, finish, strength });
    this.choose(this.chosen);
  }
  /** Choose corners, pairs of outline and corner, which moves take along. */
  choose(corners) {
    this.chosen = corners;
    this.showHandles(corners.map(([k, i]) => this.source.outlines[k].points[i]));
  }
  /** Corners at a point, with those of neighbours: of one corner, or of the stone around it. */
  cornersAt(point) {
    const { outlines } = this.source, far = (place) => this.live.stage.scale * distance(place, point);
    const corner = outlines.flatMap(({ points }) => points).reduce((best, each) => (far(each) < far(best) ? each : best));
    const isInside = ({ points }) => sides(points).every(([from, to]) => cross(minus(to, from), minus(point, from)) >= 0);
    const stone = outlines.find(isInside)?.points ?? [], middle = [0, 1].map((k) => stone.reduce((sum, each) => sum + each[k], 0) / stone.length);
    const isCorner = far(corner) < 16 * devicePixelRatio && !(far(middle) < far(corner)); // a stone may be as small as a finger
    return findCorners(outlines, isCorner ? [corner] : stone);
  }
  /** What a press at a point takes hold of, a stone, a corner or a mark: how it moves with the pointer, or null. */
  hold(point) {
    if (this.mode === "stones") {
      const { outlines } = this.source, corners = this.cornersAt(point);
      return corners.length ? (to) => this.showMoved(moveCorners(outlines, corners, minus(to, point))) : null;
    }
    const { marks, live: { stage } } = this, number = marks.findIndex((mark) => stage.scale * distance(mark, point) < 24 * devicePixelRatio);
    const isPlaced = this.mode === "mark" ? marks.length === MARKS.length : this.mode === null;
    return number < 0 || !isPlaced ? null : (to) => { marks[number] = to; this.live.show(0); this.drawMarked(); };
  }
  press(event) {
    const { stage } = this.live, point = stage.pointAt(event);
    this.drag = this.hold(point);
    if (this.drag) stage.canvas.setPointerCapture(event.pointerId);
    if (this.mode !== "stones") return;
    if (this.drag) this.history.push(this.source.outlines);
    this.choose(this.cornersAt(point));
  }
  pressKey(event) {
    const step = ARROWS[event.key], { outlines } = this.source;
    if (this.mode !== "stones" || !(step || event.key === "Enter")) return;
    event.preventDefault();
    if (step) {
      this.history.push(outlines);
      return this.showMoved(moveCorners(outlines, this.chosen, step));
    }
    this.number = (this.number + 1) % outlines.length;
    this.choose(findCorners(outlines, outlines[this.number].points));
    this.say(`stone ${this.number + 1} is chosen`);
  }

  async openDrawing(file) {
    if (!file) return;
    this.checkSize(file);
    const text = await file.text(), unit = Number(this.find("unit").value);
    let outlines = [];
    try { outlines = /\.dxf$/i.test(file.name) ? readDxf(text) : readGeoJson(text); } catch { refuse(`${file.name} cannot be read: give GeoJSON, or DXF as text`); }
    this.startFrom({ outlines, unit, file: file.name });
  }
  async openRecord(file) {
    if (!file) return;
    this.checkSize(file);
    const record = readRecord(await file.text(), file.name, Number(this.find("record-unit").value));
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
    const { live: { design, data, finishes, motion } } = this, { drawn, outlines, unit, file, example } = this.source;
    let text = data.arches[example ?? 0].case;
    if (drawn) text = `title = "a drawn arch"\n\n[structure]\nshape = "${SHAPES[drawn.kind]}"\nspan = ${drawn.span.toFixed(4)}\nrise = ${drawn.rise.toFixed(4)}\nthickness = 0\nvoussoirs = 0\n${MODEL}`;
    if (outlines) text = `title = "a drawing"\n\n[structure]\nshape = "outlines"\nfile = "${file}"  # beside this file\nunit = "${UNITS[unit]}"\nsnap = "3 mm"\n${MODEL}`;
    if (design.stones) text = text.replace(/^thickness = .*$/m, `thickness = ${design.thickness}`).replace(/^voussoirs = .*$/m, `voussoirs = ${design.stones}`);
    const law = finishes.find(({ name }) => name === design.finish);
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
    const { design, given, stage: { canvas: { width, height }, canvas } } = this.live, size = Math.max(width / 60, 12), style = getComputedStyle(document.body);
    const text = (name) => this.find(name).textContent, facts = given.ring ? ["sizes", "weight", "collapse"] : ["weight", "collapse"];
    const lines = [text("verdict"), ...facts.map((name) => `${this.find(name).previousElementSibling.textContent}: ${text(name)}`)];
    lines.push(`${design.thickness ? `thickness ${text("thickness-value")}, ` : ""}friction ${text("friction-value")}, ${this.find("motion").selectedOptions[0].text} at ${text("strength-value")}`);
    const picture = Object.assign(document.createElement("canvas"), { width, height: height + 1.7 * size * (lines.length + 0.6) }), pen = picture.getContext("2d");
    pen.fillStyle = style.backgroundColor;
    pen.fillRect(0, 0, picture.width, picture.height);
    pen.drawImage(canvas, 0, 0);
    Object.assign(pen, { fillStyle: style.color, font: `${size}px ${style.fontFamily}` });
    lines.forEach((line, k) => pen.fillText(line, size, height + 1.7 * size * (k + 1), width - 2 * size));
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
    const { design, stage, motion: { isOwn, x, ...rest } } = this.live, motion = Number(this.find("motion").value), fits = isOwn && x.length <= MAX_LINKED;
    // whole mm/s², joined by a sign that addresses leave as it is
    const record = fits ? { ...rest, y: null, x: x.map((value) => Math.round(1e3 * value)).join("_") } : undefined;
    location.hash = encodeURIComponent(JSON.stringify({ source: this.source, design, motion, record }));
    await navigator.clipboard?.writeText(location.href).catch(() => {});
    const without = [stage.backdrop ? "the photo" : "", isOwn && !fits ? `your record of ${x.length} values` : ""].filter(Boolean).join(" and ");
    this.say(`The address of this page holds the arch now: copy it.${without ? ` It leaves out ${without}.` : ""}`);
  }
  openLink() {
    let found;
    try { found = JSON.parse(decodeURIComponent(location.hash.slice(1))); } catch { refuse("the link is not complete: copy all of it"); }
    const { source, design, motion, record } = found, known = this.live.data.motions[motion];
    if (record) {
      const x = record.x.split("_").map((value) => Number(value) / 1e3);
      this.addRecord({ ...record, x, y: x.map(() => 0) });
    } else this.find("motion").value = known ? motion : 0;
    this.startFrom(source, design);
    if (!record && !known) this.say("The record of this link was too long for it: open the record again.", true);
  }
}

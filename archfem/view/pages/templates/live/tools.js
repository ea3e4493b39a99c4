// Start from an example, a photo or a drawing; take the arch away as a case, a picture or a link.
"use strict";
const MAX_BYTES = 2e7; // of a file that a reader opens
const MAX_LINKED = 6000; // values of a record that a link holds, about 30 kB
const MARKS = ["the left springing, on the inner side", "the right springing, on the inner side", "the crown, on the inner side", "the crown, on the outer side"];
const ARROWS = { ArrowLeft: [-0.01, 0], ArrowRight: [0.01, 0], ArrowUp: [0, 0.01], ArrowDown: [0, -0.01] }; // [m]
const SHAPES = { circle: "circular_arch", ellipse: "elliptical_arch", pointed: "pointed_arch" };
const UNITS = { 1: "m", 0.01: "cm", 0.001: "mm" };
const MODEL = '\n[model]\nfidelity = "rigid"\ndisplacements = "large"\n\n[analysis]\ndamping = { ratio = 0.05, modes = "effective" }\n';
const PAINT = ["fill", "stroke", "stroke-width", "stroke-linecap", "stroke-linejoin", "vector-effect", "opacity"]; // of what a picture shows

class Tools {
  constructor(live) {
    const { root, stage, stage: { svg } } = live;
    Object.assign(this, { live, source: { example: 0 }, begun: { example: 0 }, history: [], number: -1, drag: null });
    live.data.arches.forEach(({ name }, k) => this.find("example").append(new Option(name, k)));
    live.reset = () => this.restore();
    // the page names the method that an element calls with its value
    for (const type of ["click", "change", "submit"]) {
      for (const element of root.querySelectorAll(`[data-${type}]`)) this.listen(element, type, () => this[element.dataset[type]](element.value));
    }
    this.listen(svg, "click", (event) => this.placePoint(stage.pointAt(event)));
    this.listen(svg, "pointerdown", (event) => this.press(event));
    this.listen(svg, "pointermove", (event) => this.drag?.(stage.pointAt(event)));
    for (const type of ["pointerup", "pointercancel"]) this.listen(svg, type, () => { this.drag = null; });
    this.listen(svg, "keydown", (event) => this.pressKey(event));
    // a tap places a point; a swipe scrolls the page but where it takes hold of something
    svg.addEventListener("touchstart", (event) => { if (event.touches.length === 1 && this.hold(stage.pointAt(event.touches[0]))) event.preventDefault(); }, { passive: false });
    if (location.hash.length > 1) this.attempt(() => this.openLink());
  }
  find(name) { return this.live.find(name); }
  listen(element, type, action) { element.addEventListener(type, (event) => this.attempt(() => action(event))); }
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
  /** The file that a reader chose, if any; those that would take long to read are refused. */
  fileOf(name) {
    const [file] = this.find(name).files;
    if (file?.size > MAX_BYTES) refuse(`${file.name} has ${(file.size / 1e6).toFixed(0)} MB: give a file of at most 20 MB`);
    return file;
  }
  /** The points that a reader placed on a photo, or chose of stones. */
  get marks() { return this.live.stage.handles; }
  set marks(points) {
    this.live.stage.handles = points;
    this.live.show(0);
  }
  /** What presses on the drawing do: set the scale, mark the arch, move stones, or nothing. */
  get mode() { return this.live.root.dataset.mode; }
  set mode(mode) {
    this.live.root.dataset.mode = mode;
    this.live.stage.svg.tabIndex = mode ? 0 : -1;
  }

  /** Show the arch of a source: an example, a marked ring or outlines; with a design of a link. */
  startFrom(source, design = {}) {
    const { live, live: { stage, data: { arches: [{ parameters }] } } } = this, { outlines, unit, drawn, moved, example } = source;
    const arch = outlines ? assembleOutlines(outlines, unit, parameters) : drawn ? assembleRing(drawn, parameters) : live.data.arches[example];
    this.source = source;
    if (!moved) Object.assign(this, { begun: source, history: [], mode: "" });
    if (example === undefined) this.find("example").selectedIndex = -1;
    live.open(arch, design, this.drag || this.mode === "stones" || (drawn && stage.photo) ? stage.box : null);
    if (drawn) this.marks = markRing(drawn);
    const count = arch.bodies.mass.filter((_, body) => arch.bodies.inverse_mass[body][0] === 0).length;
    const supports = count > 1 ? "are supports, which follow" : "is a support, which follows";
    this.say(outlines ? `a drawing: ${arch.joints.length} joints; ${count} of its blocks ${supports} the ground` : "");
  }
  startFromExample(number) { this.startFrom({ example: Number(number) }); }
  /** The arch before its stones were moved and sliders were used; motion and photo stay. */
  restore() { this.startFrom(this.begun, { strength: this.live.design.strength }); }

  async openPhoto() {
    const file = this.fileOf("photo"), { stage } = this.live, photo = new Image();
    if (!file) return;
    photo.src = await new Promise((resolve) => { Object.assign(new FileReader(), { onload: ({ target }) => resolve(target.result) }).readAsDataURL(file); });
    await photo.decode().catch(() => refuse(`${file.name} is no picture: give a JPEG or a PNG`));
    this.isScaled = false;
    stage.placePhoto(photo, 10 / photo.naturalWidth);
    this.begin("scale");
  }
  begin(mode) {
    const { root, stage } = this.live;
    if (!stage.photo) refuse("place a photo or an elevation first");
    if (mode === "mark" && !this.isScaled) refuse("this photo has no scale yet: click two points of known distance, and give it in metres");
    this.mode = mode;
    root.querySelector("[value=shake]").click();
    this.live.tell();
    this.marks = stage.cross = [];
    this.say(`Click ${mode === "scale" ? "two points whose distance you know" : MARKS[0]}.`);
    stage.svg.focus({ preventScroll: true });
    stage.svg.scrollIntoView({ block: "center" });
  }
  /** Place a point of the scale, of which a third one moves the nearest, or of the arch. */
  placePoint(point) {
    const { marks, mode } = this, far = (place) => distance(place, point);
    if (mode === "scale") {
      this.marks = marks.length < 2 ? [...marks, point] : far(marks[0]) < far(marks[1]) ? [point, marks[1]] : [marks[0], point];
      if (this.marks.length === 2) this.find("length").focus();
      this.say(this.marks.length < 2 ? "Click the second point." : "Give their distance below the photo. Another click moves the nearer point.");
    } else if (mode === "mark" && marks.length < MARKS.length) {
      this.marks = [...marks, point];
      if (this.marks.length === MARKS.length) this.drawMarked(); else this.say(`Click ${MARKS[this.marks.length]}.`);
    }
  }
  setScale() {
    const { stage } = this.live, [one, other] = this.marks;
    if (!other) refuse("click two points of the photo first");
    if (distance(one, other) < 10 * stage.pixel) refuse("the two points are one: click places that are farther apart");
    this.isScaled = true;
    stage.placePhoto(stage.photo, (stage.metres * this.find("length").valueAsNumber) / distance(one, other));
    this.begin("mark");
  }
  /** The ring through the marks; its springings are level. A mark on its outer side gives the thickness, and goes. */
  drawMarked() {
    const [[x0, y0], [x1, y1], [, top], outer] = this.marks, level = 0.5 * (y0 + y1), span = Math.abs(x1 - x0);
    const { thickness, stones, friction, finish, strength } = this.live.design;
    if (Math.abs(y1 - y0) > 0.1 * span) refuse(`the springings differ by ${Math.abs(y1 - y0).toFixed(2)} m in height: drag them level, or give the outlines of the stones instead`);
    if (outer && outer[1] - top < 0.01 * span) refuse("the outer side of the crown lies above its inner side: drag the last point up");
    const depth = outer ? Math.round(200 * (outer[1] - top)) / 200 : thickness;
    const drawn = { kind: this.find("kind").value, span, rise: top - level, thickness: depth, left: [Math.min(x0, x1), level] };
    this.startFrom({ drawn }, this.source.drawn ? { stones, friction, finish, strength } : {});
    this.say("Now match the photo: drag the three points; set thickness and number of stones by their sliders.");
  }
  changeKind() { if (this.source.drawn) this.drawMarked(); }

  /** Let the reader move stones and corners; those of neighbours go along. */
  beginMoving() {
    if (this.live.isMarking) refuse("mark the arch first, or start from an example");
    this.mode = "stones";
    this.showMoved(traceStones(this.live.arch));
    this.live.stage.svg.focus();
    this.say("Drag a stone by its middle, or a corner. Keys: Enter chooses the next stone, arrows move it by 1 cm.");
  }
  undoMove() { this.showMoved(this.history.pop() ?? refuse("no stone was moved")); }
  /** Show outlines, with the corners that were chosen of them. */
  showMoved(outlines, chosen = []) {
    const { friction, finish, strength } = this.live.design;
    this.startFrom({ outlines, unit: 1, file: "stones.geojson", moved: true }, { friction, finish, strength });
    this.marks = chosen;
  }
  /** Move the corners at some places, of all stones that have them. */
  move(outlines, places, step) {
    const shift = (point) => (places.some((place) => distance(place, point) < TOUCHING) ? plus(point, step) : point);
    this.showMoved(outlines.map(({ points, fixed }) => ({ points: points.map(shift), fixed })), places.map(shift));
  }
  /** The corner at a point, or those of the stone around it. */
  placesAt(point) {
    const { outlines } = this.source, far = (place) => distance(place, point);
    const corner = outlines.flatMap(({ points }) => points).reduce((best, each) => (far(each) < far(best) ? each : best));
    const isInside = ({ points }) => sides(points).every(([from, to]) => cross(minus(to, from), minus(point, from)) >= 0);
    const stone = outlines.find(isInside)?.points ?? [], middle = [0, 1].map((k) => stone.reduce((sum, each) => sum + each[k], 0) / stone.length);
    const isCorner = far(corner) < 16 * this.live.stage.pixel && !(far(middle) < far(corner)); // a stone may be as small as a finger
    return isCorner ? [corner] : stone;
  }
  /** What a press at a point takes hold of, a stone, a corner or a mark: how it moves with the pointer, or null. */
  hold(point) {
    if (this.mode === "stones") {
      const { outlines } = this.source, places = this.placesAt(point);
      return places.length ? (to) => this.move(outlines, places, minus(to, point)) : null;
    }
    const number = this.marks.findIndex((mark) => distance(mark, point) < 24 * this.live.stage.pixel);
    const isPlaced = this.mode === "mark" ? this.marks.length === MARKS.length : this.mode === "";
    return number < 0 || !isPlaced ? null : (to) => { this.marks = this.marks.with(number, to); this.drawMarked(); };
  }
  press(event) {
    const { stage } = this.live, point = stage.pointAt(event);
    this.drag = this.hold(point);
    if (this.drag) stage.svg.setPointerCapture(event.pointerId);
    if (this.mode !== "stones") return;
    if (this.drag) this.history.push(this.source.outlines);
    this.marks = this.placesAt(point);
  }
  pressKey(event) {
    const step = ARROWS[event.key], { outlines } = this.source;
    if (!this.mode || !(step || event.key === "Enter")) return;
    event.preventDefault();
    if (this.live.isMarking) return this.steer(step);
    if (step) {
      this.history.push(outlines);
      return this.move(outlines, this.marks, step);
    }
    this.number = (this.number + 1) % outlines.length;
    this.marks = outlines[this.number].points;
    this.say(`stone ${this.number + 1} is chosen`);
  }

  /** Move a cross over the photo from its middle, by a part of its width; without a step, place a point there. */
  steer(step) {
    const { stage, stage: { box: [left, low, right, high] } } = this.live, [place = [0.5 * (left + right), 0.5 * (low + high)]] = stage.cross;
    if (!step) return this.placePoint(place);
    stage.cross = [plus(place, step.map((part) => 0.5 * part * (right - left)))];
    this.live.show(0);
  }

  async openDrawing() {
    const file = this.fileOf("drawing"), text = await file?.text();
    if (!file) return;
    let outlines = [];
    try { outlines = /\.dxf$/i.test(file.name) ? readDxf(text) : readGeoJson(text); } catch { refuse(`${file.name} cannot be read: give GeoJSON, or DXF as text`); }
    this.startFrom({ outlines, unit: Number(this.find("unit").value), file: file.name });
  }
  async openRecord() {
    const file = this.fileOf("record");
    if (!file) return;
    const record = readRecord(await file.text(), file.name, Number(this.find("record-unit").value));
    this.addRecord(record);
    this.live.change(this.find("motion"));
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
  /** The picture, with what the page says of it. */
  async savePicture() {
    const { root, stage: { svg } } = this.live, box = svg.getBoundingClientRect(), [width, height] = [box.width, box.height].map((size) => size * devicePixelRatio);
    const copy = svg.cloneNode(true), drawn = new Image(), own = svg.querySelectorAll("*");
    copy.querySelectorAll("*").forEach((part, k) => { for (const name of PAINT) part.style[name] = getComputedStyle(own[k])[name]; });
    Object.entries({ width, height }).forEach((each) => copy.setAttribute(...each));
    drawn.src = `data:image/svg+xml,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
    await drawn.decode();
    const words = (rows) => [...root.querySelectorAll(rows)].map((row) => [...row.children].map((each) => each.selectedOptions?.[0].text ?? each.textContent).filter(Boolean).join(": "));
    const choices = words(".live-controls > label:not([hidden])"), [arch, shaking] = [choices.slice(0, -2), choices.slice(-2)].map((each) => each.join(", "));
    const lines = [this.find("verdict").textContent, ...words(".facts div:not([hidden])"), arch, shaking];
    const size = Math.max(width / 60, 12), style = getComputedStyle(document.body);
    const picture = Object.assign(document.createElement("canvas"), { width, height: height + 1.7 * size * (lines.length + 0.6) }), pen = picture.getContext("2d");
    pen.fillStyle = style.backgroundColor;
    pen.fillRect(0, 0, picture.width, picture.height);
    pen.drawImage(drawn, 0, 0);
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
    const without = [stage.photo ? "the photo" : "", isOwn && !fits ? `your record of ${x.length} values` : ""].filter(Boolean).join(" and ");
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

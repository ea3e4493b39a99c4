// The page: the arch that archfem computed, what the reader changes, and what follows from it.
"use strict";
const G = 9.81, RUNS = 20;
const SPREAD = { friction: 0.05, strength: 0.02, thickness: 0.01 }; // of similar arches, relative
const PLASTIC = [0.8191725, 0.6710436, 0.5497005]; // shares that spread three properties evenly (R3 sequence)

/** A motion of the reader's choice at a strength in g: recorded, a steady push, or a table that tilts. */
function makeMotion(given, strength) {
  if (given.x) return { motion: given, scale: strength === given.strength ? 1 : (strength * G) / given.peak };
  const dt = 0.01, tilt = Math.atan(strength), shares = range(801).map((k) => Math.min(k * dt, 6) / 6);
  const pull = (share) => (given.kind === "push" ? [-share * strength, 0] : [-Math.sin(share * tilt), Math.cos(share * tilt) - 1]);
  const [x, y] = [0, 1].map((axis) => shares.map((share) => G * pull(share)[axis]));
  return { motion: { dt, x, y }, scale: 1 };
}

/** Let a swipe that begins on a slider scroll the page: the slider waits until a finger moves along it, or taps. */
function awaitDirection(slider) {
  let touch = null; // of which the direction is open: its place, and the values before and after
  const release = () => {
    const { before, after } = touch;
    touch = null;
    slider.value = after;
    if (after !== before) slider.dispatchEvent(new Event("input", { bubbles: true }));
  };
  const listen = (type, action) => slider.addEventListener(type, (event) => { if (touch) action(event); });
  slider.addEventListener("pointerdown", ({ pointerType, clientX, clientY }) => {
    touch = pointerType === "touch" ? { x: clientX, y: clientY, before: slider.value, after: slider.value } : null;
  });
  listen("input", (event) => {
    touch.after = slider.value;
    slider.value = touch.before;
    event.stopImmediatePropagation();
  });
  listen("pointermove", ({ clientX, clientY }) => { if (Math.abs(clientX - touch.x) > 8 + Math.abs(clientY - touch.y)) release(); });
  listen("pointerup", release);
  listen("pointercancel", () => { touch = null; }); // the page scrolls
}

class Live {
  constructor(root, data) {
    Object.assign(this, { root, data, runs: [], workers: {}, time: 0, view: "shake", stage: new Stage(root.querySelector("#stage")) });
    const scripts = ["engine", "statics", "worker"].map((name) => document.querySelector(`#${name}-script`).textContent);
    this.script = URL.createObjectURL(new Blob([scripts.join("\n")], { type: "text/javascript" }));
    this.sliders = root.querySelectorAll(".live-controls [type=range]");
    root.querySelectorAll("[type=range]").forEach(awaitDirection);
    root.querySelector(".live-controls").addEventListener("input", ({ target }) => this.change(target));
    this.find("reset").addEventListener("click", () => this.reset());
    this.find("time").addEventListener("input", () => this.pause(this.find("time").valueAsNumber));
    this.find("play").addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    root.querySelector(".live-tabs").addEventListener("input", ({ target }) => { this.view = target.value; this.pause(); });
    this.open(data.arches[0]);
  }
  find(name) { return this.root.querySelector(`#${name}`); }
  say(name, words) { this.find(name).textContent = words; }
  /** Whether the reader places points on a photo. */
  get isMarking() { return /scale|mark/.test(this.root.dataset.mode); }
  /** The motion that the reader chose. */
  get motion() { return this.data.motions[this.find("motion").value]; }

  /** Give a task to a worker of its own, so that the page stays alive; the one before it ends. */
  assign(name, task, receive) {
    this.workers[name]?.terminate();
    const worker = this.workers[name] = new Worker(this.script);
    worker.onmessage = ({ data }) => receive(data);
    worker.postMessage(task);
  }

  /** Begin with an arch as it was given. */
  open(given, changes = {}, box = null) {
    const { ring } = this.given = given, friction = Math.min(...given.joints.map((joint) => joint.friction));
    this.original = { thickness: ring?.thickness ?? null, stones: ring?.stones ?? null, friction, finish: "" };
    this.design = { ...this.original, strength: null, ...changes };
    this.finishes = given.finishes ?? this.data.arches[0].finishes;
    this.stage.handles = [];
    if (!("strength" in changes)) this.find("motion").value = 0;
    for (const name of ["thickness", "stones"]) this.find(name).closest("label").hidden = !ring;
    for (const name of ["least", "sizes"]) this.find(name).parentElement.hidden = !ring;
    if (ring) Object.assign(this.find("thickness"), { min: (0.2 * ring.thickness).toPrecision(2), max: (2 * ring.thickness).toPrecision(2) });
    this.stage.fit(given, box);
    this.change();
  }
  /** The arch as it was given, under the motion of the reader's choice. */
  reset() { this.open(this.given, { strength: this.design.strength }); }
  /** The design changed: arch, statics and runs anew; the finish of joints does not change the runs. */
  change({ id, value } = {}) {
    const { design } = this;
    if (id === "motion") design.strength = null;
    else if (id) design[id] = id === "finish" ? value : Number(value);
    this.arch = this.build(design);
    this.solveStatics();
    const { strength, often } = this.motion; // its own, or one near that which brings the arch down
    design.strength ??= strength ?? Math.min(Math.max(Math.round(100 * often * this.statics.weakest.factor) / 100, 0.05), 2);
    this.showDesign();
    this.tellStatics();
    this.askPush();
    if (id !== "finish") this.run();
    this.pause(0);
  }
  /** The arch of a design; archfem's own arrays where nothing but friction differs. */
  build(design, thinner = 1) {
    const { given, original } = this, ratio = design.friction / original.friction, { ring, parameters } = given;
    if (ring && !(thinner === 1 && design.thickness === original.thickness && design.stones === original.stones)) {
      return cutRing(ring, { factor: (thinner * design.thickness) / ring.thickness, stones: design.stones, friction: design.friction }, parameters);
    }
    if (ratio === 1) return given;
    const bodies = { ...given.bodies, friction: given.bodies.friction.map((row) => row.map((value) => value * ratio)) };
    return { ...given, bodies, joints: given.joints.map((joint) => ({ ...joint, friction: joint.friction * ratio })) };
  }
  showDesign() {
    const { design, motion: { kind, strength } } = this, tilt = (Math.atan(design.strength) * 180) / Math.PI;
    this.find("finish").value = design.finish;
    this.find("strength").max = Math.max(2, design.strength); // a record may be stronger
    for (const slider of this.sliders) {
      const value = design[slider.id], digits = slider.step.replace(/^\d*\.?/, "").length;
      if (value === null) continue;
      slider.value = value;
      this.say(`${slider.id}-value`, `${value.toFixed(digits)}${slider.dataset.unit}`);
    }
    if (kind === "tilt" || strength) this.say("strength-value", strength ? `${design.strength.toFixed(2)} g (${(design.strength / strength).toFixed(2)} × as recorded)` : `${tilt.toFixed(0)}°`);
  }

  /** Thrust lines, collapse acceleration and the joints that close. */
  solveStatics() {
    const { design, given, arch, original, finishes } = this, equilibrium = new Equilibrium(arch), { joints } = equilibrium;
    const weakest = equilibrium.weakest(), stands = weakest.factor >= 0, law = finishes.find(({ name }) => name === design.finish);
    const isGiven = given.thrust && Object.keys(original).every((name) => design[name] === original[name]);
    const settled = law ? new ClosingJoints(arch, law).rest() : null;
    const resting = settled?.lines ?? (isGiven ? given.thrust : equilibrium.thrust(0));
    const pushed = stands && weakest.factor < Infinity ? equilibrium.thrust(weakest.side * weakest.factor) : null;
    // a thrust line is drawn through the stones that have two joints
    const pairs = arch.bodies.inverse_mass.map(([free], body) => range(joints.length).filter((j) => free && joints[j].blocks.includes(body)));
    const links = pairs.filter((own) => own.length === 2);
    const trace = (values) => (values ? links.map((link) => link.map((j) => crossing(joints[j], values[j]))) : []);
    // a joint turns about its extrados where M > 0
    const hinges = weakest.hinges.map(({ joint, sign }) => joints[joint].ends[sign > 0 ? 1 : 0]);
    this.statics = { weakest, stands, settled, law, isGiven, resting, weight: trace(resting), push: trace(pushed), hinges };
  }
  tellStatics() {
    const { design, given, arch } = this, { weakest: { factor, side, hinges, slides }, stands, settled, law, isGiven, resting } = this.statics;
    const most = resting ? Math.max(...resting.map(Math.abs)) : NaN, percent = Math.round(100 * (1 - 2 * most));
    const millimetres = (value, digits) => `${(1e3 * value).toFixed(digits)} mm`;
    this.say("collapse", !stands ? "it does not stand by itself" : factor === Infinity ? "none: it leans on nothing" : `${factor.toFixed(3)} g, pushed to the ${side > 0 ? "right" : "left"}`);
    this.say("weight", !stands ? "it falls" : percent >= 0 ? `it stands: its thrust line keeps ${percent} % of half the thickness from the faces` : "it stands");
    this.say("line", percent >= 0 ? `max |e| = ${most.toFixed(3)}`
      : stands ? "none is drawn: some joints bear nothing, or too many share the weight"
      : "none: no line stays within the stones and within the friction of all joints");
    const list = (what, own, s = own.length > 1 ? "s" : "") => (own.length ? [`${own.length} ${what}${s}: joint${s} ${own.map(({ joint }) => joint).join(", ")}`] : []);
    this.say("mechanism", [...list("hinge", hinges), ...list("slide", slides)].join("; ") || "none");
    const moved = settled && farthest(settled.q, settled.q.map(() => 0), arch.bodies.reach);
    this.say("closing", settled ? `under its own weight joints close by up to ${millimetres(settled.closing, 3)}, and stones move by up to ${millimetres(moved, 2)}`
      : law ? "on joints that close this arch slides or falls by its own weight; hard joints are shown"
      : isGiven ? "as in the analysis of archfem" : "hard: faces meet at once, and do not close further");
    if (!given.ring) return;
    const inner = arch.joints.map(({ ends }) => ends[0]), [one, other] = [inner[0], inner.at(-1)], rise = Math.max(...inner.map(([, y]) => y)) - Math.min(one[1], other[1]);
    this.say("sizes", `${distance(one, other).toFixed(2)} m and ${rise.toFixed(2)} m`);
    const least = leastThickness(given.ring, { stones: design.stones, friction: design.friction }, given.parameters);
    this.say("least", Number.isNaN(least) ? "it does not stand at any" : `${(least * given.ring.thickness).toFixed(3)} m`);
  }
  /** Ask a worker for the push that joints of a finish bear, which is said beside that of hard ones. */
  askPush() {
    const { law, settled, weakest: { factor } } = this.statics;
    this.workers.push?.terminate();
    if (!settled || factor === Infinity) return;
    this.assign("push", { closing: { arch: this.arch, law, q: settled.q, factor } }, ([right, left]) => {
      this.say("collapse", `${Math.min(right, left).toFixed(3)} g, pushed to the ${right <= left ? "right" : "left"}; ${factor.toFixed(3)} g with hard joints`);
    });
  }

  /** Shake the arch, and similar ones. */
  run() {
    const { design, data } = this, { motion, scale } = makeMotion(this.motion, design.strength), count = Math.min(navigator.hardwareConcurrency || 1, 4);
    const runs = range(RUNS).map((k) => {
      const [one, two, three] = PLASTIC.map((share) => (k ? 2 * ((0.5 + k * share) % 1) - 1 : 0));
      const arch = this.build({ ...design, friction: design.friction * (1 + SPREAD.friction * one) }, 1 + SPREAD.thickness * three);
      return { number: k, arch, scale: scale * (1 + SPREAD.strength * two) };
    });
    this.runs = [];
    const receive = ({ number, run }) => {
      this.runs[number] = run;
      this.tell();
      this.show(this.time);
    };
    const hand = (worker, own, answer) => this.assign(worker, { engine: data.engine, runs: own, motion }, answer);
    for (const worker of range(count)) this.workers[worker]?.terminate();
    // the arch that is drawn has the processor to itself
    hand(0, runs.slice(0, 1), (first) => {
      receive(first);
      for (const worker of range(count)) hand(worker, runs.slice(1).filter(({ number }) => number % count === worker), receive);
    });
    const peak = this.statics.weakest.factor * G, first = motion.x.findIndex((value) => Math.abs(value * scale) >= peak);
    this.say("critical", first < 0 ? "The ground never pushes that hard." : `The ground first pushes that hard at ${(first * motion.dt).toFixed(2)} s; it must do so long enough for the hinges to open.`);
    this.drawGround(motion, scale);
    this.tell();
  }
  /** Outcome in words. */
  tell() {
    const done = this.runs.filter(Boolean), answers = done.filter((run) => !run.failure), fallen = answers.filter((run) => run.fell !== null).length, [own] = this.runs;
    const more = done.length < RUNS ? `; ${RUNS - done.length} more follow` : "", millimetres = 1e3 * own?.displacement;
    this.root.dataset.runs = done.length;
    this.say("share", answers.length ? `${fallen} of ${answers.length}${more}` : "…");
    if (this.isMarking) return this.say("verdict", "Mark your arch on the photo.");
    if (!own || own.failure) return this.say("verdict", own ? `It cannot be followed: ${own.failure}` : "Shaking …");
    const fate = own.fell === null ? `stands; stones move by up to ${millimetres.toFixed(millimetres < 1 ? 2 : 0)} mm.` : `falls; the first stone is lost at ${own.fell.toFixed(2)} s.`;
    const how = fallen === 0 ? "none fall" : fallen === answers.length ? "all fall" : `${fallen} ${fallen === 1 ? "falls" : "fall"}`;
    const others = answers.length < 2 ? "Shaking similar ones …" : `Of ${answers.length} similar arches ${how}${more}.`;
    this.say("verdict", `${this.motion.name}, ${this.find("strength-value").textContent}: this arch ${fate} ${others}`);
  }
  drawGround({ dt, x }, scale) {
    const most = x.reduce((largest, value) => Math.max(largest, Math.abs(value)), 1e-9), every = Math.max(1, Math.floor(x.length / 1500));
    this.find("time").max = this.end = (x.length - 1) * dt + EXTRA_TIME;
    const points = x.filter((_, k) => k % every === 0).map((value, k) => `${((1000 * k * every * dt) / this.end).toFixed(1)} ${(30 - (28 * value) / most).toFixed(1)}`);
    this.find("ground").setAttribute("d", `M${points.join("L")}`);
    this.say("ground-name", `ground acceleration, up to ${((most * scale) / G).toFixed(2)} g`);
  }

  /** Draw an instant. */
  show(time) {
    const { stage, statics, view, arch: { bodies } } = this, begins = time === 0;
    this.time = this.find("time").value = time;
    if (this.isMarking) return stage.draw({ handles: [...stage.handles, ...stage.cross] });
    const at = ({ frames, spacing }) => frames[Math.min(Math.round(time / spacing), frames.length - 1)];
    const [own, ...others] = view === "shake" ? range(RUNS).map((k) => (this.runs[k]?.frames ? at(this.runs[k]) : undefined)) : [];
    const lines = view === "push" ? statics.push : view === "weight" || begins ? statics.weight : [], hinges = view === "push" ? statics.hinges : [];
    stage.draw({ bodies, poses: own, ghosts: begins ? [] : others.filter(Boolean), lines, hinges, handles: begins ? stage.handles : [] });
    this.say("clock", view === "shake" ? `t = ${time.toFixed(2)} s` : "");
    this.find("cursor").setAttribute("x", (1000 * time) / this.end);
    const seen = { shake: `at ${time.toFixed(2)} s`, weight: "under its own weight, with its thrust line", push: "at the push that brings it down, with its hinges" };
    this.find("stage").setAttribute("aria-label", `the arch ${seen[view]}`);
  }
  play() {
    this.root.querySelector("[value=shake]").click();
    if (this.time >= this.end) this.show(0);
    this.playing = true;
    this.say("play", "❚❚ pause");
    let last = performance.now();
    const tick = (now) => {
      if (!this.playing) return;
      // the time of a frame may be before the click that started it
      this.show(Math.min(this.time + (Math.max(now - last, 0) / 1e3) * Number(this.find("speed").value), this.end));
      last = now;
      if (this.time >= this.end) this.pause(); else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }
  /** Stop at an instant. */
  pause(time = this.time) {
    this.playing = false;
    this.say("play", "▶ shake it");
    this.show(time);
  }
}

const ready = (async () => {
  const root = document.querySelector(".arch");
  try {
    const data = JSON.parse(new TextDecoder().decode(await inflate(root.querySelector("#data").textContent)));
    data.engine = { module: await WebAssembly.compile(await inflate(data.wasm)), leaves: data.leaves };
    root.live = new Live(root, data);
    root.dataset.ready = "yes";
    return root.live;
  } catch (error) {
    root.querySelector("#verdict").textContent = typeof DecompressionStream === "undefined" ? "This browser is too old for the page (it has no DecompressionStream)." : `The page failed: ${error.message}`;
    throw error;
  }
})();

// The page: the arch that archfem computed, what the reader changes, and what follows from it.
"use strict";
const G = 9.81, RUNS = 20;
const SPREAD = { friction: 0.05, strength: 0.02, thickness: 0.01 }; // of slightly different arches, relative
const PLASTIC = [0.8191725, 0.6710436, 0.5497005]; // shares that spread three properties evenly (R3 sequence)

/** A motion of the reader's choice at a strength in g: recorded, a steady push, or a table that tilts. */
function makeMotion(given, strength) {
  if (given.x) return { motion: given, scale: strength === given.strength ? 1 : (strength * G) / given.peak };
  const dt = 0.01, samples = [...new Array(801).keys()].map((k) => Math.min(k * dt, 6) / 6);
  const tilt = Math.atan(strength);
  if (given.kind === "push") return { motion: { dt, x: samples.map((share) => -share * strength * G), y: samples.map(() => 0) }, scale: 1 };
  return { motion: { dt, x: samples.map((share) => -G * Math.sin(share * tilt)), y: samples.map((share) => G * (Math.cos(share * tilt) - 1)) }, scale: 1 };
}

class Live {
  constructor(root, data) {
    Object.assign(this, { root, data, runs: [], job: 0, time: 0, view: "shake" });
    this.stage = new Stage(this.find("stage"));
    this.startWorkers();
    data.motions.forEach(({ name }, k) => this.find("motion").append(new Option(name, k)));
    for (const name of ["thickness", "stones", "friction", "strength", "finish"]) this.find(name).addEventListener("input", () => this.change(name));
    this.find("motion").addEventListener("input", () => { this.design.strength = this.suggest(data.motions[this.find("motion").value]); this.change("motion"); });
    this.find("reset").addEventListener("click", () => this.reset());
    this.find("time").addEventListener("input", () => { this.pause(); this.show(Number(this.find("time").value)); });
    this.find("play").addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    for (const tab of root.querySelectorAll("[name=view]")) tab.addEventListener("input", () => { this.view = tab.value; this.pause(); this.show(this.time); });
    this.open(data.arches[0]);
  }
  find(name) { return this.root.querySelector(`#${name}`); }
  say(name, words) { this.find(name).textContent = words; }

  /** Runs go to workers, so that the page stays alive. */
  startWorkers() {
    const text = ["engine", "statics", "worker"].map((name) => document.querySelector(`#${name}-script`).textContent).join("\n");
    const address = URL.createObjectURL(new Blob([text], { type: "text/javascript" })), count = Math.min(navigator.hardwareConcurrency || 1, 4);
    const receive = ({ data: { job, asked, number, run, failure, push } }) => {
      if (push && asked === this.asked) this.tellPush(push);
      if (job !== this.job) return;
      this.runs[number] = run ?? { failure };
      this.tell();
      this.show(this.time);
    };
    this.workers = [...new Array(count)].map(() => new Worker(address));
    for (const worker of this.workers) {
      worker.onmessage = receive;
      worker.postMessage({ start: { wasm: this.data.wasm, leaves: this.data.leaves } });
    }
  }

  /** The strength at which a motion begins: its own, or near that which brings the arch down. */
  suggest({ strength, kind }) {
    const often = kind ? 1.05 : 2.7; // short pushes of an earthquake must be stronger than a steady one
    return strength ?? Math.min(Math.max(Math.round(100 * often * this.factor) / 100, 0.05), 2);
  }
  /** Begin with an arch as it was given. */
  open(given, changes = {}, box = null) {
    const { ring } = this.given = given;
    this.design = { thickness: ring?.thickness ?? null, stones: ring?.stones ?? null, strength: 0, finish: "" };
    this.factor = new Equilibrium(given).weakest().factor;
    this.design.strength = this.suggest(this.data.motions[0]);
    this.design.friction = Math.min(...given.joints.map((joint) => joint.friction));
    this.original = { ...this.design };
    Object.assign(this.design, changes);
    this.finishes = given.finishes ?? this.data.arches[0].finishes;
    this.find("finish").replaceChildren(new Option(given.thrust ? "as given" : "hard: faces meet at once", ""), ...this.finishes.map(({ name }) => new Option(name, name)));
    this.stage.handles = [];
    if (!("strength" in changes)) this.find("motion").value = 0;
    for (const name of ["thickness", "stones"]) this.find(name).closest("label").hidden = !ring;
    if (ring) Object.assign(this.find("thickness"), { min: (0.2 * ring.thickness).toPrecision(2), max: (2 * ring.thickness).toPrecision(2), step: 0.005 });
    this.stage.fit(given, box);
    this.change();
  }
  /** The arch as it was given, under the motion of the reader's choice. */
  reset() { this.open(this.given, { strength: this.design.strength }, this.stage.backdrop && this.stage.box); }
  /** The design changed: arch, statics and runs anew; the finish of joints does not change the runs. */
  change(name) {
    if (name && name !== "motion") this.design[name] = name === "finish" ? this.find(name).value : Number(this.find(name).value);
    this.pause();
    this.time = 0;
    this.arch = this.build(this.design);
    this.find("time").value = 0;
    this.showDesign();
    this.solveStatics();
    this.askPush();
    if (name !== "finish") this.run();
    this.show(0);
  }
  isAsGiven(names) { return names.every((name) => this.design[name] === this.original[name]); }
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
    const { design } = this, words = { thickness: (value) => `${value.toFixed(3)} m`, stones: String, friction: (value) => value.toFixed(2), strength: (value) => `${value.toFixed(2)} g` };
    this.find("finish").value = design.finish;
    for (const [name, say] of Object.entries(words)) {
      if (design[name] === null) continue;
      if (name === "strength") this.find(name).max = Math.max(2, design[name]); // a record may be stronger
      this.find(name).value = design[name];
      this.say(`${name}-value`, say(design[name]));
    }
    const tilts = this.data.motions[this.find("motion").value].kind === "tilt";
    if (tilts) this.say("strength-value", `${((Math.atan(design.strength) * 180) / Math.PI).toFixed(0)}°`);
  }

  /** Thrust lines, collapse acceleration and least thickness. */
  solveStatics() {
    const { design, given, arch } = this, own = this.isAsGiven(["thickness", "stones", "friction"]), law = this.finishes.find(({ name }) => name === design.finish);
    const equilibrium = new Equilibrium(arch), weakest = equilibrium.weakest(), stands = weakest.factor >= 0;
    const trace = (values) => equilibrium.joints.map((joint, j) => crossing(joint, values[j]));
    const settled = law ? new ClosingJoints(arch, law).rest() : null, hard = own && given.thrust && !law ? given.thrust : equilibrium.thrust(0);
    const resting = settled?.lines ?? hard, pushed = stands && weakest.factor < Infinity ? equilibrium.thrust(weakest.side * weakest.factor) : null;
    const links = (values) => (values ? this.chains(equilibrium.joints).map((chain) => chain.map((j) => trace(values)[j])) : []);
    this.statics = { stands, settled, law, factor: weakest.factor, weight: links(resting), push: links(pushed), hinges: weakest.hinges.map(({ joint, sign }) => hingePoint(equilibrium.joints[joint], sign)) };
    const most = resting ? Math.max(...resting.map(Math.abs)) : NaN, percent = Math.round(100 * (1 - 2 * most));
    this.say("collapse", !stands ? "it does not stand by itself" : weakest.factor === Infinity ? "none: it leans on nothing" : `${weakest.factor.toFixed(3)} g, pushed to the ${weakest.side > 0 ? "right" : "left"}`);
    this.say("line", percent >= 0 ? `${percent} % of half the thickness is left (max |e| = ${most.toFixed(3)})` : "none: no line stays within the stones and within the friction of all joints");
    this.say("weight", stands ? `it stands${percent >= 0 ? `: ${percent} % of half the thickness is left` : ""}` : "it falls");
    this.say("sizes", this.measureOpening());
    const list = (what, own) => (own.length ? `${own.length} ${what}${own.length > 1 ? "s" : ""}: joint${own.length > 1 ? "s" : ""} ${own.map(({ joint }) => joint).join(", ")}` : "");
    this.say("mechanism", [list("hinge", weakest.hinges), list("slide", weakest.slides)].filter(Boolean).join("; ") || "none");
    this.say("closing", settled ? `under its own weight joints close by up to ${(1e3 * settled.closing).toFixed(3)} mm, and stones move by up to ${(1e3 * farthest(settled.q, settled.q.map(() => 0), arch.bodies.reach)).toFixed(2)} mm` : law ? "on joints that close this arch slides or falls by its own weight; hard joints are shown" : own && given.thrust ? "as in the analysis of archfem" : "hard: faces meet at once, and do not close further");
    if (given.ring) {
      const factor = leastThickness(given.ring, { stones: design.stones, friction: design.friction }, given.parameters);
      this.say("least", Number.isNaN(factor) ? "it does not stand at any" : `${(factor * given.ring.thickness).toFixed(3)} m`);
    }
    this.find("least").parentElement.hidden = !given.ring;
  }
  /** Clear span and rise of a ring, along its inner side. */
  measureOpening() {
    if (!this.given.ring) return "–";
    const inner = this.arch.joints.map(({ ends }) => ends[0]), [one, other] = [inner[0], inner.at(-1)];
    return `${Math.hypot(other[0] - one[0], other[1] - one[1]).toFixed(2)} m and ${(Math.max(...inner.map(([, y]) => y)) - Math.min(one[1], other[1])).toFixed(2)} m`;
  }
  /** Ask a worker for the push that joints of a finish bear. */
  askPush() {
    const { law, settled, factor } = this.statics;
    this.asked = (this.asked ?? 0) + 1;
    if (settled && factor < Infinity) this.workers[0].postMessage({ asked: this.asked, closing: { arch: this.arch, law, q: settled.q, factor } });
  }
  /** The push that joints of a finish bear, beside that of hard ones. */
  tellPush(pushes) {
    const { factor } = this.statics, weaker = pushes[0] <= pushes[1] ? 0 : 1;
    this.say("collapse", `${pushes[weaker].toFixed(3)} g, pushed to the ${weaker ? "left" : "right"}; ${factor.toFixed(3)} g with hard joints`);
  }
  /** Joints in rows from stone to stone, along which a thrust line is drawn. */
  chains(joints) {
    const links = [];
    const free = (body) => this.arch.bodies.inverse_mass[body][0] > 0, at = new Map();
    joints.forEach(({ blocks }, j) => blocks.filter(free).forEach((body) => at.set(body, [...(at.get(body) ?? []), j])));
    for (const own of at.values()) if (own.length === 2) links.push(own);
    return links;
  }

  /** Shake the arch, and others that differ slightly. */
  run() {
    const { design } = this, chosen = this.data.motions[this.find("motion").value], { motion, scale } = makeMotion(chosen, design.strength);
    const runs = [...new Array(RUNS).keys()].map((k) => {
      const [one, two, three] = PLASTIC.map((share) => (k ? 2 * ((0.5 + k * share) % 1) - 1 : 0));
      return { number: k, arch: this.build({ ...design, friction: design.friction * (1 + SPREAD.friction * one) }, 1 + SPREAD.thickness * three), scale: scale * (1 + SPREAD.strength * two) };
    });
    this.runs = [];
    this.job += 1;
    this.workers.forEach((worker, k) => worker.postMessage({ job: this.job, runs: runs.filter(({ number }) => number % this.workers.length === k), motion }));
    const peak = this.statics.factor * G, first = motion.x.findIndex((value) => Math.abs(value * scale) >= peak);
    this.say("critical", first < 0 ? "The ground never pushes that hard." : `The ground first pushes that hard at ${(first * motion.dt).toFixed(2)} s; it must do so long enough for the hinges to open.`);
    this.drawGround(motion, scale);
    this.tell();
  }
  /** Outcome in words. */
  tell() {
    const done = this.runs.filter(Boolean), answers = done.filter((run) => !run.failure), fallen = answers.filter((run) => run.fell !== null).length, [own] = this.runs;
    const all = done.length === RUNS, share = `${fallen} of ${answers.length}`;
    this.say("share", all ? share : answers.length ? `${share} so far` : "…");
    const fate = own && (own.fell === null ? `Shaken, this arch stands; a stone moves by up to ${(1e3 * own.displacement).toFixed(own.displacement < 1e-3 ? 2 : 0)} mm.` : `Shaken, this arch falls: the first stone is lost at ${own.fell?.toFixed(2)} s.`);
    const how = fallen === 0 ? "none fall" : fallen === answers.length ? "all fall" : `${fallen} ${fallen === 1 ? "falls" : "fall"}`;
    const others = answers.length < 2 ? "Shaking slightly different ones …" : `Of ${answers.length} slightly different arches${all ? "" : " so far"}, ${how}.`;
    if (this.isMarking) return this.say("verdict", "Mark your arch on the photo.");
    this.say("verdict", !own ? "Shaking …" : own.failure ? `It cannot be followed: ${own.failure}` : `${fate} ${others}`);
    this.root.dataset.runs = done.length;
  }
  drawGround({ dt, x }, scale) {
    const most = x.reduce((largest, value) => Math.max(largest, Math.abs(value)), 1e-9), every = Math.max(1, Math.floor(x.length / 1500)), end = (x.length - 1) * dt + EXTRA_TIME;
    this.find("time").max = this.end = end;
    const points = x.filter((_, k) => k % every === 0).map((value, k) => `${((1000 * k * every * dt) / end).toFixed(1)} ${(30 - (28 * value) / most).toFixed(1)}`);
    this.find("ground").setAttribute("d", `M${points.join("L")}`);
    this.say("ground-name", `ground acceleration, up to ${((most * scale) / G).toFixed(2)} g`);
  }

  /** Draw an instant. */
  show(time) {
    this.time = time;
    this.find("time").value = time;
    if (this.isMarking) return; // a reader places points on a photo
    const at = ({ frames, spacing }) => frames[Math.min(Math.round(time / spacing), frames.length - 1)];
    const still = new Float64Array(3 * this.arch.bodies.mass.length), shaken = this.view === "shake", ready = this.runs.filter((run) => run?.frames);
    const poses = shaken && this.runs[0]?.frames ? at(this.runs[0]) : still, begins = time === 0;
    const lines = (this.view === "push" ? this.statics.push : this.view === "weight" || begins ? this.statics.weight : []).map((points) => ({ points, kind: "thrust" }));
    this.stage.draw({ arch: this.arch, poses, ghosts: shaken && !begins ? ready.slice(1).map(at) : [], lines, hinges: this.view === "push" ? this.statics.hinges : [], handles: begins ? this.stage.handles : [] });
    this.say("clock", shaken ? `t = ${time.toFixed(2)} s` : "");
    this.find("cursor").setAttribute("x", (1000 * time) / this.end);
    this.find("stage").setAttribute("aria-label", `the arch ${{ shake: `at ${time.toFixed(2)} s`, weight: "under its own weight, with its thrust line", push: "at the push that brings it down, with its hinges" }[this.view]}`);
  }
  play() {
    const { end } = this;
    if (this.view !== "shake") this.root.querySelector("[value=shake]").click();
    if (this.time >= end) this.show(0);
    this.playing = true;
    this.say("play", "❚❚ pause");
    let last = performance.now();
    const tick = (now) => {
      if (!this.playing) return;
      // the time of a frame may be before the click that started it
      this.show(Math.min(this.time + (Math.max(now - last, 0) / 1e3) * Number(this.find("speed").value), end));
      last = now;
      if (this.time >= end) this.pause(); else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }
  pause() {
    this.playing = false;
    this.say("play", "▶ shake it");
  }
}

const ready = (async () => {
  const root = document.querySelector(".arch");
  try {
    const data = JSON.parse(new TextDecoder().decode(await inflate(root.querySelector("#data").textContent)));
    data.wasm = await inflate(data.wasm);
    root.live = new Live(root, data);
    root.dataset.ready = "yes";
    return root.live;
  } catch (error) {
    root.querySelector("#verdict").textContent = typeof DecompressionStream === "undefined" ? "This browser is too old for the page (it has no DecompressionStream)." : `The page failed: ${error.message}`;
    throw error;
  }
})();

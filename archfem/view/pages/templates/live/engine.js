// Falling stones: archfem's own time steps as WebAssembly, their memory, and runs of an arch.
"use strict";
const FRAME_STEPS = 40; // steps between frames: 20 ms at steps of 0.5 ms
const EXTRA_TIME = 4; // after the motion, for stones that still fall [s]
const FIRST_SWEEPS = 20000; // of the first step, which has no impulses of a step before

/** The numbers from 0, so many; points and vectors; each point of an outline with the next. */
const range = (count) => [...new Array(count).keys()];
const minus = ([x, y], [u, v]) => [x - u, y - v];
const plus = ([x, y], [u, v]) => [x + u, y + v];
const dot = ([x, y], [u, v]) => x * u + y * v;
const cross = ([x, y], [u, v]) => x * v - y * u;
const distance = (one, other) => Math.hypot(...minus(one, other));
const mix = (one, other, share) => one.map((value, k) => (1 - share) * value + share * other[k]);
const rotate = ([x, y], angle) => { const [c, s] = [Math.cos(angle), Math.sin(angle)]; return [c * x - s * y, s * x + c * y]; };
const sides = (points) => points.map((point, k) => [point, points[(k + 1) % points.length]]);

/** Undo deflate and base64. */
async function inflate(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const zeros = (...shape) => ({ shape, values: new Float64Array(shape.reduce((size, part) => size * part, 1)) });
/** Nested lists, or a number, as shape and values. */
function flatten(nested) {
  const shape = [];
  for (let part = nested; Array.isArray(part); part = part[0]) shape.push(part.length);
  return { shape, values: nested.flat(Infinity) };
}

/** Arrays that the steps work in, as `prepare_steps` of archfem allocates them. */
function makeWorkspace({ mass, owner, arms }) {
  const count = mass.length, pieces = owner.length, vertices = arms.length, points = 16 * pieces + 16;
  const slots = 2 ** (Math.floor(Math.log2(2 * points)) + 1);
  return {
    "world.points": zeros(vertices, 2), "world.normals": zeros(vertices, 2), "world.boxes": zeros(pieces, 4),
    "world.order": { shape: [pieces], values: owner.map((_, piece) => piece) },
    "contacts.bodies": zeros(points, 2), "contacts.key": zeros(points), "contacts.point": zeros(points, 2),
    "contacts.normal": zeros(points, 2), "contacts.gap": zeros(points), "contacts.impulse": zeros(points, 3),
    "stored.key": zeros(points), "stored.place": zeros(points), "stored.impulse": zeros(points, 2),
    "stored.slots": { shape: [slots], values: new Array(slots).fill(-1) },
    middle: zeros(count, 3), rows: zeros(points, 17), speeds: zeros(count + 1, 3),
    "last.speeds": zeros(count + 1, 3), "last.impulse": zeros(points, 3),
    "rebounding.speeds": zeros(count + 1, 3), "rebounding.impulse": zeros(points, 3),
  };
}

/** Stones in the memory of the compiled steps. */
class Fall {
  constructor({ module, leaves }, { bodies, parameters }) {
    const imports = {};
    // the C library would report errors to a system, which a page does not have
    for (const { module: from, name } of WebAssembly.Module.imports(module)) (imports[from] ??= {})[name] = () => { throw new Error(`called ${name}`); };
    this.code = new WebAssembly.Instance(module, imports).exports;
    this.code._initialize?.();
    const count = bodies.mass.length, workspace = makeWorkspace(bodies);
    const state = { q: zeros(count, 3), v: zeros(count, 3), ground: zeros(FRAME_STEPS, 2), energy: zeros(8), settling: zeros(4) };
    const known = { bodies, parameters, workspace, state };
    Object.assign(this, { arguments: [], places: {} });
    for (const [path, kind] of leaves) {
      const [part, ...names] = path.split("."), given = known[part][names.join(".")];
      this.places[path] = { kind, at: this.arguments.length };
      this.arguments.push(...(kind === "number" ? [given] : this.store(path, given.shape ? given : flatten(given))));
    }
  }
  /** Copy an array into the memory; return its place and its shape. */
  store(path, { shape, values }) {
    const place = this.places[path], length = values.length;
    const start = Math.ceil(this.code.take(8 * length + 8) / 8) * 8;
    Object.assign(place, { start, length });
    this.view(path).set(place.kind === "int64" ? BigInt64Array.from(values, BigInt) : values);
    return [start, ...shape];
  }
  /** An array in the memory, which moves where the memory grows. */
  view(path) {
    const { kind, start, length } = this.places[path];
    const Kind = { float64: Float64Array, int64: BigInt64Array, bool: Uint8Array }[kind];
    return new Kind(this.code.memory.buffer, start, length);
  }
  /** Advance by steps with ground accelerations, two a step [m/s²], and with changed parameters. */
  advance(ground, changes = {}) {
    this.view("state.ground").set(ground);
    const given = [...this.arguments];
    for (const [path, value] of Object.entries(changes)) given[this.places[path].at] = value;
    given[this.places["state.ground"].at + 1] = ground.length / 2;
    if (this.code.advance_steps(...given) < 0) throw new Error("stones are in each other: the steps are too long");
  }
}

/** Accelerations of a motion {dt, x, y} at the middles of steps, straight between its samples. */
function sampleGround({ dt, x, y }, first, count, step, scale) {
  const ground = new Float64Array(2 * count);
  for (let k = 0; k < count; k++) {
    const moment = (step * (first + k + 0.5)) / dt, before = Math.floor(moment), share = moment - before;
    if (before + 1 >= x.length) break; // the ground rests
    [x, y].forEach((row, axis) => { ground[2 * k + axis] = scale * ((1 - share) * row[before] + share * row[before + 1]); });
  }
  return ground;
}

/** Largest distance by which any point of a stone has moved since, at most [m]. */
function farthest(poses, before, reach) {
  let most = 0;
  reach.forEach((arm, body) => {
    const [x, y, turn] = [0, 1, 2].map((k) => poses[3 * body + k] - before[3 * body + k]);
    most = Math.max(most, Math.hypot(x, y) + arm * Math.abs(turn));
  });
  return most;
}

/** Shake an arch: frames of poses every 20 ms until all rest; a stone is lost as in archfem's CollapseState. */
function shake(engine, arch, motion, scale) {
  const fall = new Fall(engine, arch), { bodies: { reach }, parameters: { dt: step, tolerance } } = arch;
  const precise = { "parameters.max_sweeps": FIRST_SWEEPS, "parameters.tolerance": 1e-3 * tolerance };
  const end = (motion.x.length - 1) * motion.dt, poses = () => fall.view("state.q").slice();
  const frames = [poses()], lost = new Map();
  let time = 0, anchor = frames[0], since = 0;
  while (time < end + EXTRA_TIME && (time <= end || time - since < 0.5)) {
    const ground = sampleGround(motion, (frames.length - 1) * FRAME_STEPS, FRAME_STEPS, step, scale), done = frames.length === 1 ? 2 : 0;
    if (done) fall.advance(ground.subarray(0, done), precise);
    fall.advance(ground.subarray(done));
    time = frames.length * FRAME_STEPS * step;
    const now = poses();
    frames.push(now);
    reach.forEach((_, body) => {
      if (!(now[3 * body + 1] < -0.5 * arch.sizes[body] || Math.abs(now[3 * body + 2]) > Math.PI / 4)) lost.delete(body);
      else if (!lost.has(body)) lost.set(body, time);
    });
    // at rest: no point moves by more than 0.5 mm in half a second on a ground at rest
    if (time <= end || farthest(now, anchor, reach) > 5e-4) [anchor, since] = [now, time];
  }
  return { frames, spacing: FRAME_STEPS * step, lost: lost.size, fell: lost.size ? Math.min(...lost.values()) : null, displacement: Math.max(...frames.map((each) => farthest(each, frames[0], reach))) };
}

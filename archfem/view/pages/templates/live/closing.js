// Joints that close by the finish of their faces: equilibrium of rigid stones at large displacements.
"use strict";
const LARGEST_CLOSING = 0.98; // over δ_m, beyond which the law follows its tangent, as in archfem
const GAUSS = [[-0.906179845938664, 0.236926885056189], [-0.538469310105683, 0.478628670499366], [0, 0.568888888888889], [0.538469310105683, 0.478628670499366], [0.906179845938664, 0.236926885056189]];
const SMALL_MOVE = 1e-8; // by which forces are differentiated [m or rad]

/** Force for each depth of a joint that closes: σ w = k δ / (1 - δ/δ_m). */
function pressOn({ stiffness, closure }, closing) {
  if (closing <= 0) return 0;
  const share = Math.min(closing / closure, LARGEST_CLOSING), slope = 1 / (1 - share);
  return stiffness * (closure * share * slope + (closing - share * closure) * slope ** 2);
}

/** Stones on joints that press by a law {stiffness, shear, closure, width} and do not slide. */
class ClosingJoints {
  constructor({ bodies: { mass, centre, inverse_mass }, joints, parameters }, law) {
    this.law = { ...law, stiffness: law.stiffness * law.width, shear: law.shear * law.width };
    this.joints = joints.map((joint) => makeJoint(joint, centre)).map((joint) => ({ ...joint, arms: joint.blocks.map((body) => minus(joint.middle, centre[body])) }));
    this.rows = mass.flatMap((_, body) => (inverse_mass[body][0] > 0 ? [3 * body, 3 * body + 1, 3 * body + 2] : []));
    this.weights = mass.map(([own]) => own * parameters.gravity);
    this.still = new Float64Array(3 * mass.length);
    this.reach = Math.max(...centre.flat()) - Math.min(...centre.flat());
    this.tolerance = 1e-8 * this.rows.reduce((sum, row) => sum + this.weights[Math.floor(row / 3)] / 3, 0);
  }
  /** Forces on the coordinates of both blocks of a joint in poses q, e and the largest closing. */
  press({ blocks, arms, depth, normal, tangent }, q) {
    const turns = blocks.map((body) => q[3 * body + 2]), half = 0.5 * (turns[0] + turns[1]), placed = arms.map((arm, side) => rotate(arm, turns[side]));
    // the jump from the lower face to the higher, from displacements for accuracy
    const jump = [0, 1].map((k) => q[3 * blocks[1] + k] - q[3 * blocks[0] + k] + placed[1][k] - arms[1][k] - placed[0][k] + arms[0][k]);
    const n = rotate(normal, half), t = rotate(tangent, half), sense = cross(tangent, normal);
    const opening = dot(n, jump), slip = dot(t, jump), turn = sense * (turns[1] - turns[0]);
    // the part of the depth that closes, from the intrados at -h/2
    const ends = [opening - 0.5 * turn * depth, opening + 0.5 * turn * depth], edge = -opening / turn;
    const [low, high] = [ends[0] > 0 ? Math.min(edge, 0.5 * depth) : -0.5 * depth, ends[1] > 0 ? Math.max(edge, -0.5 * depth) : 0.5 * depth];
    let force = 0, moment = 0;
    if (Math.min(...ends) < 0) for (const [place, weight] of GAUSS) {
      const x = 0.5 * (low + high + place * (high - low)), own = 0.5 * (high - low) * weight * pressOn(this.law, -opening - turn * x);
      force += own;
      moment += own * x;
    }
    const shear = this.law.shear * depth * slip, along = [0, 1].map((k) => shear * t[k] - force * n[k]);
    // by the mean rotation the normal and the tangent turn: dn = ez × n, dt = ez × t
    const swing = 0.5 * (shear * cross(t, jump) - force * cross(n, jump));
    const own = [-1, 1].flatMap((sign, side) => [sign * along[0], sign * along[1], sign * cross(placed[side], along) + swing - sign * sense * moment]);
    return { own, e: force > 0 ? moment / force / depth : NaN, closing: -Math.min(...ends), shear: Math.abs(shear), force };
  }
  /** Forces out of balance at the free coordinates, under a push in g; of all joints, or of some. */
  unbalance(q, push, joints = this.joints) {
    const forces = Float64Array.from(this.weights.flatMap((weight) => [-push * weight, weight, 0]));
    for (const joint of joints) {
      this.press(joint, q).own.forEach((value, k) => { forces[3 * joint.blocks[Math.floor(k / 3)] + (k % 3)] += value; });
    }
    return this.rows.map((row) => forces[row]);
  }
  /** Derivatives of the forces out of balance by each free coordinate, of central differences. */
  differentiate(q) {
    return this.rows.map((row) => {
      const own = this.joints.filter(({ blocks }) => blocks.includes(Math.floor(row / 3)));
      const [more, less] = [1, -1].map((sign) => this.unbalance(q.with(row, q[row] + sign * SMALL_MOVE), 0, own));
      return more.map((value, k) => (value - less[k]) / (2 * SMALL_MOVE));
    });
  }
  /** Poses in equilibrium near others, by Newton's method; null where there are none. */
  settle(start, push) {
    const count = this.rows.length, sizeOf = (forces) => Math.max(...forces.map(Math.abs));
    let q = start, forces = this.unbalance(q, push);
    for (let round = 0; round < 12; round++) {
      if (sizeOf(forces) < this.tolerance) return q;
      const slopes = this.differentiate(q), table = forces.map((force, row) => Float64Array.from([...slopes.map((slope) => slope[row]), -force]));
      const columns = eliminate(table, range(count)), before = sizeOf(forces);
      for (let share = 1, from = q; share === 1 || (share > 0.01 && !(sizeOf(forces) < 2 * before)); share /= 2) {
        q = from.slice();
        columns.forEach((column, k) => { q[this.rows[column]] += share * table[k][count]; });
        forces = this.unbalance(q, push);
      }
      if (!q.every((value) => Math.abs(value) < 0.05 * this.reach)) return null;
    }
    return null;
  }
  /** Poses, e of the joints and the largest closing under the weight; null where it does not stand, or slides. */
  rest() {
    const q = this.settle(this.still, 0), found = q ? this.joints.map((joint) => this.press(joint, q)) : [];
    if (!q || found.some(({ force, shear }, j) => !(force > 0) || shear > this.joints[j].friction * force)) return null;
    return { q, lines: found.map(({ e }) => e), closing: Math.max(...found.map(({ closing }) => closing)) };
  }
  /** The largest push to a side that has an equilibrium, to 0.1 % of that with hard joints. */
  peak(q, side, hard) {
    let push = 0;
    for (let step = 0.1 * hard; step > 1e-3 * hard && push < 1.5 * hard;) {
      const next = this.settle(q, side * (push + step));
      if (next) [q, push] = [next, push + step]; else step /= 3;
    }
    return push;
  }
}

// Statics of rigid stones: forces in joints, thrust line, least thickness, collapse acceleration.
"use strict";
const SMALL = 1e-9;
const DISTURBANCE = 1e-6, GOLDEN = 0.618034; // of c in a linear programme: by different numbers, evenly spread
const MAX_FREE_FORCES = 60; // of structures with one thrust line; walls have more, and lines without number

/** Subtract multiples of a row of a table from all others, so that a column is that of a unit. */
function pivot(table, row, column) {
  const line = table[row], factor = 1 / line[column];
  for (let k = 0; k < line.length; k++) line[k] *= factor;
  for (const other of table) {
    const times = other[column];
    if (other === line || times === 0) continue;
    for (let k = 0; k < line.length; k++) other[k] -= times * line[k];
  }
}

/** Solve a table of equations for some of its columns; return the column of each row, -1 for a row of zeros. */
function eliminate(table, columns) {
  return table.map((line, row) => {
    const column = columns.reduce((best, k) => (Math.abs(line[k]) > Math.abs(line[best]) ? k : best));
    if (Math.abs(line[column]) < 1e-10) return -1;
    pivot(table, row, column);
    return column;
  });
}

/**
 * Maximise c·y over free y under rows·y <= limits, by the simplex method on the dual,
 * min limits·u under rowsᵀ u = c, u >= 0. Returns the value, y and u; null where no y is possible,
 * and the value Infinity where nothing limits it.
 */
function maximise(c, rows, limits) {
  const n = c.length, m = rows.length, last = m + n, basis = c.map((_, k) => m + k);
  // columns: u, spare ones of a unit, c, and c disturbed, as zeros in it would let pivots go round in circles
  const table = c.map((value, k) => {
    const line = new Float64Array(last + 2);
    rows.forEach((row, i) => { line[i] = row[k]; });
    line.set([value, value + Math.sign(value || 1) * DISTURBANCE * (1 + ((GOLDEN * k) % 1))], last);
    if (value < 0) line.forEach((each, i) => { line[i] = -each; });
    line[m + k] = 1;
    return line;
  });
  /** Pivot until none of the first columns lowers the cost; return the reduced costs, or null without a minimum. */
  const minimise = (costs, columns) => {
    const reduced = Float64Array.from([...costs, 0, 0]);
    basis.forEach((own, k) => table[k].forEach((value, j) => { reduced[j] -= costs[own] * value; }));
    for (;;) {
      const column = reduced.subarray(0, columns).reduce((best, value, j) => (value < reduced[best] ? j : best), 0);
      if (reduced[column] > -SMALL) return reduced;
      let row = -1, least = Infinity;
      table.forEach((line, k) => {
        const isSpare = basis[k] >= m && columns === m && Math.abs(line[column]) > SMALL;
        const ratio = isSpare ? 0 : line[column] > SMALL ? line[last + 1] / line[column] : Infinity;
        if (ratio < least) [row, least] = [k, ratio];
      });
      if (row < 0) return null;
      pivot([...table, reduced], row, column);
      basis[row] = column;
    }
  };
  const spare = [...new Array(m).fill(0), ...new Array(n).fill(1)];
  if (-minimise(spare, last)[last] > 1e-7) return { value: Infinity, y: null, u: null };
  const reduced = minimise([...limits, ...new Array(n).fill(0)], m);
  if (reduced === null) return null;
  const u = new Float64Array(m);
  basis.forEach((own, k) => { if (own < m) u[own] = table[k][last]; });
  return { value: -reduced[last], y: c.map((value, k) => (value < 0 ? 1 : -1) * reduced[m + k]), u };
}

/** Forces N, V, M of joints in equilibrium: those of weight, of 1 g sideways, and what is left free. */
class Equilibrium {
  constructor({ bodies, joints, parameters }) {
    const { mass, centre, inverse_mass } = bodies, free = mass.flatMap((_, body) => (inverse_mass[body][0] > 0 ? [body] : []));
    const count = 3 * joints.length, rowOf = new Map(free.map((body, k) => [body, 3 * k]));
    this.weight = parameters.gravity * free.reduce((sum, body) => sum + mass[body][0], 0);
    this.joints = joints.map((joint) => makeJoint(joint, centre));
    // rows: forces along x and y and moment of each free stone; columns: forces, weight, push
    const table = free.flatMap(() => [0, 1, 2].map(() => new Float64Array(count + 2)));
    this.joints.forEach(({ blocks, normal, tangent, middle }, j) => blocks.forEach((body, side) => {
      const row = rowOf.get(body), arm = minus(middle, centre[body]), sign = side ? 1 : -1;
      if (row === undefined) return;
      const forces = [[...normal, cross(arm, normal)], [...tangent, cross(arm, tangent)], [0, 0, cross(tangent, normal)]];
      forces.forEach((force, k) => force.forEach((value, i) => { table[row + i][3 * j + k] = sign * value; }));
    }));
    for (const [body, row] of rowOf) {
      const own = (parameters.gravity * mass[body][0]) / this.weight;
      table[row + 1][count] = own;
      table[row][count + 1] = -own;
    }
    const solved = eliminate(table, range(count)), left = range(count).filter((column) => !solved.includes(column));
    /** Coefficients of each force: of the free ones, of the weight and of the push. */
    this.forces = range(count).map((column) => {
      const line = table[solved.indexOf(column)];
      return line ? [...left.map((k) => -line[k]), line[count], line[count + 1]] : [...left.map((k) => (k === column ? 1 : 0)), 0, 0];
    });
    this.size = left.length;
    this.isHeld = table.every((line, row) => solved[row] >= 0 || Math.abs(line[count]) < SMALL); // all weight goes somewhere
  }
  /** Rows of |M| <= share N h / 2 and |V| <= μ N + c A, over the free forces and the push. */
  conditions(share) {
    const rows = [], limits = [], kinds = [];
    const add = (sign, [one, other], factor, constant, kind) => {
      const row = other.map((value, k) => sign * one[k] - factor * value), weight = row.splice(this.size, 1)[0];
      const scale = 1 / Math.max(...row.map(Math.abs), SMALL);
      rows.push(row.map((value) => scale * value));
      limits.push(scale * (constant - weight));
      kinds.push({ ...kind, sign, scale });
    };
    this.joints.forEach(({ depth, friction, cohesion }, joint) => {
      const [normal, shear, moment] = [0, 1, 2].map((k) => this.forces[3 * joint + k]);
      for (const sign of [-1, 1]) {
        add(sign, [moment, normal], 0.5 * share * depth, 0, { joint, hinge: true });
        add(sign, [shear, normal], friction, cohesion / this.weight, { joint, hinge: false });
      }
    });
    return { rows, limits, kinds };
  }
  /** Largest push to one side, +1 or -1, in g, with the joints that give way; null: it does not stand. */
  collapse(side) {
    const { rows, limits, kinds } = this.conditions(1), found = this.isHeld ? maximise([...new Array(this.size).fill(0), side], rows, limits) : null;
    if (found === null) return null;
    const failing = kinds.filter((_, k) => found.u?.[k] > 1e-7);
    return { factor: found.value, side, hinges: failing.filter((each) => each.hinge), slides: failing.filter((each) => !each.hinge) };
  }
  /** The push that brings it down, the weaker side; a factor below zero where it does not stand. */
  weakest() {
    const [one, other] = [this.collapse(1), this.collapse(-1)];
    if (!one || !other) return { factor: -1, side: 1, hinges: [], slides: [] };
    return one.factor <= other.factor * (1 + 1e-9) ? one : other;
  }
  /** e of the thrust line that stays farthest from the faces under a push in g: the least max |e|; null without one. */
  thrust(push) {
    const { size, joints } = this;
    let share = 1, weights = joints.map(({ depth }) => 0.5 * depth), best = null;
    for (let round = 0; round < 12 && this.isHeld && size <= MAX_FREE_FORCES; round++) {
      // Dinkelbach: the largest reserve at a share, then the share that this line has
      const { rows, limits, kinds } = this.conditions(share);
      const reserve = rows.map((row, k) => [...row.slice(0, size), kinds[k].hinge ? kinds[k].scale * weights[kinds[k].joint] : 0]);
      const found = maximise([...new Array(size).fill(0), 1], reserve, limits.map((limit, k) => limit - push * rows[k][size]));
      if (!found?.y) return best;
      const all = [...found.y.slice(0, size), 1, push], values = this.forces.map((row) => row.reduce((sum, value, k) => sum + value * all[k], 0));
      const lines = joints.map(({ depth }, j) => (values[3 * j] > SMALL ? values[3 * j + 2] / values[3 * j] / depth : NaN));
      if (lines.some(Number.isNaN)) return best;
      const next = 2 * Math.max(...lines.map(Math.abs));
      if (best && next > share - 1e-10) return best;
      [best, share] = [lines, next];
      weights = joints.map(({ depth }, j) => 0.5 * values[3 * j] * depth);
    }
    return best;
  }
}

/** Geometry of a joint: its normal points from its lower block to its higher one. */
function makeJoint({ blocks, ends, friction, cohesion }, centre) {
  const [inner, outer] = ends, depth = distance(inner, outer), tangent = minus(outer, inner).map((value) => value / depth), middle = mix(inner, outer, 0.5);
  const right = [tangent[1], -tangent[0]], [low, high] = blocks.map((body) => centre[body]), sign = dot(right, minus(high, low)) < 0 ? -1 : 1;
  return { blocks, ends, depth, tangent, normal: right.map((value) => sign * value), middle, friction, cohesion };
}
/** Where a thrust line crosses a joint. */
const crossing = ({ middle, tangent, depth }, e) => [0, 1].map((k) => middle[k] + e * depth * tangent[k]);

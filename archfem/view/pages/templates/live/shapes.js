// Rings cut into stones anew: joints along a ring, stones between them, their masses and pieces.
"use strict";
const MAX_CHORD = Math.PI / 12; // of an arc, as in archfem: chords deviate by 0.9 % of the radius
const FINE_CHORD = 0.02; // of an arc for masses, whose error is a third of its square

const turnOf = (one, other) => Math.atan2(cross(one, other), dot(one, other));

/**
 * Joint at a place along a ring, 0 to 1: between neighbours it turns about the point where they meet.
 * Its depth is scaled about a share of it: 0.5 keeps the centre line, 0 the intrados.
 */
function sectionAt({ ends, kept }, place, factor) {
  const last = ends.length - 2, k = Math.min(Math.floor(place * (last + 1) + 1e-9), last), share = place * (last + 1) - k;
  const [[a, b], [c, d]] = [ends[k], ends[k + 1]], one = minus(b, a), other = minus(d, c), sine = cross(one, other);
  let section = [mix(a, c, share), mix(b, d, share)];
  if (Math.abs(sine) > 1e-6 * Math.hypot(...one) * Math.hypot(...other)) {
    const pole = mix(a, b, cross(minus(c, a), other) / sine), radius = (point, along) => dot(minus(point, pole), along) / Math.hypot(...along);
    const angle = Math.atan2(one[1], one[0]) + share * turnOf(one, other), radii = mix([a, b].map((p) => radius(p, one)), [c, d].map((p) => radius(p, other)), share);
    section = radii.map((r) => [pole[0] + r * Math.cos(angle), pole[1] + r * Math.sin(angle)]);
  }
  const still = mix(...section, kept);
  return section.map((point) => mix(still, point, factor));
}

/** Area, centroid and polar moment of convex pieces together. */
function measure(pieces) {
  let area = 0, x = 0, y = 0, moment = 0;
  for (const [[x0, y0], [x1, y1]] of pieces.flatMap(sides)) {
    const twice = x0 * y1 - x1 * y0;
    area += twice / 2;
    x += (twice * (x0 + x1)) / 6;
    y += (twice * (y0 + y1)) / 6;
    moment += (twice * (x0 * x0 + x0 * x1 + x1 * x1 + y0 * y0 + y0 * y1 + y1 * y1)) / 12;
  }
  const centre = [x / area, y / area];
  return { area, centre, moment: moment - area * (centre[0] ** 2 + centre[1] ** 2) };
}

/** Stones of a ring {ends, kept, density, level}, first and last joint on supports, as `make_bodies` of archfem makes them. */
function cutRing(ring, { factor, stones, friction }, parameters) {
  const at = (place) => sectionAt(ring, place, factor), faces = range(stones + 1).map((k) => at(k / stones));
  const tangents = faces.map(([inner, outer]) => minus(outer, inner));
  const turn = Math.max(...tangents.slice(1).map((tangent, k) => Math.abs(turnOf(tangents[k], tangent))));
  const chords = Math.max(1, Math.ceil(turn / MAX_CHORD - 1e-9));
  const split = (k, parts) => {
    const cuts = range(parts + 1).map((i) => at((k + i / parts) / stones));
    return cuts.slice(1).map(([c, d], i) => [cuts[i][0], c, d, cuts[i][1]]); // anticlockwise, for rings from left to right
  };
  /** A support behind a joint, half as deep as that is long. */
  const support = ([inner, outer], side) => {
    const behind = ([x, y]) => [x + side * 0.5 * (outer[1] - inner[1]), y - side * 0.5 * (outer[0] - inner[0])];
    return [side < 0 ? [inner, outer, behind(outer), behind(inner)] : [outer, inner, behind(inner), behind(outer)]];
  };
  const ends = [support(faces[0], -1), support(faces[stones], 1)], numbers = range(stones);
  const shapes = [ends[0], ...numbers.map((k) => split(k, chords)), ends[1]];
  const exact = [measure(ends[0]), ...numbers.map((k) => measure(split(k, Math.max(1, Math.ceil(turn / FINE_CHORD))))), measure(ends[1])];
  const bodies = makeBodies(shapes, exact, [0, stones + 1], ring, friction);
  const joints = faces.map((face, k) => ({ blocks: [k, k + 1], ends: face, friction, cohesion: 0 }));
  return { bodies, joints, sizes: exact.map(({ area }) => Math.sqrt(area)), parameters };
}

/** Arrays of bodies: masses, and the vertices and outward normals of their pieces. */
function makeBodies(shapes, exact, fixed, ring, friction) {
  const centre = exact.map((each) => each.centre), owner = [], starts = [0], arms = [], normals = [], outer = [];
  shapes.forEach((pieces, body) => pieces.forEach((points, piece) => {
    owner.push(body);
    sides(points).forEach(([point, next], k) => {
      const [x, y] = minus(next, point), length = Math.hypot(x, y);
      arms.push(minus(point, centre[body]));
      normals.push([y / length, -x / length]);
      outer.push(pieces.length === 1 || [true, piece === pieces.length - 1, true, piece === 0][k]); // not where a stone is cut into pieces
    });
    starts.push(arms.length);
  }));
  const reach = shapes.map((pieces, body) => Math.max(...pieces.flat().map((point) => distance(point, centre[body]))));
  const mass = exact.map(({ area, moment }, body) => (fixed.includes(body) ? [0, 0] : [ring.density * area, ring.density * moment]));
  const level = Math.min(ring.level, ...fixed.flatMap((body) => shapes[body].flat()).map(([, y]) => y));
  const closed = Math.min(...exact.filter((_, body) => !fixed.includes(body)).map(({ area }) => 1e-4 * Math.sqrt(area)), 5e-5);
  const table = (value) => mass.concat([0]).map((_, __, all) => all.map(() => value));
  return {
    inverse_mass: [...mass.map((each) => each.map((value) => (value ? 1 / value : 0))), [0, 0]], mass, centre: [...centre, [0, level]], reach,
    friction: table(friction), cohesion: table(0), rocking: table(0), owner, piece_starts: starts, arms, normals, outer,
    level, contact_gap: closed, slop: closed,
  };
}

/** Points of the pieces of all stones in their poses, or as they were built. */
function placePieces({ mass, centre, arms, owner, piece_starts: starts }, poses = new Float64Array(3 * mass.length)) {
  return owner.map((body, piece) => {
    const [x, y, turn] = poses.subarray(3 * body, 3 * body + 3), middle = plus(centre[body], [x, y]);
    return arms.slice(starts[piece], starts[piece + 1]).map((arm) => plus(middle, rotate(arm, turn)));
  });
}

/** Least thickness over that of the ring at which it stands, by halving; NaN where even three times it does not. */
function leastThickness(ring, design, parameters) {
  const stands = (factor) => new Equilibrium(cutRing(ring, { ...design, factor }, parameters)).weakest().factor >= 0;
  let [low, high] = [0.02, 3];
  if (!stands(high)) return NaN;
  while (high - low > 1e-4 * high) {
    const middle = Math.sqrt(low * high);
    if (stands(middle)) high = middle; else low = middle;
  }
  return high;
}

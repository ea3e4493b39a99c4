// Arches that readers draw: rings by springings and crown, and stones by the outlines of a drawing.
"use strict";
const STONE = 20e3 / 9.81; // kg per m² of outline, 1 m wide
const DRAWN_JOINTS = 24; // along a drawn curve, before it is cut into stones
const TOUCHING = 3e-3; // distance of outlines that touch [m]

/** Say what is wrong, and what helps. */
const refuse = (words) => { throw new Error(words); };

/** A ring by its clear span and rise: a circle, half an ellipse or two arcs that meet in a point. */
function drawRing({ kind, span, rise, thickness, left }) {
  const half = span / 2, size = `span ${span.toFixed(2)} m and rise ${rise.toFixed(2)} m`;
  if (!(span > 0.1 && rise > 0.02 * span)) refuse(`${size}: mark the left springing, the right springing, and the crown above them`);
  if (kind === "circle" && rise > half) refuse(`${size}: a circle is at most half as high as it spans; choose a pointed arch or an ellipse`);
  if (kind === "pointed" && rise < half) refuse(`${size}: a pointed arch is at least half as high as it spans; choose a circle or an ellipse`);
  const radius = kind === "circle" ? (half ** 2 + rise ** 2) / (2 * rise) : (half ** 2 + rise ** 2) / span;
  const curves = {
    circle: (share) => { const turn = (2 * share - 1) * Math.atan2(half, radius - rise); return [radius * Math.sin(turn), radius * Math.cos(turn) - radius + rise]; },
    ellipse: (share) => [-half * Math.cos(Math.PI * share), rise * Math.sin(Math.PI * share)],
    pointed: (share) => {
      const away = Math.min(share, 1 - share) * 2 * Math.atan2(rise, radius - half), x = radius - half - radius * Math.cos(away);
      return [share < 0.5 ? x : -x, radius * Math.sin(away)];
    },
  };
  const shares = [...new Array(2001).keys()].map((k) => k / 2000), points = shares.map(curves[kind]), lengths = [0];
  points.slice(1).forEach(([x, y], k) => lengths.push(lengths[k] + Math.hypot(x - points[k][0], y - points[k][1])));
  const ends = [...new Array(DRAWN_JOINTS + 1).keys()].map((j) => {
    const k = lengths.findIndex((length) => length >= (j / DRAWN_JOINTS) * lengths[2000] - 1e-9), [before, after] = [points[Math.max(k - 1, 0)], points[Math.min(k + 1, 2000)]];
    const [x, y] = points[k], along = [after[0] - before[0], after[1] - before[1]], length = Math.hypot(...along);
    // at the point of two arcs the joint is upright, and longer
    const deep = kind === "pointed" && 2 * j === DRAWN_JOINTS ? Math.sqrt((radius + thickness) ** 2 - (radius - half) ** 2) - rise : thickness;
    return [[x, y], [x - (deep * along[1]) / length, y + (deep * along[0]) / length]].map(([u, v]) => [u + left[0] + half, v + left[1]]);
  });
  return { ends, kept: 0, stones: 15, thickness, density: STONE, level: Infinity };
}

/** Closed outlines of a GeoJSON file: {points, fixed}. */
function readGeoJson(text) {
  const found = JSON.parse(text), features = found.features ?? [found];
  return features.flatMap(({ properties, geometry }) => {
    const parts = geometry?.type === "Polygon" ? [geometry.coordinates] : geometry?.type === "MultiPolygon" ? geometry.coordinates : [];
    return parts.map(([ring]) => ({ points: ring.map(([x, y]) => [x, y]), fixed: properties?.fixed === true }));
  });
}
/** Closed polylines of a DXF file; those in layers of supports are fixed. */
function readDxf(text) {
  const lines = text.split(/\r?\n/), outlines = [];
  let current = null;
  for (let k = 0; k + 1 < lines.length; k += 2) {
    const [code, value] = [Number(lines[k]), lines[k + 1].trim()];
    if (code === 0 && value !== "VERTEX") {
      current = value === "LWPOLYLINE" || value === "POLYLINE" ? { points: [], fixed: false, isHead: value === "POLYLINE" } : null;
      if (current) outlines.push(current);
    } else if (code === 0) current.isHead = false;
    else if (current && code === 8 && /support|abut|found|rock|fixed/i.test(value)) current.fixed = true;
    else if (current && code === 10 && !current.isHead) current.points.push([Number(value), 0]);
    else if (current && code === 20 && current.points.length && !current.isHead) current.points.at(-1)[1] = Number(value);
  }
  return outlines.filter(({ points }) => points.length > 2);
}

/** An outline in metres, anticlockwise, without points that repeat; convex, or refused in words. */
function tidyOutline({ points, fixed }, number, unit) {
  const far = ([x, y], [u, v]) => Math.hypot(x - u, y - v) > TOUCHING;
  let ring = points.map((point) => point.map((value) => value * unit));
  ring = ring.filter((point, k) => far(point, ring[(k + 1) % ring.length]));
  if (ring.length < 3 || ring.flat().some((value) => !Number.isFinite(value))) refuse(`outline ${number} has no area: draw each stone as a closed line, and choose the unit of the drawing`);
  if (measure([ring]).area < 0) ring.reverse();
  const edges = ring.map(([x, y], k) => [ring[(k + 1) % ring.length][0] - x, ring[(k + 1) % ring.length][1] - y]);
  const turns = edges.map((edge, k) => turnOf(edge, edges[(k + 1) % edges.length]));
  if (Math.abs(turns.reduce((sum, turn) => sum + turn) - 2 * Math.PI) > 1e-6) refuse(`outline ${number} crosses itself: draw it anew`);
  if (Math.min(...turns) < -0.01) refuse(`outline ${number} is not convex: cut the stone into convex ones, or run the drawing with archfem`);
  return { ring, fixed };
}
/** Where two outlines touch along an edge: the ends of the joint, or null. */
function findJoint(one, other) {
  for (const [k, [x, y]] of one.entries()) {
    const end = one[(k + 1) % one.length], length = Math.hypot(end[0] - x, end[1] - y), [tx, ty] = [(end[0] - x) / length, (end[1] - y) / length];
    for (const [i, a] of other.entries()) {
      const b = other[(i + 1) % other.length], [from, to] = [b, a].map(([u, v]) => [(u - x) * tx + (v - y) * ty, (v - y) * tx - (u - x) * ty]);
      const [low, high] = [Math.max(0, from[0]), Math.min(length, to[0])];
      if (Math.max(Math.abs(from[1]), Math.abs(to[1])) < TOUCHING && high - low > 10 * TOUCHING) return [[x + low * tx, y + low * ty], [x + high * tx, y + high * ty]];
    }
  }
  return null;
}
/** Depth by which two convex outlines are in each other; below zero they are apart. */
function findOverlap(one, other) {
  const least = (ring, from) => Math.min(...ring.map(([x, y], k) => {
    const end = ring[(k + 1) % ring.length], length = Math.hypot(end[0] - x, end[1] - y);
    return -Math.min(...from.map(([u, v]) => ((u - x) * (end[1] - y) - (v - y) * (end[0] - x)) / length));
  }));
  return Math.min(least(one, other), least(other, one));
}

/** The arch of outlines: joints where they touch; the lowest stones are supports where none is given. */
function assembleOutlines(outlines, unit, parameters, friction = 0.6) {
  if (outlines.length < 2) refuse("the drawing has no closed outlines: draw each stone as a closed polyline (DXF) or a Polygon (GeoJSON)");
  if (outlines.length > 70) refuse(`${outlines.length} outlines: a page takes up to 60 stones; run the drawing with archfem`);
  const tidy = outlines.map((each, k) => tidyOutline(each, k + 1, unit)), rings = tidy.map(({ ring }) => ring), foot = (ring) => Math.min(...ring.map(([, y]) => y));
  const low = Math.min(...rings.map(foot)), size = Math.max(...rings.flat(2)) - Math.min(...rings.flat(2));
  if (size > 500) refuse(`the drawing is ${size.toFixed(0)} m large: choose its unit`);
  const given = tidy.some(({ fixed }) => fixed), fixed = tidy.flatMap((each, k) => ((given ? each.fixed : foot(each.ring) < low + 0.02 * size) ? [k] : []));
  if (fixed.length === rings.length) refuse("all stones are supports: none is left to fall");
  const joints = [];
  rings.forEach((one, a) => rings.slice(a + 1).forEach((other, k) => {
    const b = a + 1 + k, overlap = findOverlap(one, other), ends = findJoint(one, other);
    if (overlap > 5 * TOUCHING) refuse(`outlines ${a + 1} and ${b + 1} are in each other by ${(1e3 * overlap).toFixed(0)} mm: stones may only touch`);
    if (ends) joints.push({ blocks: [a, b], ends, friction, cohesion: 0 });
  }));
  const alone = rings.findIndex((_, k) => !fixed.includes(k) && !joints.some(({ blocks }) => blocks.includes(k)));
  if (alone >= 0) refuse(`outline ${alone + 1} touches no other: draw it within 3 mm of its neighbours`);
  const shapes = rings.map((ring) => [ring]), exact = shapes.map(measure);
  const bodies = makeBodies(shapes, exact, fixed, { density: STONE, level: low }, friction);
  return { name: "a drawing", bodies, joints, sizes: exact.map(({ area }) => Math.sqrt(area)), parameters, thrust: null, ring: null };
}

/** An accelerogram of two columns, time [s] and acceleration [g], or of an AT2 file. */
function readRecord(text, name) {
  const numbers = (lines) => lines.flatMap((line) => line.trim().split(/[\s,;]+/)).filter(Boolean).map(Number), lines = text.split(/\r?\n/);
  const head = lines.slice(0, 6).join(" ").match(/DT\s*=\s*([\d.Ee+-]+)/i);
  let dt, x;
  if (head) {
    dt = Number(head[1]);
    x = numbers(lines.slice(lines.findIndex((line) => /DT\s*=/i.test(line)) + 1));
  } else {
    const rows = lines.filter((line) => /^\s*[-+.\d]/.test(line)).map((line) => numbers([line]));
    if (rows.length < 10 || rows.some((row) => row.length !== 2)) refuse(`${name} is no record: give two columns, time in s and acceleration in g, or an AT2 file`);
    dt = rows[1][0] - rows[0][0];
    if (rows.some(([time], k) => Math.abs(time - rows[0][0] - k * dt) > 0.01 * dt)) refuse(`${name} has uneven time steps: give even ones`);
    x = rows.map((row) => row[1]);
  }
  const peak = x.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
  if (x.some(Number.isNaN) || !(dt > 0 && dt < 0.2) || !(peak > 0 && peak < 10) || x.length * dt > 120) refuse(`${name}: ${x.length} values every ${dt} s up to ${peak.toFixed(2)} g; give at most 120 s in units of g`);
  return { name, dt, x: x.map((value) => value * 9.81), y: x.map(() => 0), peak: peak * 9.81, strength: Math.round(100 * peak) / 100 };
}

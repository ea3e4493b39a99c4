// Arches that readers draw: rings by springings and crown, and stones by the outlines of a drawing.
"use strict";
const STONE = 20e3 / 9.81; // kg per m² of outline, 1 m wide
const FRICTION = 0.6;
const DRAWN_JOINTS = 24; // along a drawn curve, before it is cut into stones
const TOUCHING = 3e-3; // distance of outlines that touch [m]
const ARC_CHORD = Math.PI / 60; // of arcs of a drawing, whose sagitta is then 0.03 % of the radius
const MOST_G = 2.5; // peak of a record [g], beyond which its unit is taken to be another one
const DXF_PLACES = { 10: 0, 20: 1, 21: 1, 42: 2 }; // of x, y and bulge in a point, by group code

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
  const points = range(2001).map((k) => curves[kind](k / 2000)), lengths = [0];
  points.slice(1).forEach((point, k) => lengths.push(lengths[k] + distance(point, points[k])));
  const ends = range(DRAWN_JOINTS + 1).map((j) => {
    const k = lengths.findIndex((length) => length >= (j / DRAWN_JOINTS) * lengths[2000] - 1e-9), [before, after] = [points[Math.max(k - 1, 0)], points[Math.min(k + 1, 2000)]];
    const [along, up] = minus(after, before).map((value) => value / distance(before, after)), inner = plus(points[k], [left[0] + half, left[1]]);
    // at the point of two arcs the joint is upright, and longer
    const deep = kind === "pointed" && 2 * j === DRAWN_JOINTS ? Math.sqrt((radius + thickness) ** 2 - (radius - half) ** 2) - rise : thickness;
    return [inner, plus(inner, [-deep * up, deep * along])];
  });
  return { ends, kept: 0, stones: 15, thickness, density: STONE, level: Infinity };
}
/** Springings and crown of a drawn ring, on its inner side. */
const markRing = ({ span, rise, left: [x, y] }) => [[x, y], [x + span, y], [x + 0.5 * span, y + rise]];
/** The arch of a drawn ring. */
function assembleRing(drawn, parameters) {
  const ring = drawRing(drawn), arch = cutRing(ring, { factor: 1, stones: ring.stones, friction: FRICTION }, parameters);
  return { ...arch, ring: { ...ring, level: arch.bodies.level } };
}

/** Closed outlines of a GeoJSON file: {points, fixed}. */
function readGeoJson(text) {
  const found = JSON.parse(text), features = found.features ?? [found];
  return features.flatMap(({ properties, geometry }) => {
    const parts = geometry?.type === "Polygon" ? [geometry.coordinates] : geometry?.type === "MultiPolygon" ? geometry.coordinates : [];
    return parts.map(([ring]) => ({ points: ring.map(([x, y]) => [x, y]), fixed: properties?.fixed === true }));
  });
}
/** Points of an arc by its bulge, the tangent of a quarter of its angle, without its end. */
function bendLine([x, y, bulge], [u, v]) {
  const turn = 4 * Math.atan(bulge), parts = Math.max(1, Math.ceil(Math.abs(turn) / ARC_CHORD)), away = bulge ? (1 - bulge ** 2) / (4 * bulge) : 0;
  const middle = [0.5 * (x + u) - away * (v - y), 0.5 * (y + v) + away * (u - x)], arm = minus([x, y], middle);
  return range(parts).map((k) => (k ? plus(middle, rotate(arm, (k * turn) / parts)) : [x, y]));
}
/** Outlines of a DXF file: closed polylines, and what lines and arcs enclose; those in layers of supports are fixed. */
function readDxf(text) {
  const start = text.search(/^ENTITIES\s*$/m), lines = text.slice(start).split(/\r?\n/), parts = [], outlines = [], paths = [];
  if (start < 0) refuse("no DXF as text");
  for (let k = 1; k + 1 < lines.length; k += 2) {
    const [code, value] = [Number(lines[k]), lines[k + 1].trim()], part = parts.at(-1), number = Number(value);
    if (code === 0 && value === "VERTEX") part.points.push([0, 0, 0]);
    else if (code === 0) parts.push({ kind: value, points: value === "POLYLINE" ? [] : [[0, 0, 0]], layer: "", flags: 0 });
    else if (!part) continue;
    else if (code === 8 && !part.layer) part.layer = value;
    else if (code === 70 && !part.flags) part.flags = number;
    else if (code === 10 && part.kind === "LWPOLYLINE") part.points.push([number, 0, 0]);
    else if (code === 11) part.points.push([number, 0, 0]);
    else if (part.points.length && DXF_PLACES[code] !== undefined) part.points.at(-1)[DXF_PLACES[code]] = number;
    else if (code === 40 || code === 50 || code === 51) part[code] = number;
  }
  for (const { kind, points: all, layer, flags, 40: radius, 50: from, 51: to } of parts) {
    const fixed = /support|abut|found|rock|fixed/i.test(layer), points = kind === "LWPOLYLINE" ? all.slice(1) : all;
    if (/^(LW)?POLYLINE$/.test(kind) && points.length > 1) {
      const isClosed = flags % 2 === 1 || distance(points[0], points.at(-1)) === 0, bent = sides(points).slice(0, isClosed ? undefined : -1).flatMap((side) => bendLine(...side));
      if (isClosed) outlines.push({ points: bent, fixed }); else paths.push({ points: [...bent, points.at(-1).slice(0, 2)], fixed });
    } else if (kind === "LINE") paths.push({ points: points.map((point) => point.slice(0, 2)), fixed });
    else if (kind === "ARC") {
      const turn = ((((to - from) % 360) + 360) % 360) * (Math.PI / 180), [start, end] = [from, to].map((angle) => plus(points[0], rotate([radius, 0], (angle * Math.PI) / 180)));
      paths.push({ points: [...bendLine([...start, Math.tan(turn / 4)], end), end], fixed });
    }
  }
  return [...outlines.filter(({ points }) => points.length > 2), ...traceFaces(paths)];
}
/** What lines enclose together: the bounded faces of their plane graph, each anticlockwise. */
function traceFaces(paths) {
  const values = paths.flatMap(({ points }) => points.flat()), near = 1e-5 * values.reduce((most, value) => Math.max(most, Math.abs(value)), 0), nodes = [];
  const nodeAt = (point) => { const k = nodes.findIndex((node) => distance(point, node) <= near); return k < 0 ? nodes.push(point) - 1 : k; };
  const heading = (from, to) => Math.atan2(to[1] - from[1], to[0] - from[0]);
  const links = new Map(); // both ways along each line, once where it is drawn twice
  for (const { points, fixed } of paths) for (const own of [points, [...points].reverse()]) {
    const [from, to] = [nodeAt(own[0]), nodeAt(own.at(-1))], middle = own[Math.floor(own.length / 2)].map((value) => Math.round(value / near / 100));
    if (from !== to) links.set(`${from} ${to} ${own.length > 2 ? middle : ""}`, { from, to, points: own, fixed, angle: heading(own[0], own[1]), back: heading(own.at(-1), own.at(-2)) });
  }
  /** The next line on the left: from the way back, the first one clockwise. */
  const follow = ({ to, back }) => {
    const turn = ({ angle }) => { const by = (((back - angle) % (2 * Math.PI)) + 2 * Math.PI) % (2 * Math.PI); return by > 1e-9 && by < 2 * Math.PI - 1e-9 ? by : 2 * Math.PI; };
    return [...links.values()].filter(({ from }) => from === to).reduce((best, link) => (turn(link) < turn(best) ? link : best));
  };
  const seen = new Set(), faces = [];
  for (const first of links.values()) {
    const own = [];
    for (let link = first; !seen.has(link); link = follow(link)) { seen.add(link); own.push(link); }
    const points = own.flatMap((link) => link.points.slice(0, -1));
    if (points.length > 2 && measure([points]).area > 0) faces.push({ points, fixed: 2 * own.filter(({ fixed }) => fixed).length > own.length });
  }
  return faces;
}

/** The convex hull of points, anticlockwise (Andrew's monotone chain). */
function findHull(points) {
  const sorted = [...points].sort(([x, y], [u, v]) => x - u || y - v), half = (own) => own.reduce((chain, point) => {
    while (chain.length > 1 && turnOf(minus(chain.at(-1), chain.at(-2)), minus(point, chain.at(-1))) <= 1e-9) chain.pop();
    return [...chain, point];
  }, []);
  return [half(sorted), half(sorted.reverse())].flatMap((chain) => chain.slice(0, -1));
}
/** Outlines of the stones of an arch, {points, fixed}, by their hulls. */
function traceStones({ bodies }) {
  const pieces = placePieces(bodies), pointsOf = (body) => pieces.filter((_, piece) => bodies.owner[piece] === body).flat();
  return bodies.mass.map((_, body) => ({ points: findHull(pointsOf(body)), fixed: bodies.inverse_mass[body][0] === 0 }));
}
/** Outlines as GeoJSON, as archfem reads them. */
const writeGeoJson = (outlines) => JSON.stringify({ type: "FeatureCollection", features: outlines.map(({ points, fixed }, k) => ({ type: "Feature", properties: { name: `stone ${k + 1}`, fixed }, geometry: { type: "Polygon", coordinates: [[...points, points[0]]] } })) });

/** An outline in metres, anticlockwise, without points that repeat, and its hull; others than nearly convex ones are refused in words. */
function tidyOutline({ points, fixed }, number, unit) {
  const scaled = points.map((point) => point.map((value) => value * unit)), ring = sides(scaled).filter(([one, other]) => !(distance(one, other) <= TOUCHING)).map(([one]) => one);
  if (ring.length < 3 || !ring.flat().every(Number.isFinite)) refuse(`outline ${number} has no area: draw each stone as a closed line, and choose the unit of the drawing`);
  if (measure([ring]).area < 0) ring.reverse();
  const edges = sides(ring).map(([from, to]) => minus(to, from)), turned = sides(edges).reduce((sum, [one, other]) => sum + turnOf(one, other), 0);
  if (Math.abs(turned - 2 * Math.PI) > 1e-6) refuse(`outline ${number} crosses itself: draw it anew`);
  // stones touch by their hulls, and have the mass of their outline
  const hull = findHull(ring);
  if (measure([hull]).area > 1.03 * measure([ring]).area) refuse(`outline ${number} is not convex: cut the stone into convex ones, or run the drawing with archfem`);
  return { ring, hull, fixed };
}
/** Where two outlines touch along an edge: the ends of the joint, or null. */
function findJoint(one, other) {
  for (const [start, end] of sides(one)) {
    const length = distance(start, end), along = minus(end, start).map((value) => value / length);
    for (const [a, b] of sides(other)) {
      const [from, to] = [b, a].map((point) => minus(point, start)), low = Math.max(0, dot(from, along)), high = Math.min(length, dot(to, along));
      const away = Math.max(Math.abs(cross(from, along)), Math.abs(cross(to, along)));
      if (away < TOUCHING && high - low > 10 * TOUCHING) return [low, high].map((place) => mix(start, end, place / length));
    }
  }
  return null;
}
/** Depth by which two convex outlines are in each other; below zero they are apart. */
function findOverlap(one, other) {
  const depth = ([start, end], points) => Math.max(...points.map((point) => cross(minus(end, start), minus(point, start)))) / distance(start, end);
  const least = (ring, points) => Math.min(...sides(ring).map((side) => depth(side, points)));
  return Math.min(least(one, other), least(other, one));
}

/** The arch of outlines: joints where they touch; the lowest stones are supports where none is given. */
function assembleOutlines(outlines, unit, parameters) {
  if (outlines.length < 2) refuse("the drawing has no closed outlines: draw each stone as a closed polyline (DXF) or a Polygon (GeoJSON)");
  if (outlines.length > 70) refuse(`${outlines.length} outlines: a page takes up to 60 stones; run the drawing with archfem`);
  const tidy = outlines.map((each, k) => tidyOutline(each, k + 1, unit)), rings = tidy.map(({ hull }) => hull), foot = (ring) => Math.min(...ring.map(([, y]) => y));
  const low = Math.min(...rings.map(foot)), size = Math.max(...rings.flat(2)) - Math.min(...rings.flat(2));
  if (size > 500) refuse(`the drawing is ${size.toFixed(0)} m large: choose its unit`);
  const given = tidy.some(({ fixed }) => fixed), fixed = tidy.flatMap((each, k) => ((given ? each.fixed : foot(each.ring) < low + 0.02 * size) ? [k] : []));
  if (fixed.length === rings.length) refuse("all stones are supports: none is left to fall");
  const joints = [];
  rings.forEach((one, a) => rings.slice(a + 1).forEach((other, k) => {
    const b = a + 1 + k, overlap = findOverlap(one, other), ends = findJoint(one, other);
    if (overlap > 5 * TOUCHING) refuse(`outlines ${a + 1} and ${b + 1} are in each other by ${(1e3 * overlap).toFixed(0)} mm: stones may only touch`);
    if (ends) joints.push({ blocks: [a, b], ends, friction: FRICTION, cohesion: 0 });
  }));
  const alone = rings.findIndex((_, k) => !fixed.includes(k) && !joints.some(({ blocks }) => blocks.includes(k)));
  if (alone >= 0) refuse(`outline ${alone + 1} touches no other: draw it within 3 mm of its neighbours`);
  const shapes = rings.map((ring) => [ring]), exact = tidy.map(({ ring }) => measure([ring]));
  const bodies = makeBodies(shapes, exact, fixed, { density: STONE, level: low }, FRICTION);
  return { bodies, joints, sizes: exact.map(({ area }) => Math.sqrt(area)), parameters };
}

/** An accelerogram of two columns, time [s] and acceleration in a unit [m/s²], or of an AT2 file [g]. */
function readRecord(text, name, unit = 9.81) {
  const numbers = (lines) => lines.flatMap((line) => line.trim().split(/[\s,;]+/)).filter(Boolean).map(Number), lines = text.split(/\r?\n/);
  const head = lines.slice(0, 6).join(" ").match(/DT\s*=\s*([\d.Ee+-]+)/i);
  let dt, x;
  if (head) {
    dt = Number(head[1]);
    x = numbers(lines.slice(lines.findIndex((line) => /DT\s*=/i.test(line)) + 1));
  } else {
    const rows = lines.filter((line) => /^\s*[-+.\d]/.test(line)).map((line) => numbers([line]));
    if (rows.length < 10 || rows.some((row) => row.length !== 2)) refuse(`${name} is no record: give two columns, time in s and acceleration, or an AT2 file`);
    dt = rows[1][0] - rows[0][0];
    if (rows.some(([time], k) => Math.abs(time - rows[0][0] - k * dt) > 0.01 * dt)) refuse(`${name} has uneven time steps: give even ones`);
    x = rows.map((row) => (row[1] * unit) / 9.81);
  }
  const peak = x.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
  if (peak > MOST_G) refuse(`${name} reaches ${peak.toFixed(2)} g, more than any earthquake: choose the unit of its values`);
  if (x.some(Number.isNaN) || !(dt > 0 && dt < 0.2) || !(peak > 0) || x.length * dt > 120) refuse(`${name}: ${x.length} values every ${dt} s up to ${peak.toFixed(2)} g; give at most 120 s, in even steps below 0.2 s`);
  return { name, dt, x: x.map((value) => value * 9.81), y: x.map(() => 0), peak: peak * 9.81, strength: Math.round(100 * peak) / 100 };
}

// The player of a run: displacements and joints over time, unpacked and drawn as SVG.
"use strict";
(() => {
  const SVG = "http://www.w3.org/2000/svg";
  const NOTHING = -(2 ** 29); // stands for an undefined value
  const WIDE = 1000; // width of the picture, in its own units
  const ARROW = [[-0.5, -0.09], [0.1, -0.09], [0.1, -0.25], [0.5, 0], [0.1, 0.25], [0.1, 0.09], [-0.5, 0.09]];
  const LENGTH = 0.55, APART = 0.14; // of arrows, relative to the depth of their joint
  const SNUG = 0.9 / (2 * APART + 0.5 * LENGTH); // relative to the distance to the next joint
  const SHORTEST = 30; // depth that arrows are made for at least, where there is room
  const KILO = 1e3;

  /** Undo what packing.py does: whole numbers of a quantum, differences, planes of bytes. */
  async function unpack(head, text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    const raw = new Uint8Array(await new Response(stream).arrayBuffer());
    const arrays = {};
    let start = 0;
    for (const { name, shape: [series, samples], quantum } of head) {
      const count = series * samples;
      const values = series === 1 ? new Float64Array(count) : new Float32Array(count);
      const [a, b, c, d] = [0, 1, 2, 3].map((k) => raw.subarray(start + k * count, start + (k + 1) * count));
      let whole = 0;
      for (let i = 0; i < count; i++) {
        if (i % samples === 0) whole = 0;
        const folded = (a[i] | (b[i] << 8) | (c[i] << 16) | (d[i] << 24)) >>> 0;
        whole += (folded >>> 1) ^ -(folded & 1);
        values[i] = whole === NOTHING ? NaN : whole * quantum;
      }
      start += 4 * count;
      arrays[name] = { samples, values, row: (k) => values.subarray(k * samples, (k + 1) * samples) };
    }
    return arrays;
  }

  const element = (name, attributes = {}, parent = null) => {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (parent) parent.append(made);
    return made;
  };
  const path = (points, closed) => points.map(([x, y], k) => `${k ? "L" : "M"}${x.toFixed(2)} ${y.toFixed(2)}`).join("") + (closed ? "Z" : "");

  /** Number of the last time that is not later; times increase. */
  function before(times, time) {
    let low = 0, high = times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= time) low = middle; else high = middle - 1;
    }
    return low;
  }
  function nearest(times, time) {
    const k = before(times, time);
    return k + 1 < times.length && times[k + 1] - time < time - times[k] ? k + 1 : k;
  }
  /** The frames around a time, and the share of the later one. */
  function between(times, time) {
    const first = Math.min(before(times, time), Math.max(times.length - 2, 0)), last = Math.min(first + 1, times.length - 1);
    const share = last > first ? (time - times[first]) / (times[last] - times[first]) : 0;
    return [first, last, Math.min(Math.max(share, 0), 1)];
  }

  /** A round step that gives about so many parts. */
  function step(span, parts) {
    const least = span / parts, power = 10 ** Math.floor(Math.log10(least));
    return [1, 2, 5, 10].map((k) => k * power).find((each) => each >= least * 0.999);
  }
  const words = (value) => String(Number(value.toPrecision(6))).replace("-", "−");

  /** A chart over time with a cursor; a click or a drag sets the time. */
  class Chart {
    constructor(svg, end, onTime) {
      const [, , wide, high] = svg.getAttribute("viewBox").split(" ").map(Number);
      Object.assign(this, { svg, end, wide, left: 52, right: wide - 8, top: 22, bottom: high - 22 });
      svg.addEventListener("pointerdown", (event) => { svg.setPointerCapture(event.pointerId); this.dragged = true; onTime(this.timeAt(event)); });
      svg.addEventListener("pointermove", (event) => { if (this.dragged) onTime(this.timeAt(event)); });
      for (const name of ["pointerup", "pointercancel"]) svg.addEventListener(name, () => { this.dragged = false; });
    }
    timeAt(event) {
      const box = this.svg.getBoundingClientRect(), x = ((event.clientX - box.left) / box.width) * this.wide;
      return Math.min(Math.max((x - this.left) / (this.right - this.left), 0), 1) * this.end;
    }
    x(time) { return this.left + (time / this.end) * (this.right - this.left); }
    y(value) {
      const [low, high] = this.range;
      return this.bottom - ((Math.min(Math.max(value, low), high) - low) / (high - low)) * (this.bottom - this.top);
    }
    draw({ title, range, ticks, lines, curves, instants }) {
      this.range = range;
      this.top = instants.some(([, name]) => name) ? 40 : 22; // names of instants stand below the title
      this.svg.replaceChildren();
      // paper has larger type: names grow upwards from the axes
      element("text", { x: this.left, y: this.top - 8, dy: this.top > 22 ? "-1.25em" : 0 }, this.svg).textContent = title;
      for (const tick of ticks) {
        element("path", { class: "zero", d: `M${this.left} ${this.y(tick)}H${this.right}` }, this.svg);
        element("text", { x: this.left - 6, y: this.y(tick), "text-anchor": "end", "dominant-baseline": "central" }, this.svg).textContent = words(tick);
      }
      const apart = step(this.end, this.right - this.left > 600 ? 10 : 5);
      for (let time = 0; time <= this.end * 1.0001; time += apart) {
        const last = time + apart > this.end * 1.0001;
        element("text", { x: this.x(time), y: this.bottom + 6, "dominant-baseline": "hanging", "text-anchor": last && this.x(time) > this.right - 20 ? "end" : "middle" }, this.svg).textContent = words(time) + (last ? " s" : "");
      }
      for (const [time] of instants) element("path", { class: "instant", d: `M${this.x(time)} ${this.top}V${this.bottom}` }, this.svg);
      // paper has larger type: near names are one text, and those at an edge grow away from it
      const named = instants.filter(([, name]) => name).sort(([one], [other]) => one - other);
      const [first, last] = [named.at(0), named.at(-1)].map((each) => (each ? each[0] : 0));
      const near = named.length > 1 && last - first < 0.4 * this.end;
      for (const [time, name] of near ? [[(first + last) / 2, named.map(([, each]) => each).join(", ")]] : named) {
        const anchor = time < 0.3 * this.end ? "start" : time > 0.7 * this.end ? "end" : "middle";
        element("text", { class: "name", x: this.x(time), y: this.top - 5, "text-anchor": anchor }, this.svg).textContent = name;
      }
      for (const line of lines) element("path", { class: "limit", d: `M${this.left} ${this.y(line)}H${this.right}` }, this.svg);
      for (const { times, values, name } of curves) element("path", { class: `curve ${name}`, d: this.curve(times, values) }, this.svg);
      element("path", { class: "axis", d: `M${this.left} ${this.top}V${this.bottom}H${this.right}` }, this.svg);
      this.cursor = element("path", { class: "cursor" }, this.svg);
      element("rect", { class: "pick", x: this.left, y: this.top, width: this.right - this.left, height: this.bottom - this.top }, this.svg);
    }
    /** A line through all samples, broken where there is none; dense ones by their extremes. */
    curve(times, values) {
      const parts = [];
      let column = null, open = false;
      const put = (x, y) => { parts.push(`${open ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`); open = true; };
      const flush = () => { if (column) { put(column.x, column.low); if (column.high !== column.low) put(column.x, column.high); column = null; } };
      for (let i = 0; i < times.length; i++) {
        if (Number.isNaN(values[i])) { flush(); open = false; continue; }
        const x = Math.round(this.x(times[i]) * 2) / 2, y = this.y(values[i]);
        if (column && column.x === x) { column.low = Math.min(column.low, y); column.high = Math.max(column.high, y); continue; }
        flush();
        column = { x, low: y, high: y };
      }
      flush();
      return parts.join("");
    }
    point(time) { this.cursor.setAttribute("d", `M${this.x(time).toFixed(1)} ${this.top}V${this.bottom}`); }
  }

  class Player {
    constructor(root, scene, arrays) {
      Object.assign(this, { root, scene, arrays, by: scene.magnification, chosen: scene.chosen, playing: false });
      const [low, high] = scene.box;
      this.scale = WIDE / (high[0] - low[0]);
      this.place = ([x, y]) => [(x - low[0]) * this.scale, (high[1] - y) * this.scale];
      this.height = (high[1] - low[1]) * this.scale;
      this.find = (name) => root.querySelector(`.player-${name}`);
      this.prepare();
      this.control();
      this.ground();
      this.choose(this.chosen);
      this.show(scene.still);
    }

    /** Make what is drawn, once. */
    prepare() {
      const { scene } = this, stage = this.find("stage");
      stage.setAttribute("viewBox", `0 0 ${WIDE} ${this.height.toFixed(1)}`);
      const layer = (name) => element("g", { class: name }, stage);
      if (scene.level !== null) {
        const y = this.place([0, scene.level])[1];
        element("path", { class: "level", d: `M0 ${y}H${WIDE}` }, stage);
      }
      const ghosts = layer("ghosts"), blocks = layer("blocks");
      let first = 0;
      this.blocks = scene.blocks.map((block, number) => {
        const points = scene.points.slice(first, first + block.count).map(this.place);
        element("path", { class: "ghost", d: path(points, true) }, ghosts);
        const drawn = element("path", { class: block.kind, "data-block": number }, blocks);
        element("title", {}, drawn).textContent = block.name;
        const own = { drawn, first, count: block.count };
        first += block.count;
        return own;
      });
      const middles = scene.joints.map(({ ends: [one, other] }) => this.place([(one[0] + other[0]) / 2, (one[1] + other[1]) / 2]));
      scene.joints.forEach((joint, j) => {
        const apart = middles.map(([x, y], k) => (scene.joints[k].judged ? Math.hypot(x - middles[j][0], y - middles[j][1]) : 0));
        joint.room = Math.min(...apart.filter((distance) => distance > 0));
      });
      this.layers = Object.fromEntries(["wedges", "gap-rims", "gaps", "halos", "links", "thrusts", "slips", "hinges"].map((name) => [name, layer(name)]));
      this.mark = element("path", { class: "chosen" }, stage);
      const hits = layer("hits");
      const order = scene.joints.map((_, k) => k).sort((a, b) => scene.joints[a].judged - scene.joints[b].judged);
      this.hits = [];
      for (const k of order) {
        const hit = element("path", { class: "hit", "data-joint": k }, hits);
        element("title", {}, hit).textContent = scene.joints[k].name;
        hit.addEventListener("click", () => this.choose(k));
        this.hits[k] = hit;
      }
    }

    /** Buttons and sliders. */
    control() {
      const { scene } = this, time = this.find("time"), by = this.find("magnification"), note = this.find("note");
      time.max = scene.end;
      // a key moves by a round two-hundredth of the run, as a millisecond would take thousands
      const keys = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10 };
      const stride = step(scene.end, 200);
      time.addEventListener("keydown", (event) => {
        if (!(event.key in keys)) return;
        event.preventDefault();
        this.pause();
        this.show(Math.min(Math.max(this.time + keys[event.key] * stride, 0), scene.end));
      });
      const choice = this.find("choice");
      scene.joints.forEach(({ name }, j) => choice.append(new Option(name, j)));
      choice.addEventListener("input", () => this.choose(Number(choice.value)));
      time.addEventListener("input", () => { this.pause(); this.show(Number(time.value)); });
      this.find("play").addEventListener("click", () => (this.playing ? this.pause() : this.play()));
      this.find("by").hidden = !(this.arrays.frame_time || this.arrays.opening);
      this.most = Math.max(10 * scene.magnification, 10);
      by.value = Math.log(this.by) / Math.log(this.most);
      by.addEventListener("input", () => {
        this.by = Number((this.most ** Number(by.value)).toPrecision(2));
        this.show(this.time);
      });
      const thinned = scene.every > 1 ? `Of the recorded steps, one in ${scene.every} is shown here.` : "";
      note.hidden = !(scene.note || thinned);
      note.textContent = `${scene.note} ${thinned}`;
    }

    /** The ground's acceleration. */
    ground() {
      const { scene, arrays } = this, times = arrays.ground_time.row(0);
      const [level, upright] = [0, 1].map((k) => arrays.ground.row(k));
      const largest = Math.max(...[level, upright].map((each) => each.reduce((most, value) => Math.max(most, Math.abs(value)), 0))) || 1;
      const both = upright.some((value) => value !== 0), apart = step(2 * largest, 5);
      const top = 1.06 * largest, ticks = [];
      for (let k = -Math.floor(top / apart); k * apart <= top; k++) ticks.push(k * apart);
      const instants = [];
      if (scene.mechanism !== null) instants.push([scene.mechanism, "mechanism"]);
      if (scene.peak !== null) instants.push([scene.peak, ""]);
      if (scene.loose !== null) instants.push([scene.loose, `blocks ${scene.state}`]);
      this.instants = instants.map(([time]) => [time, ""]);
      // on a phone a wide chart would have tiny words
      if (matchMedia("screen and (max-width: 44rem)").matches) this.find("ground").setAttribute("viewBox", this.find("e").getAttribute("viewBox"));
      this.charts = { ground: new Chart(this.find("ground"), scene.end, (time) => { this.pause(); this.show(time); }) };
      const curves = [{ times, values: level, name: "first" }];
      if (both) curves.unshift({ times, values: upright, name: "second" });
      this.charts.ground.draw({ title: `ground acceleration [m/s²]${both ? ": horizontal strong, vertical faint" : ""}`, range: [-top, top], ticks, lines: [], curves, instants });
    }

    /** Show another joint below. */
    choose(number) {
      const { scene, arrays } = this, joint = scene.joints[number], times = arrays.time.row(0);
      this.chosen = number;
      this.find("choice").value = number;
      const onTime = (time) => { this.pause(); this.show(time); };
      for (const name of ["e", "ratio"]) this.charts[name] ??= new Chart(this.find(name), scene.end, onTime);
      const e = arrays.e.row(number), ratio = arrays.ratio.row(number);
      this.charts.e.draw({
        title: "e = M / (N h) [–], extrados at +0.5", range: [-0.55, 0.55], ticks: [-0.5, 0, 0.5],
        lines: [-scene.hinge, scene.hinge], curves: [{ times, values: e, name: "eccentricity" }], instants: this.instants,
      });
      const largest = ratio.reduce((most, value) => (value > most ? value : most), 0), limit = joint.limit;
      const top = limit === null ? Math.max(largest * 1.1, 0.1) : 1.25 * limit, apart = step(top, 4), ticks = [];
      for (let tick = 0; tick <= top * 1.0001; tick += apart) ticks.push(tick);
      this.charts.ratio.draw({
        title: "V / N [–]" + (largest > top ? ", cut off above" : ""), range: [0, top], ticks, lines: limit === null ? [] : [limit],
        curves: [{ times, values: ratio, name: "friction" }], instants: this.instants,
      });
      if (this.time !== undefined) this.show(this.time);
    }

    /** Displacements at a time: of outlines, and of both ends of each joint. */
    moved(time) {
      const { scene, arrays } = this, falling = scene.loose !== null && time >= scene.loose, name = falling ? "fall" : "frame";
      const times = arrays[`${name}_time`] ? arrays[`${name}_time`].row(0) : [];
      this.moves = times.length > 1 || Math.abs(times[0] - time) < 2e-3; // the largest displacement may be the only one
      if (!this.moves) return { falling, by: 0, points: () => 0, ends: () => 0 };
      const [first, last, share] = between(times, time);
      const reader = (packed) => (k) => {
        const at = k * packed.samples;
        return (1 - share) * packed.values[at + first] + share * packed.values[at + last];
      };
      return { falling, by: falling ? 1 : this.by, points: reader(arrays[`${name}_points`]), ends: falling ? () => 0 : reader(arrays.frame_ends) };
    }

    /** Draw an instant. */
    show(time) {
      const { scene, arrays } = this, { falling, by, points, ends } = this.moved(time);
      this.time = time;
      for (const { drawn, first, count } of this.blocks) {
        const corners = [];
        for (let k = first; k < first + count; k++) {
          const [x, y] = scene.points[k];
          corners.push(this.place([x + by * points(2 * k), y + by * points(2 * k + 1)]));
        }
        drawn.setAttribute("d", path(corners, true));
      }
      const record = nearest(arrays.time.row(0), time);
      this.ends = scene.joints.map((joint, j) => joint.ends.map(([x, y], k) => this.place([x + by * ends(4 * j + 2 * k), y + by * ends(4 * j + 2 * k + 1)])));
      const counts = this.marks(falling ? null : record);
      this.mark.setAttribute("d", falling ? "" : path(this.ends[this.chosen]));
      this.hits.forEach((hit, j) => hit.setAttribute("d", falling ? "" : path(this.ends[j])));
      for (const chart of Object.values(this.charts)) chart.point(time);
      this.tell(falling, record, by, counts);
    }

    /** Thrust line, hinges, sliding and open joints of a record; none while blocks fall. */
    marks(record) {
      const { scene, arrays, layers } = this, found = { hinging: 0, sliding: 0, open: 0 };
      for (const layer of Object.values(layers)) layer.replaceChildren();
      if (record === null) return found;
      const thrust = scene.joints.map((joint, j) => {
        const e = arrays.e.row(j)[record], [[x0, y0], [x1, y1]] = this.ends[j];
        return joint.judged && !Number.isNaN(e) ? [x0 + (0.5 + e) * (x1 - x0), y0 + (0.5 + e) * (y1 - y0)] : null;
      });
      for (const [one, other] of scene.links) {
        if (!thrust[one] || !thrust[other]) continue;
        const d = path([thrust[one], thrust[other]]);
        element("path", { class: "link-halo", d }, layers.halos);
        element("path", { class: "link", d }, layers.links);
      }
      thrust.forEach((point) => { if (point) element("circle", { class: "thrust", cx: point[0].toFixed(2), cy: point[1].toFixed(2), r: 2.3 }, layers.thrusts); });
      scene.joints.forEach((joint, j) => {
        const flags = arrays.flags.row(j)[record], side = (flags & 3) - 1, ends = this.ends[j];
        if (arrays.opening && !this.moves) this.wedge(joint, ends, arrays.opening.row(j)[record], flags & 32);
        if (!joint.judged) return;
        if (flags & 8) {
          found.open += 1;
          element("path", { class: "gap-rim", d: path(ends) }, layers["gap-rims"]);
          element("path", { class: "gap", d: path(ends) }, layers.gaps);
        }
        if (flags & 4) {
          found.sliding += 1;
          for (const d of this.arrows(joint, ends, flags & 16 ? 1 : -1)) element("path", { class: "slip", d }, layers.slips);
        }
        if (side !== 0) {
          found.hinging += 1;
          const [x, y] = ends[side > 0 ? 1 : 0];
          element("circle", { class: "hinge", cx: x.toFixed(2), cy: y.toFixed(2), r: 6 }, layers.hinges);
        }
      });
      return found;
    }

    /** An opening between blocks that are drawn where they stand, as wide as it is magnified. */
    wedge(joint, ends, opening, intrados) {
      const wide = 0.5 * opening * this.by * this.scale;
      if (wide < 0.4) return;
      const [nx, ny] = joint.normal, [wider, closed] = intrados ? ends : [ends[1], ends[0]];
      const corners = [[wider[0] + wide * nx, wider[1] - wide * ny], closed, [wider[0] - wide * nx, wider[1] + wide * ny]];
      element("path", { class: "wedge", d: path(corners, true) }, this.layers.wedges);
    }

    /** Outlines of two opposite arrows beside a joint: the higher block's, then the lower's. */
    arrows(joint, [[x0, y0], [x1, y1]], sense) {
      const depth = Math.max(Math.hypot(x1 - x0, y1 - y0), 1e-9), along = [(x1 - x0) / depth, (y1 - y0) / depth];
      const right = along[1] * joint.normal[0] + along[0] * joint.normal[1] > 0 ? 1 : -1;
      const normal = [right * along[1], -right * along[0]], drawn = Math.min(Math.max(depth, SHORTEST), SNUG * joint.room);
      const size = LENGTH * drawn, away = APART * drawn;
      const middle = [(x0 + x1) / 2, (y0 + y1) / 2];
      return [1, -1].map((side) => path(ARROW.map(([a, b]) => [0, 1].map((k) => middle[k] + side * (away * normal[k] + size * (sense * a * along[k] + b * normal[k])))), true));
    }

    /** Say in words and numbers what is seen. */
    tell(falling, record, by, counts) {
      const { scene, arrays } = this, joint = scene.joints[this.chosen], times = (value) => `× ${words(value)}`;
      const failing = Object.entries(counts).filter(([, count]) => count).map(([name, count]) => `${count} ${name}`);
      const scale = this.moves ? (by === 1 ? "true to scale" : `displacements ${times(by)}`) : arrays.opening ? `openings ${times(this.by)}` : "blocks where they stand";
      const peak = scene.peak !== null && Math.abs(scene.peak - this.time) < 2e-3 ? ["largest displacement"] : [];
      this.find("state").textContent = [`t = ${this.time.toFixed(3)} s`, ...peak, ...(falling ? [`blocks are ${scene.state}`] : failing), scale].join(" · ");
      this.find("time").value = this.time;
      this.find("times").textContent = times(this.by);
      const number = (name, digits, factor = 1) => {
        const value = arrays[name].row(this.chosen)[record] * factor;
        return Number.isNaN(value) ? "open" : words(Number(value.toFixed(digits)));
      };
      const values = [["e", number("e", 3)], ["V / N", number("ratio", 3) + (joint.limit === null ? "" : ` of ${words(joint.limit)}`)], ["N", `${number("normal", 1, 1 / KILO)} kN`]];
      if (arrays.opening) values.push(["open by", `${number("opening", 2, KILO)} mm`]);
      const readout = this.find("readout"), name = document.createElement("b");
      name.textContent = joint.name;
      readout.replaceChildren(name, ...(falling ? [] : values).map(([label, value]) => {
        const item = document.createElement("span"), bold = document.createElement("b");
        bold.textContent = value;
        item.append(`${label} = `, bold);
        return item;
      }));
    }

    play() {
      if (this.time >= this.scene.end) this.show(0);
      this.playing = true;
      this.find("play").textContent = "❚❚";
      let last = performance.now();
      const tick = (now) => {
        if (!this.playing) return;
        const next = Math.min(this.time + ((now - last) / KILO) * Number(this.find("speed").value), this.scene.end);
        last = now;
        this.show(next);
        if (next >= this.scene.end) this.pause(); else requestAnimationFrame(tick);
      };
      requestAnimationFrame(tick);
    }
    pause() {
      this.playing = false;
      this.find("play").textContent = "▶";
    }
  }

  async function begin(root) {
    const status = root.querySelector(".player-state");
    try {
      const scene = JSON.parse(root.querySelector("script").textContent);
      root.player = new Player(root, scene, await unpack(scene.pack, scene.bytes));
      root.dataset.ready = "yes";
    } catch (error) {
      status.textContent = typeof DecompressionStream === "undefined" ? "this browser is too old for the player (no DecompressionStream)" : `the player failed: ${error.message}`;
      throw error;
    }
  }
  for (const root of document.querySelectorAll("figure.player")) begin(root);
})();

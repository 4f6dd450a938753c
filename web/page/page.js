"use strict";
// The page of shoal. Units: m, s, rad; x forward, y left, so the map has y upwards.
//
//   stream or tape --> Layer (fleet, frame, trails) --> Stage (a canvas) ; vitals --> table, charts ; clicks --> act

const $ = (id) => document.getElementById(id);
const token = new URLSearchParams(location.search).get("token") ?? "";
const OBSTACLE = 1, ARRIVED = 2, SILENT = 4;
const TRAIL_MAX = 160, EVENTS_MAX = 300, CHART_MAX = 120, TERM_PX = 70;
const FLASH_MS = 1500, NAMES_MAX = 40;
/** Poses older than this are drawn in the last colour, ms. */
const OLD_MS = 60;

const ask = async (path, options = {}) => {
  const headers = { "x-shoal-token": token, ...(options.body && { "content-type": "application/json" }) };
  const response = await fetch(path, { ...options, headers });
  if (!response.ok) throw new Error((await response.text()).trim() || `${response.status}`);
  return response.json();
};

const element = (tag, text = "", attributes = {}) => {
  const made = document.createElement(tag);
  made.textContent = text;
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
};

let noticeTimer = 0;
/** Shows a message in the line below the head for this time, or until the next message; 0 is without a limit. */
const say = (words, bad = false, seconds = 6) => {
  $("notice").textContent = words;
  $("notice").classList.toggle("bad", bad);
  $("notice").hidden = !words;
  clearTimeout(noticeTimer);
  if (words && seconds) noticeTimer = setTimeout(() => say(""), 1000 * seconds);
};

// ---- colours -------------------------------------------------------------------------------------------------------

let tones = {};
const readTones = () => {
  const style = getComputedStyle(document.documentElement);
  const names = ["paper", "panel", "ink", "faint", "line", "stone", "stone-edge", "runs", "arrived", "silent", "chosen", "contact", "goal",
    "young", "old", "moving"];
  tones = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
};
/** The colours of layers that are compared. */
/** A record by its name, without the directory. */
const nameOf = (path) => path.split("/").pop();
const layerTone = (layer) => (layer.number === 0 ? tones.runs : tones.old);

// ---- what is drawn -------------------------------------------------------------------------------------------------

/** A fleet with its newest frame. */
class Layer {
  constructor(number, fleet) {
    this.number = number;
    this.fleet = fleet;
    this.frame = null;
    this.trails = new Map();
    this.flashes = [];
    this.links = [];
  }

  take(frame) {
    const back = this.frame && frame.tick < this.frame.tick;
    if (back) this.trails.clear();
    this.frame = frame;
    for (const [index, flags, x, y] of frame.bodies) {
      if (flags & OBSTACLE) continue;
      const trail = this.trails.get(index) ?? [];
      const last = trail[trail.length - 1];
      const step = 0.3 * (this.fleet.members[index]?.radius_m ?? 0.2);
      if (!last || Math.hypot(last[0] - x, last[1] - y) > step) trail.push([x, y]);
      if (trail.length > TRAIL_MAX) trail.shift();
      this.trails.set(index, trail);
    }
  }

  robots() {
    return this.frame ? this.frame.bodies.filter((body) => !(body[1] & OBSTACLE)) : [];
  }

  body(slot) {
    return this.robots().find((body) => body[0] === slot);
  }
}

/** A canvas with one layer, or two on top of each other. */
class Stage {
  constructor(layers) {
    this.layers = layers;
    this.box = element("div", "", { class: "stage" });
    this.canvas = element("canvas", "", { tabindex: "0", role: "img", "aria-label": "Map of the robots" });
    this.box.append(this.canvas);
    if (layers.length > 1 || layers[0].fleet.record) {
      const words = layers.map((layer) => `${["●", "○"][layer.number % 2]} ${nameOf(layer.fleet.id)}`).join("   ");
      this.box.append(element("p", words, { class: "title" }));
    }
    $("stages").append(this.box);
    this.view = null;
    this.add = null;
    this.pointers = new Map();
    this.listen();
    new ResizeObserver(() => this.resize()).observe(this.box);
  }

  /** The part of the plane in which everything is, and has been. */
  extent() {
    let [low, high] = this.seen ?? [[Infinity, Infinity], [-Infinity, -Infinity]];
    const add = (x, y, r) => {
      low = [Math.min(low[0], x - r), Math.min(low[1], y - r)];
      high = [Math.max(high[0], x + r), Math.max(high[1], y + r)];
    };
    for (const { fleet, frame } of this.layers) {
      for (const chain of fleet.walls_m ?? []) for (const [x, y] of chain) add(x, y, 0);
      for (const thing of fleet.things) {
        for (const [x, y] of thing.ends_m ?? thing.corners_m) add(x, y, thing.radius_m ?? 0);
      }
      for (const [index, flags, x, y, , gx, gy] of frame?.bodies ?? []) {
        const r = 2 * (flags & OBSTACLE ? 0.2 : fleet.members[index]?.radius_m ?? 0.2);
        add(x, y, r);
        if (gx !== undefined) add(gx, gy, r);
      }
      for (const { arm } of fleet.members) {
        if (arm) add(arm.base_m[0], arm.base_m[1], arm.links_m[0] + arm.links_m[1]);
      }
    }
    if (low[0] > high[0]) {
      const [[x0, x1], [y0, y1]] = this.layers[0].fleet.bounds_m;
      return [[x0, y0], [x1, y1]];
    }
    this.seen = [low, high];
    return this.seen;
  }

  /** A map that shows everything goes on doing so when something comes that it does not show. */
  follow() {
    if (!this.view?.fitted || !this.seen) return;
    const before = this.seen;
    const now = this.extent();
    if (now.flat().some((value, i) => value !== before.flat()[i])) this.fit();
  }

  fit() {
    const [[x0, y0], [x1, y1]] = this.extent();
    const [width, height] = [this.canvas.clientWidth || 1, this.canvas.clientHeight || 1];
    const scale = 0.92 * Math.min(width / Math.max(x1 - x0, 0.5), height / Math.max(y1 - y0, 0.5));
    this.view = { x: (x0 + x1) / 2, y: (y0 + y1) / 2, scale, fitted: true };
    this.draw();
  }

  resize() {
    const ratio = devicePixelRatio || 1;
    this.canvas.width = Math.round(this.canvas.clientWidth * ratio);
    this.canvas.height = Math.round(this.canvas.clientHeight * ratio);
    if (!this.view || this.view.fitted) this.fit();
    else this.draw();
  }

  zoom(factor, at = [this.canvas.clientWidth / 2, this.canvas.clientHeight / 2]) {
    const before = this.plane(at);
    this.view.scale = Math.min(Math.max(this.view.scale * factor, 1), 4000);
    const after = this.plane(at);
    this.view.x += before[0] - after[0];
    this.view.y += before[1] - after[1];
    this.view.fitted = false;
    this.draw();
  }

  move(dx, dy) {
    this.view.x -= dx / this.view.scale;
    this.view.y += dy / this.view.scale;
    this.view.fitted = false;
    this.draw();
  }

  /** From a place on the canvas to one in the plane, and back. */
  plane([px, py]) {
    const { x, y, scale } = this.view;
    return [x + (px - this.canvas.clientWidth / 2) / scale, y - (py - this.canvas.clientHeight / 2) / scale];
  }

  place([x, y]) {
    const view = this.view;
    return [this.canvas.clientWidth / 2 + (x - view.x) * view.scale, this.canvas.clientHeight / 2 - (y - view.y) * view.scale];
  }

  /** The robot at a place on the canvas, with some pixels of slack. */
  robotAt(at) {
    let best = null;
    for (const layer of this.layers) {
      for (const [index, , x, y] of layer.robots()) {
        const [px, py] = this.place([x, y]);
        const reach = Math.max((layer.fleet.members[index]?.radius_m ?? 0.2) * this.view.scale, 12);
        const distance = Math.hypot(px - at[0], py - at[1]);
        if (distance <= reach && (!best || distance < best.distance)) best = { slot: index, distance };
      }
    }
    return best?.slot ?? null;
  }

  listen() {
    const canvas = this.canvas;
    const at = (event) => [event.offsetX, event.offsetY];
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-0.0015 * event.deltaY), at(event));
    }, { passive: false });
    canvas.addEventListener("contextmenu", (event) => {
      event.preventDefault();
      const slot = this.robotAt(at(event));
      if (slot !== null) openMenu(slot, event.clientX, event.clientY);
    });
    canvas.addEventListener("pointerdown", (event) => {
      closeMenu();
      if (event.button !== 0) return;
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, { from: at(event), to: at(event), moved: false });
      if (this.pointers.size > 1) return this.forget();
      if (app.adds) this.add = { from: this.plane(at(event)), to: this.plane(at(event)) };
      const slot = this.robotAt(at(event));
      const { clientX, clientY } = event;
      if (slot !== null && event.pointerType !== "mouse") {
        this.press = setTimeout(() => { this.pointers.clear(); openMenu(slot, clientX, clientY); }, 600);
      }
    });
    canvas.addEventListener("pointermove", (event) => {
      const pointer = this.pointers.get(event.pointerId);
      if (!pointer) return;
      const [now, before] = [at(event), pointer.to];
      if (Math.hypot(now[0] - pointer.from[0], now[1] - pointer.from[1]) > 4) { pointer.moved = true; clearTimeout(this.press); }
      if (this.pointers.size === 2) {
        const other = [...this.pointers.entries()].find(([id]) => id !== event.pointerId)[1].to;
        const span = (a) => Math.hypot(a[0] - other[0], a[1] - other[1]);
        pointer.to = now;
        return this.zoom(span(now) / Math.max(span(before), 1), [(now[0] + other[0]) / 2, (now[1] + other[1]) / 2]);
      }
      pointer.to = now;
      if (this.add) { this.add.to = this.plane(now); return this.draw(); }
      if (pointer.moved) this.move(now[0] - before[0], now[1] - before[1]);
    });
    const up = (event) => {
      clearTimeout(this.press);
      const pointer = this.pointers.get(event.pointerId);
      this.pointers.delete(event.pointerId);
      if (!pointer || event.type === "pointercancel") return this.forget();
      if (this.add) {
        const { from, to } = this.add;
        this.forget();
        return act({ do: "add", start_m: from, goal_m: to });
      }
      if (pointer.moved) return;
      const slot = this.robotAt(at(event));
      if (slot !== null) return choose(slot);
      const name = app.main?.fleet.members[app.chosen]?.id;
      if (name && app.live) act({ do: "task", robot: name, at_m: this.plane(at(event)), now: event.shiftKey });
    };
    canvas.addEventListener("pointerup", up);
    canvas.addEventListener("pointercancel", up);
  }

  forget() {
    clearTimeout(this.press);
    this.add = null;
    this.draw();
  }

  draw() {
    if (!this.view) return;
    const context = this.canvas.getContext("2d");
    const ratio = devicePixelRatio || 1;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.canvas.clientWidth, this.canvas.clientHeight);
    drawGrid(context, this);
    drawWalls(context, this, this.layers[0]);
    drawThings(context, this, this.layers[0]);
    for (const layer of this.layers) drawLayer(context, this, layer);
    if (this.add) drawAdd(context, this);
    app.drawn += 1;
    this.canvas.dataset.tick = this.layers[0].frame?.tick ?? "";
    this.canvas.dataset.drawn = app.drawn;
  }
}

const line = (context, points) => {
  context.beginPath();
  points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
};

const disc = (context, [x, y], r) => {
  context.beginPath();
  context.arc(x, y, Math.max(r, 0.5), 0, 2 * Math.PI);
};

function drawGrid(context, stage) {
  const wanted = 80 / stage.view.scale;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= wanted);
  const [[x0, y1], [x1, y0]] = [stage.plane([0, 0]), stage.plane([stage.canvas.clientWidth, stage.canvas.clientHeight])];
  context.strokeStyle = tones.line;
  context.fillStyle = tones.faint;
  context.lineWidth = 0.5;
  context.font = "11px system-ui, sans-serif";
  const digits = Math.max(0, -Math.floor(Math.log10(step)));
  for (let x = Math.ceil(x0 / step) * step; x <= x1; x += step) {
    const [px] = stage.place([x, 0]);
    line(context, [[px, 0], [px, stage.canvas.clientHeight]]);
    context.stroke();
    context.fillText(`${x.toFixed(digits)}`, px + 3, stage.canvas.clientHeight - 4);
  }
  for (let y = Math.ceil(y0 / step) * step; y <= y1; y += step) {
    const [, py] = stage.place([0, y]);
    line(context, [[0, py], [stage.canvas.clientWidth, py]]);
    context.stroke();
    context.fillText(`${y.toFixed(digits)}`, 3, py - 3);
  }
}

/** The walls of the map: one path in metres, made once and drawn as the view has it. */
function drawWalls(context, stage, layer) {
  const chains = layer.fleet.walls_m ?? [];
  if (!chains.length) return;
  if (layer.walls?.of !== layer.fleet.walls_m) {
    const path = new Path2D();
    for (const chain of chains) chain.forEach(([x, y], i) => (i ? path.lineTo(x, y) : path.moveTo(x, y)));
    layer.walls = { of: layer.fleet.walls_m, path };
  }
  const [x, y] = stage.place([0, 0]);
  context.save();
  context.transform(stage.view.scale, 0, 0, -stage.view.scale, x, y);
  context.strokeStyle = tones["stone-edge"];
  context.lineWidth = 1.5 / stage.view.scale;
  context.stroke(layer.walls.path);
  context.restore();
}

function drawThings(context, stage, layer) {
  const moved = new Map((layer.frame?.bodies ?? []).filter((body) => body[1] & OBSTACLE).map((body) => [body[0], body]));
  layer.fleet.things.forEach((thing, index) => {
    const body = moved.get(index);
    const by = body && thing.carried_at_m ? [body[2] - thing.carried_at_m[0], body[3] - thing.carried_at_m[1]] : [0, 0];
    const points = (thing.ends_m ?? thing.corners_m).map(([x, y]) => stage.place([x + by[0], y + by[1]]));
    context.fillStyle = thing.carried_at_m ? tones.moving : tones.stone;
    context.strokeStyle = thing.carried_at_m ? tones.moving : tones["stone-edge"];
    if (thing.form === "polygon") {
      line(context, points);
      context.closePath();
      context.fill();
      context.lineWidth = 1;
      context.stroke();
    } else if (points[0][0] === points[1][0] && points[0][1] === points[1][1]) {
      disc(context, points[0], thing.radius_m * stage.view.scale);
      context.fill();
    } else {
      context.lineCap = "round";
      context.lineWidth = Math.max(2 * thing.radius_m * stage.view.scale, 1.5);
      line(context, points);
      context.stroke();
    }
  });
}

const stateTone = (layer, flags) => {
  if (flags & SILENT) return tones.silent;
  if (app.layers.length > 1) return layerTone(layer);
  return flags & ARRIVED ? tones.arrived : tones.runs;
};

function drawLayer(context, stage, layer) {
  const scale = stage.view.scale;
  const robots = layer.robots();
  const chosen = app.chosen;
  if ($("links").checked) drawLinks(context, stage, layer);
  if ($("trails").checked) {
    context.lineWidth = 1.3;
    context.lineCap = "round";
    for (const [index, flags] of robots) {
      const trail = layer.trails.get(index) ?? [];
      context.strokeStyle = index === chosen ? tones.chosen : stateTone(layer, flags);
      context.globalAlpha = index === chosen ? 0.9 : 0.35;
      line(context, trail.map((at) => stage.place(at)));
      context.stroke();
    }
    context.globalAlpha = 1;
  }
  for (const [index, flags, x, y, , gx, gy] of robots) {
    if (gx === undefined || (flags & ARRIVED && index !== chosen)) continue;
    const [px, py] = stage.place([gx, gy]);
    context.strokeStyle = index === chosen ? tones.chosen : tones.goal;
    context.globalAlpha = index === chosen ? 1 : 0.55;
    context.lineWidth = index === chosen ? 2 : 1.2;
    line(context, [[px - 4, py - 4], [px + 4, py + 4]]);
    context.stroke();
    line(context, [[px - 4, py + 4], [px + 4, py - 4]]);
    context.stroke();
    if (index === chosen) {
      context.setLineDash([3, 5]);
      line(context, [stage.place([x, y]), [px, py]]);
      context.stroke();
      context.setLineDash([]);
    }
    context.globalAlpha = 1;
  }
  const names = robots.length <= NAMES_MAX || scale > 90;
  for (const body of robots) drawRobot(context, stage, layer, body, names);
  for (const [index, ...terms] of layer.frame?.intents ?? []) {
    const body = layer.body(index);
    if (body && index === chosen) drawTerms(context, stage, body, terms);
  }
  const now = performance.now();
  layer.flashes = layer.flashes.filter((flash) => now - flash.since < FLASH_MS);
  for (const { at, since } of layer.flashes) {
    const share = (now - since) / FLASH_MS;
    context.strokeStyle = tones.contact;
    context.globalAlpha = 1 - share;
    context.lineWidth = 3;
    disc(context, stage.place(at), 6 + 22 * share);
    context.stroke();
    context.globalAlpha = 1;
  }
}

function drawRobot(context, stage, layer, [index, flags, x, y, yaw, , , first, second], names) {
  const member = layer.fleet.members[index];
  const at = stage.place([x, y]);
  const radius = Math.max((member?.radius_m ?? 0.2) * stage.view.scale, 2.5);
  const tone = stateTone(layer, flags);
  context.strokeStyle = context.fillStyle = tone;
  if (member?.arm) {
    const { base_m: [bx, by], links_m: [l1, l2] } = member.arm;
    const [j1, j2] = [first ?? 0, second ?? 0];
    const elbow = [bx + l1 * Math.cos(j1), by + l1 * Math.sin(j1)];
    const tip = [elbow[0] + l2 * Math.cos(j1 + j2), elbow[1] + l2 * Math.sin(j1 + j2)];
    context.lineCap = "round";
    context.lineWidth = Math.max(2 * radius, 3);
    context.globalAlpha = 0.75;
    line(context, [[bx, by], elbow, tip].map((point) => stage.place(point)));
    context.stroke();
    context.globalAlpha = 1;
  } else {
    disc(context, at, radius);
    const hollow = flags & ARRIVED || layer.number > 0;
    context.globalAlpha = hollow ? 0.25 : 0.85;
    context.fill();
    context.globalAlpha = 1;
    context.lineWidth = 1.6;
    context.stroke();
    if (flags & SILENT) {
      const d = 0.7 * radius;
      context.strokeStyle = tones.paper;
      line(context, [[at[0] - d, at[1] - d], [at[0] + d, at[1] + d]]);
      context.stroke();
      line(context, [[at[0] - d, at[1] + d], [at[0] + d, at[1] - d]]);
      context.stroke();
    } else if (member?.heads) {
      context.strokeStyle = hollow ? tone : tones.paper;
      context.lineWidth = 2;
      line(context, [at, [at[0] + radius * Math.cos(yaw), at[1] - radius * Math.sin(yaw)]]);
      context.stroke();
    }
  }
  if (index === app.chosen) {
    context.strokeStyle = tones.chosen;
    context.lineWidth = 2.5;
    disc(context, at, radius + 4);
    context.stroke();
  }
  if (names || index === app.chosen) {
    context.fillStyle = tones.ink;
    context.font = "11px system-ui, sans-serif";
    context.fillText(member?.id ?? `slot ${index}`, at[0] + radius + 3, at[1] - radius - 1);
  }
}

function drawLinks(context, stage, layer) {
  const places = new Map(layer.robots().map((body) => [body[0], stage.place([body[2], body[3]])]));
  const bins = 4;
  for (let bin = 0; bin < bins; bin += 1) {
    context.beginPath();
    for (const { by, of, age_us } of layer.links) {
      const share = Math.min(Math.floor((bins * age_us) / (1000 * OLD_MS)), bins - 1);
      const [from, to] = [places.get(by), places.get(of)];
      if (share !== bin || !from || !to || (app.chosen !== null && by !== app.chosen && of !== app.chosen)) continue;
      context.moveTo(...from);
      context.lineTo(...to);
    }
    context.strokeStyle = `color-mix(in srgb, ${tones.old} ${Math.round((100 * bin) / (bins - 1))}%, ${tones.young})`;
    context.lineWidth = 0.8 + 0.5 * bin;
    context.globalAlpha = 0.5;
    context.stroke();
    context.globalAlpha = 1;
  }
}

// What the chosen robot's plan is made of. Pull and push are in a unit of the method's own, so the longer one is drawn TERM_PX long.
function drawTerms(context, stage, [, , x, y], [pullX, pullY, pushX, pushY, commandX, commandY]) {
  const from = stage.place([x, y]);
  const longest = Math.max(Math.hypot(pullX, pullY), Math.hypot(pushX, pushY));
  const scale = longest > 0 && Number.isFinite(longest) ? TERM_PX / longest : 0;
  arrow(context, from, [from[0] + scale * pullX, from[1] - scale * pullY], tones.goal, [6, 3], "pull");
  arrow(context, from, [from[0] + scale * pushX, from[1] - scale * pushY], tones.contact, [2, 3], "push");
  if (commandX !== null) arrow(context, from, stage.place([x + commandX, y + commandY]), tones.chosen, [], "command");
}

function arrow(context, from, to, tone, dash, word) {
  const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
  if (!(length >= 3)) return;
  const [ux, uy] = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
  context.strokeStyle = context.fillStyle = tone;
  context.lineWidth = 2;
  context.setLineDash(dash);
  line(context, [from, to]);
  context.stroke();
  context.setLineDash([]);
  line(context, [to, [to[0] - 8 * ux + 4 * uy, to[1] - 8 * uy - 4 * ux], [to[0] - 8 * ux - 4 * uy, to[1] - 8 * uy + 4 * ux]]);
  context.fill();
  context.font = "11px system-ui, sans-serif";
  context.fillText(word, to[0] + 6, to[1] + (word === "pull" ? 12 : -4));
}

function drawAdd(context, stage) {
  const [from, to] = [stage.place(stage.add.from), stage.place(stage.add.to)];
  context.strokeStyle = tones.chosen;
  context.lineWidth = 2;
  context.setLineDash([5, 4]);
  line(context, [from, to]);
  context.stroke();
  context.setLineDash([]);
  disc(context, from, 0.2 * stage.view.scale);
  context.stroke();
}

// ---- the state of the page -----------------------------------------------------------------------------------------

const app = {
  layers: [], stages: [], main: null, live: null, chosen: null, adds: false, drawn: 0, sort: ["robot", 1],
  vitals: null, charts: { age: [], wake: [] }, events: [], tapes: [], play: null,
};
globalThis.shoal = app;

function setLayers(layers) {
  app.layers = layers;
  app.main = layers[0] ?? null;
  setStages();
}

function setStages() {
  app.stages.forEach((stage) => stage.box.remove());
  const over = app.layers.length > 1 && $("compare").value === "over";
  app.stages = over ? [new Stage(app.layers)] : app.layers.map((layer) => new Stage([layer]));
  const signs = [["●", "moves", "runs"], ["◍", "arrived", "arrived"], ["⊗", "silent", "silent"], ["×", "goal", "goal"],
    ["◯", "contact", "contact"]];
  $("key").replaceChildren(...signs.map(([sign, words, tone]) => {
    const row = element("span", words, { "data-sign": sign });
    row.style.setProperty("--tone", `var(--${tone})`);
    return row;
  }));
}

function choose(slot) {
  app.chosen = slot;
  closeMenu();
  if (slot !== null && app.live) ask(`fleets/${app.live.id}/choose/${slot}`, { method: "POST" }).catch(() => {});
  showCard();
  showRobots();
  redraw();
}

let drawing = 0;
/** Draws once before the next frame of the screen, however often it is asked for. */
function redraw() {
  if (drawing) return;
  drawing = requestAnimationFrame(() => {
    drawing = 0;
    app.stages.forEach((stage) => { stage.follow(); stage.draw(); });
    if (app.layers.some((layer) => layer.flashes.length)) redraw();
  });
}

async function act(what) {
  if (!app.live) return;
  try {
    const { done, words, hint } = await ask(`fleets/${app.live.id}/act`, { method: "POST", body: JSON.stringify(what) });
    say(hint ? `${words} (${hint})` : words, !done, done ? 4 : 10);
  } catch (error) {
    say(error.message, true, 10);
  }
}

// ---- a running fleet -----------------------------------------------------------------------------------------------

function watchFleet(id) {
  leave();
  const stream = new EventSource(`fleets/${id}/stream?token=${token}`);
  app.live = { id, stream };
  const on = (name, take) => stream.addEventListener(name, (event) => take(JSON.parse(event.data)));
  on("fleet", (fleet) => {
    if (!app.main) {
      setLayers([new Layer(0, fleet)]);
      setLive(true);
    }
    app.main.fleet = fleet;
    $("scenario").textContent = `${fleet.scenario}, seed ${fleet.seed}, ${fleet.mode} at ${fleet.tick_hz} Hz`;
  });
  on("frame", (frame) => {
    if (!app.main) return;
    const first = !app.main.frame;
    app.main.take(frame);
    showClock(app.main);
    if (first) app.stages.forEach((stage) => stage.fit());
    redraw();
    if (app.chosen !== null) showCard();
  });
  on("vitals", (vitals) => {
    app.vitals = vitals;
    if (app.main) app.main.links = vitals.pulse.links;
    showVitals();
  });
  on("event", (event) => takeEvent(app.main, event));
  on("end", ({ words }) => {
    stream.close();
    say(`${words}; what is shown is its last moment`, false, 0);
    setLive(false);
    document.body.dataset.ended = "true";
    setTimeout(loadSources, 1500);
  });
  stream.onerror = () => {
    if (stream.readyState === EventSource.CLOSED || !app.live) return;
    say("the server does not answer: has the run ended, or the view?", true, 0);
  };
  stream.onopen = () => say("");
}

function setLive(on) {
  document.body.dataset.live = on;
  $("add").disabled = $("links").disabled = !on;
  $("card-hands").hidden = !on;
  $("pace").hidden = !on || app.vitals?.status.mode !== "lockstep";
  if (!on) app.live = null;
}

function leave() {
  app.live?.stream.close();
  Object.assign(app, { live: null, vitals: null, events: [], tapes: [], play: null, chosen: null, main: null, layers: [] });
  app.charts = { age: [], wake: [] };
  app.stages.forEach((stage) => stage.box.remove());
  app.stages = [];
  $("events").replaceChildren();
  $("player").hidden = true;
  $("times").hidden = false;
  $("verdict").hidden = true;
  delete document.body.dataset.ended;
  say("");
  showCard();
}

// ---- head ----------------------------------------------------------------------------------------------------------

function showClock(layer) {
  const { frame, fleet } = layer;
  $("clock").textContent = `${frame.time_s.toFixed(2)} s · tick ${frame.tick}`;
  $("arrived").textContent = `${frame.arrived} of ${layer.robots().length || fleet.members.length} arrived`;
  $("contacts").textContent = `${frame.contacts} contact${frame.contacts === 1 ? "" : "s"}`;
}

function showVerdict(verdict, because) {
  const badge = $("verdict");
  badge.hidden = false;
  badge.textContent = because.length ? `${verdict}: ${because[0].slice(0, 60)}${because[0].length > 60 ? "…" : ""}` : verdict;
  badge.title = because.join("\n") || "the machine keeps up";
  badge.classList.toggle("bad", verdict !== "valid");
}

function showVitals() {
  const { status, unanswered, pulse } = app.vitals;
  if (unanswered) say(`the daemon does not answer: ${unanswered}`, true, 3);
  showVerdict(pulse.verdict, pulse.because);
  $("pace").hidden = !app.live || status.mode !== "lockstep";
  $("pause").textContent = status.paused ? "Go on" : "Pause";
  $("step").disabled = !status.paused;
  const rate = `${status.rate ?? 0}`;
  if (document.activeElement !== $("rate") && [...$("rate").options].some((option) => option.value === rate)) $("rate").value = rate;
  document.body.dataset.paused = status.paused ?? false;
  if (pulse.window_s > 0) {
    const { pose_age_us: age, wake_us: wake } = pulse.fleet;
    pushChart("age", age, status.time_s);
    pushChart("wake", wake, status.time_s);
  }
  showRobots();
  showCard();
}

// ---- charts --------------------------------------------------------------------------------------------------------

function pushChart(name, pair, time) {
  const points = app.charts[name];
  points.push({ time, pair });
  if (points.length > CHART_MAX) points.shift();
  const ms = (us) => (us / 1000).toFixed(us < 1000 ? 3 : 2);
  $(`${name}-now`).textContent = pair ? `p50 ${ms(pair[0])} ms, p99 ${ms(pair[1])} ms` : "";
  drawChart($(name), points);
}

function drawChart(canvas, points) {
  const ratio = devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (!width) return;
  [canvas.width, canvas.height] = [width * ratio, height * ratio];
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  const top = Math.max(...points.map(({ pair }) => pair?.[1] ?? 0), 1) * 1.1;
  const x = (i) => width - (points.length - 1 - i) * (width / (CHART_MAX - 1));
  const y = (value) => height - 4 - (value / top) * (height - 16);
  context.fillStyle = tones.faint;
  context.font = "10px system-ui, sans-serif";
  context.fillText(`${Number((top / 1000).toPrecision(2))} ms`, 2, 10);
  context.strokeStyle = tones.line;
  line(context, [[0, height - 4], [width, height - 4]]);
  context.stroke();
  [[1, tones.old, 1.2], [0, tones.runs, 2]].forEach(([which, tone, thickness]) => {
    context.strokeStyle = tone;
    context.lineWidth = thickness;
    let pen = false;
    context.beginPath();
    points.forEach(({ pair }, i) => {
      if (!pair) { pen = false; return; }
      if (pen) context.lineTo(x(i), y(pair[which]));
      else context.moveTo(x(i), y(pair[which]));
      pen = true;
    });
    context.stroke();
  });
}

// ---- robots --------------------------------------------------------------------------------------------------------

const micro = (pair) => (pair ? pair[1] / 1000 : null);
const COLUMNS = [
  { key: "robot", head: "Robot" },
  { key: "state", head: "State" },
  { key: "goals", head: "Goals", title: "Goals done / left" },
  { key: "life", head: "Life", number: true, title: "Incarnation: how many lives its slot had before" },
  { key: "age", head: "Age", number: true, digits: 1, title: "Age of the poses that it used in the last second, 99 %, ms" },
  { key: "missed", head: "Missed", number: true, title: "Periods that it missed since it started" },
  { key: "cpu", head: "CPU %", number: true, digits: 1, title: "Of one processor, in the last second" },
  { key: "memory", head: "MB", number: true, digits: 1, title: "Memory that is present" },
];

function rows() {
  const flagsOf = new Map((app.main?.robots() ?? []).map((body) => [body[0], body[1]]));
  const seen = (flags) => (flags === undefined ? "absent" : flags & SILENT ? "silent" : flags & ARRIVED ? "arrived" : "moves");
  if (!app.vitals) {
    return (app.main?.fleet.members ?? []).map((member, slot) => ({ slot, robot: member.id, state: seen(flagsOf.get(slot)) }));
  }
  const { status, pulse } = app.vitals;
  return status.robots.map((robot) => {
    const load = pulse.robots[robot.slot] ?? {};
    return {
      slot: robot.slot,
      robot: robot.id,
      state: robot.arrived && robot.state === "running" ? "arrived" : robot.state,
      goals: `${robot.goals_done} / ${robot.goals_left}`,
      life: robot.incarnation,
      age: micro(load.pose_age_us),
      missed: load.missed_ever ?? null,
      cpu: load.cpu == null ? null : 100 * load.cpu,
      memory: load.resident_bytes == null ? null : load.resident_bytes / 1e6,
    };
  });
}

function showRobots() {
  const [by, sign] = app.sort;
  const list = rows().sort((a, b) => {
    const [x, y] = [a[by] ?? -Infinity, b[by] ?? -Infinity];
    const order = typeof x === "string" && typeof y === "string" ? x.localeCompare(y, "en", { numeric: true }) : x - y;
    return sign * order || a.slot - b.slot;
  });
  const columns = COLUMNS.filter(({ key }) => app.vitals || key === "robot" || key === "state");
  $("robot-count").textContent = list.length;
  const head = element("tr");
  for (const { key, head: words, number, title } of columns) {
    const cell = element("th", "", { scope: "col", ...(number && { class: "n" }), title: title ?? words });
    if (key === by) cell.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
    const button = element("button", key === by ? `${words} ${sign > 0 ? "↑" : "↓"}` : words, { type: "button" });
    button.onclick = () => {
      app.sort = [key, by === key ? -sign : 1];
      showRobots();
    };
    cell.append(button);
    head.append(cell);
  }
  const focused = document.activeElement?.closest?.("#robots thead") ? [...document.querySelectorAll("#robots thead button")]
    .indexOf(document.activeElement) : -1;
  $("robots").tHead.replaceChildren(head);
  if (focused >= 0) document.querySelectorAll("#robots thead button")[focused]?.focus();
  const body = $("robots").tBodies[0];
  list.forEach((row, i) => {
    const tr = body.rows[i] ?? body.insertRow();
    tr.dataset.slot = row.slot;
    tr.dataset.robot = row.robot;
    tr.tabIndex = 0;
    tr.classList.toggle("chosen", row.slot === app.chosen);
    columns.forEach(({ key, number, digits }, at) => {
      const cell = tr.cells[at] ?? tr.insertCell();
      const value = row[key];
      const text = value == null ? "–" : typeof value === "number" ? value.toFixed(digits ?? 0) : value;
      if (cell.textContent !== text) cell.textContent = text;
      cell.classList.toggle("n", !!number);
    });
    while (tr.cells.length > columns.length) tr.deleteCell(-1);
  });
  while (body.rows.length > list.length) body.deleteRow(-1);
}

function showCard() {
  const slot = app.chosen;
  const member = app.main?.fleet.members[slot];
  $("card").hidden = !member;
  if (!member) return;
  const robot = app.vitals?.status.robots.find((robot) => robot.slot === slot);
  const load = app.vitals?.pulse.robots[slot];
  const body = app.main.body(slot);
  const point = (x, y) => `${x.toFixed(2)}, ${y.toFixed(2)}`;
  const facts = [["method", member.planner], ["kind", `${member.kind}, radius ${member.radius_m} m`]];
  if (body) facts.push(["position", `${point(body[2], body[3])} m`]);
  if (body && body[5] !== undefined) {
    facts.push(["goal", `${point(body[5], body[6])} m, ${Math.hypot(body[5] - body[2], body[6] - body[3]).toFixed(2)} m away`]);
  }
  if (robot) {
    facts.push(["state", `${robot.state}${robot.pid ? `, process ${robot.pid}` : ""}, life ${robot.incarnation}`]);
    facts.push(["goals", `${robot.goals_done} done, ${robot.goals_left} left`]);
  }
  if (load) {
    const late = Object.entries(load.late).filter(([, n]) => n > 0).map(([cause, n]) => `${n} by ${cause}`).join(", ");
    facts.push(["last second", `${load.periods} periods, ${load.missed} missed${late ? `; late: ${late}` : ""}`]);
    if (load.step_us) facts.push(["step p99", `${load.step_us[1].toFixed(0)} us`]);
  }
  $("card-name").textContent = member.id;
  const list = $("card-facts");
  if (list.childElementCount !== 2 * facts.length) {
    list.replaceChildren(...facts.flatMap(([name, words]) => [element("dt", name), element("dd", words)]));
  } else {
    facts.forEach(([name, words], i) => {
      list.children[2 * i].textContent = name;
      list.children[2 * i + 1].textContent = words;
    });
  }
  if (!$("card-acts").childElementCount) {
    $("card-acts").append(...HANDS.map(([words, title, what]) => {
      const button = element("button", words, { type: "button", title, "data-act": what("").do });
      button.onclick = () => act(what(app.main.fleet.members[app.chosen].id));
      return button;
    }));
  }
}

// ---- hands ---------------------------------------------------------------------------------------------------------

const HANDS = [
  ["Kill", "Kill its process", (robot) => ({ do: "kill", robot })],
  ["Halt", "Stop its process", (robot) => ({ do: "halt", robot })],
  ["Resume", "Let it go on, and end its faults", (robot) => ({ do: "go-on", robot })],
  ["Mute 5 s", "Other robots do not hear it for 5 s", (robot) => ({ do: "mute", robot, for_s: 5 })],
  ["Restart", "Give it a new process", (robot) => ({ do: "restart", robot })],
  ["Remove", "It leaves the fleet", (robot) => ({ do: "remove", robot })],
];

function openMenu(slot, x, y) {
  choose(slot);
  if (!app.live) return;
  const menu = $("menu");
  const name = app.main.fleet.members[slot].id;
  menu.replaceChildren(...HANDS.map(([words, title, what]) => {
    const button = element("button", words, { type: "button", role: "menuitem", title, "data-act": what("").do });
    button.onclick = () => { closeMenu(); act(what(name)); };
    return button;
  }));
  menu.hidden = false;
  menu.style.left = `${Math.min(x, innerWidth - menu.offsetWidth - 8)}px`;
  menu.style.top = `${Math.min(y, innerHeight - menu.offsetHeight - 8)}px`;
  menu.firstElementChild.focus();
}

function closeMenu() {
  $("menu").hidden = true;
}

function setAdds(on) {
  app.adds = on && !!app.live;
  $("add").setAttribute("aria-pressed", app.adds);
  app.stages.forEach((stage) => stage.canvas.classList.toggle("adds", app.adds));
  if (app.adds) say("drag from where a robot is to start to where it is to go", false, 8);
}

// ---- events --------------------------------------------------------------------------------------------------------

function takeEvent(layer, event) {
  if (layer && event.at_m) layer.flashes.push({ at: event.at_m, since: performance.now() });
  app.events.push(event);
  if (app.events.length > EVENTS_MAX) app.events.shift();
  $("events").prepend(eventRow(event));
  while ($("events").childElementCount > EVENTS_MAX) $("events").lastElementChild.remove();
  redraw();
}

function eventRow(event) {
  const row = element("li", "", { class: event.kind });
  const words = [event.robot, event.kind, event.detail].filter(Boolean).join(" · ");
  row.append(element("time", `${event.time_s.toFixed(2)} s`), element("span", words));
  return row;
}

// ---- records -------------------------------------------------------------------------------------------------------

const WINDOW = 240;

/** A record, of which windows of frames are fetched as they are needed. */
class Tape {
  constructor(id, info, layer) {
    Object.assign(this, { id, info, layer, windows: new Map(), wanted: null });
    this.event = 0;
  }

  get seconds() {
    return (this.info.last - this.info.first) / this.info.fleet.tick_hz;
  }

  /** The frame at a time, if it is here; else it is fetched, and drawn when it comes. */
  at(time, step) {
    const { first, last, fleet } = this.info;
    const tick = Math.min(first + Math.floor(time * fleet.tick_hz + 1e-6), last);
    const span = WINDOW * step;
    const number = Math.floor((tick - first) / span);
    const frames = this.window(number, step);
    this.window(number + 1, step);
    if (!frames) return null;
    let newest = null;
    for (const frame of frames) {
      if (frame.tick > tick) break;
      newest = frame;
    }
    return newest ?? frames[0] ?? null;
  }

  window(number, step) {
    const { first, last } = this.info;
    const from = first + number * WINDOW * step;
    if (from > last) return null;
    const key = `${step}/${number}`;
    const known = this.windows.get(key);
    if (known) return known.frames;
    const entry = { frames: null };
    this.windows.set(key, entry);
    if (this.windows.size > 12) this.windows.delete(this.windows.keys().next().value);
    const to = from + WINDOW * step - 1;
    ask(`records/${this.id}/frames?from=${from}&to=${to}&step=${step}`)
      .then(({ frames }) => { entry.frames = frames; showTime(); })
      .catch((error) => { this.windows.delete(key); say(error.message, true); });
    return null;
  }
}

async function playRecords(ids) {
  leave();
  const infos = await Promise.all(ids.map((id) => ask(`records/${id}`)));
  const layers = infos.map((info, i) => new Layer(i, { ...info.fleet, record: true }));
  app.tapes = infos.map((info, i) => new Tape(ids[i], info, layers[i]));
  $("compare-choice").hidden = infos.length < 2;
  setLayers(layers);
  setLive(false);
  const seconds = Math.max(...app.tapes.map((tape) => tape.seconds));
  app.play = { time: 0, seconds, playing: true, speed: 1, last: null };
  $("seek").max = Math.round(1000 * seconds);
  $("player").hidden = false;
  $("times").hidden = true;
  const { fleet, verdict, words } = infos[0];
  $("scenario").textContent = infos.length > 1 ? infos.map((info) => info.fleet.planners ?? info.fleet.scenario).join(" against ")
    : `${fleet.scenario}, seed ${fleet.seed}, ${fleet.mode} at ${fleet.tick_hz} Hz`;
  if (verdict) showVerdict(verdict, []);
  const cut = infos.map((info) => info.cut).filter(Boolean);
  if (cut.length) say(cut.join("; "), true, 0);
  else if (words) say(words, false, 8);
  $("events").replaceChildren(...infos[0].events.slice(-EVENTS_MAX).reverse().map(eventRow));
  drawMarks();
  showRobots();
  showTime();
  requestAnimationFrame(playOn);
}

/** Frames are skipped where the eye would not see them. */
const stepAt = (speed, hz) => Math.max(1, Math.round((hz * speed) / 60));

function playOn(now) {
  const play = app.play;
  if (!play) return;
  if (play.playing && play.last !== null) {
    play.time = Math.min(play.time + ((now - play.last) / 1000) * play.speed, play.seconds);
    if (play.time >= play.seconds) setPlaying(false);
    showTime();
  }
  play.last = now;
  requestAnimationFrame(playOn);
}

function setPlaying(on) {
  const play = app.play;
  if (!play) return;
  if (on && play.time >= play.seconds) play.time = 0;
  play.playing = on;
  $("play").textContent = on ? "Pause" : "Play";
}

function showTime() {
  const play = app.play;
  if (!play) return;
  let fit = false;
  for (const tape of app.tapes) {
    const { layer, info } = tape;
    const frame = tape.at(play.time, stepAt(play.speed, info.fleet.tick_hz));
    if (!frame || frame === layer.frame) continue;
    const before = layer.frame?.tick ?? Infinity;
    fit ||= !layer.frame;
    layer.take(frame);
    if (frame.tick > before) {
      const passed = info.events.filter((event) => event.at_m && event.tick > before && event.tick <= frame.tick);
      passed.forEach((event) => layer.flashes.push({ at: event.at_m, since: performance.now() }));
    }
  }
  $("seek").value = Math.round(1000 * play.time);
  $("seek").setAttribute("aria-valuetext", `${play.time.toFixed(1)} s`);
  if (app.main?.frame) showClock(app.main);
  if (fit) app.stages.forEach((stage) => stage.fit());
  const now = performance.now();
  if (fit || now - (play.rowsAt ?? 0) > 300) {
    play.rowsAt = now;
    showRobots();
  }
  showCard();
  redraw();
}

function seek(time) {
  if (!app.play) return;
  app.play.time = Math.min(Math.max(time, 0), app.play.seconds);
  showTime();
  showRobots();
}

/** Where in time things happened. */
function drawMarks() {
  const canvas = $("marks");
  const ratio = devicePixelRatio || 1;
  canvas.width = canvas.clientWidth * ratio;
  canvas.height = 10 * ratio;
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  const tone = (kind) => ({ contact: tones.contact, died: tones.contact, killed: tones.contact, arrived: tones.arrived })[kind] ?? tones.faint;
  for (const { info } of app.tapes) {
    for (const event of info.events) {
      const x = (event.time_s / app.play.seconds) * canvas.clientWidth;
      context.fillStyle = tone(event.kind);
      context.fillRect(x - 0.5, event.at_m ? 0 : 4, event.at_m ? 2 : 1, 10);
    }
  }
}

// ---- beginning -----------------------------------------------------------------------------------------------------

async function loadSources() {
  let sources;
  try {
    sources = await ask("sources");
  } catch (error) {
    if (!document.body.dataset.ended) say(error.message, true, 0);
    return;
  }
  const options = sources.fleets.map(({ id, name }) => [`fleet/${id}`, name ? `${name} (${id})` : id]);
  sources.records.forEach(({ path }, i) => options.push([`record/${i}`, nameOf(path)]));
  if (sources.records.length === 2) options.unshift(["records", sources.records.map(({ path }) => nameOf(path)).join(" against ")]);
  const select = $("source");
  const before = select.value;
  select.replaceChildren(...options.map(([value, words]) => element("option", words, { value })));
  if (options.some(([value]) => value === before)) select.value = before;
  else if (app.live || document.body.dataset.ended) select.prepend(element("option", "ended", { value: before, selected: "" }));
  else if (options.length) { select.value = options[0][0]; open(select.value); }
  else say("no fleet is running: start one with `shoal up` or `shoal run`, and it shows up here", false, 0);
  if (!options.length) setTimeout(loadSources, 1000);
}

function open(value) {
  const [kind, id] = value.split("/");
  if (kind === "fleet") watchFleet(id);
  else if (kind === "record") playRecords([Number(id)]).catch((error) => say(error.message, true, 0));
  else playRecords([0, 1]).catch((error) => say(error.message, true, 0));
}

const KEYS = [
  ["f", "show everything", () => app.stages.forEach((stage) => stage.fit())],
  ["+", "zoom in", () => app.stages.forEach((stage) => stage.zoom(1.25))],
  ["-", "zoom out", () => app.stages.forEach((stage) => stage.zoom(0.8))],
  ["n", "choose the next robot", () => nextRobot(1)],
  ["p", "choose the robot before", () => nextRobot(-1)],
  ["m", "menu of the chosen robot", () => {
    const [stage, body] = [app.stages[0], app.main?.body(app.chosen)];
    if (!body) return;
    const [x, y] = stage.place([body[2], body[3]]);
    const box = stage.canvas.getBoundingClientRect();
    openMenu(app.chosen, box.left + x, box.top + y);
  }],
  ["a", "add a robot by dragging", () => setAdds(!app.adds)],
  ["l", "links between robots", () => { $("links").checked = !$("links").checked; redraw(); }],
  [" ", "pause or go on", () => (app.play ? setPlaying(!app.play.playing) : $("pace").hidden || $("pause").click())],
  [".", "one tick", () => (app.play ? seek(app.play.time + 1 / app.tapes[0].info.fleet.tick_hz) : $("step").disabled || $("step").click())],
  [",", "one tick back (records)", () => app.play && seek(app.play.time - 1 / app.tapes[0].info.fleet.tick_hz)],
  ["Escape", "choose nothing", () => { closeMenu(); setAdds(false); choose(null); }],
  ["?", "these keys", () => $("help").showModal()],
];

function nextRobot(by) {
  const slots = (app.main?.robots() ?? []).map((body) => body[0]);
  if (!slots.length) return;
  const at = slots.indexOf(app.chosen);
  choose(slots[(at + by + slots.length + (at < 0 && by < 0 ? 1 : 0)) % slots.length]);
}

function begin() {
  readTones();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readTones(); redraw(); });
  for (const value of [0.1, 0.25, 0.5, 1, 2, 4, 8, 16]) {
    $("speed").append(element("option", `${value} ×`, { value, ...(value === 1 && { selected: "" }) }));
  }
  for (const [value, words] of [[0, "free"], [0.1, "0.1 ×"], [0.5, "0.5 ×"], [1, "1 ×"], [2, "2 ×"], [5, "5 ×"], [20, "20 ×"]]) {
    $("rate").append(element("option", words, { value }));
  }
  $("keys").append(...KEYS.flatMap(([key, words]) => {
    const name = element("dt");
    name.append(element("kbd", key === " " ? "space" : key));
    return [name, element("dd", words)];
  }));
  $("source").onchange = (event) => open(event.target.value);
  $("fit").onclick = () => app.stages.forEach((stage) => stage.fit());
  $("closer").onclick = () => app.stages.forEach((stage) => stage.zoom(1.25));
  $("farther").onclick = () => app.stages.forEach((stage) => stage.zoom(0.8));
  $("add").onclick = () => setAdds(!app.adds);
  $("links").onchange = $("trails").onchange = redraw;
  $("pause").onclick = () => act(app.vitals?.status.paused ? { do: "resume" } : { do: "pause" });
  $("step").onclick = () => act({ do: "step", ticks: 1 });
  $("rate").onchange = (event) => act({ do: "rate", factor: Number(event.target.value) });
  $("play").onclick = () => setPlaying(!app.play.playing);
  $("seek").oninput = (event) => seek(Number(event.target.value) / 1000);
  $("speed").onchange = (event) => { app.play.speed = Number(event.target.value); };
  $("compare").onchange = () => { setStages(); app.stages.forEach((stage) => stage.fit()); };
  $("card-close").onclick = () => choose(null);
  $("help-open").onclick = () => $("help").showModal();
  $("goal-form").onsubmit = (event) => {
    event.preventDefault();
    const robot = app.main.fleet.members[app.chosen].id;
    act({ do: "task", robot, at_m: [$("goal-x").valueAsNumber, $("goal-y").valueAsNumber], now: $("goal-now").checked });
  };
  const chosenRow = (event) => event.target.closest("tr")?.dataset.slot;
  $("robots").tBodies[0].addEventListener("click", (event) => choose(Number(chosenRow(event))));
  $("robots").tBodies[0].addEventListener("keydown", (event) => {
    if (event.key === "Enter" && chosenRow(event)) choose(Number(chosenRow(event)));
  });
  $("menu").addEventListener("keydown", (event) => {
    const items = [...$("menu").children];
    const by = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (by) items[(items.indexOf(document.activeElement) + by + items.length) % items.length].focus();
    if (event.key === "Escape") closeMenu();
    if (by || event.key === "Escape") { event.preventDefault(); event.stopPropagation(); }
  });
  document.addEventListener("keydown", (event) => {
    if (event.target.matches("input:not([type=checkbox]):not([type=range]), select") || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.matches("button") && (event.key === " " || event.key === "Enter")) return;
    const pan = { ArrowLeft: [40, 0], ArrowRight: [-40, 0], ArrowUp: [0, 40], ArrowDown: [0, -40] }[event.key];
    if (pan && event.target.tagName === "CANVAS") {
      event.preventDefault();
      return app.stages.forEach((stage) => stage.move(...pan));
    }
    const found = KEYS.find(([key]) => key === event.key);
    if (found && !$("help").open) { event.preventDefault(); found[2](); }
  });
  loadSources();
}

begin();

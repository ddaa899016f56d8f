"use strict";
// The map from above, in the odometry frame: forward of where the run started is up, left is left.

class WayMap {
  constructor(root, say) {
    const role = this.role = (name) => root.querySelector(`[data-role="${name}"]`);
    this.root = root; this.say = say; this.canvas = role("map"); this.note = role("way");
    this.path = []; this.time = -1; this.state = null;
    this.span = 4; this.centre = [0.6, 0]; this.fitted = true;
    this.canvas.onclick = (event) => this.click(event);
    for (const button of root.querySelectorAll("[data-zoom]")) button.onclick = () => this.zoom(button.dataset.zoom);
    for (const button of root.querySelectorAll("[data-task]")) button.onclick = () => this.task(button);
    role("clear").onclick = () => say({ clear: true });
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }
  task(button) {
    this.say(button.classList.contains("now") ? { order: "halt" } : { task: button.dataset.task });
  }
  click(event) {
    const [x, y] = this.place(event.offsetX, event.offsetY);
    this.say({ waypoint: [x, y].map((value) => Math.round(100 * value) / 100) });
  }
  zoom(how) {
    this.fitted = how === "fit";
    if (how !== "fit") this.span = Math.max(1, Math.min(60, this.span * (how === "in" ? 0.7 : 1 / 0.7)));
    this.draw();
  }
  show(state) {
    this.state = state;
    const [x, y] = state.position;
    if (x !== null) {
      if (state.time < this.time) this.path = [];  // a new run
      this.time = state.time;
      const last = this.path[this.path.length - 1];
      if (!last || Math.hypot(x - last[0], y - last[1]) > 0.01) this.path.push([x, y]);
      if (this.path.length > 20000) this.path.splice(0, 10000);
    }
    this.tell();
    this.draw();
  }
  tell() {
    const { way, operator } = this.state, task = way.task || operator.task;
    const age = way.markerAge, clear = way.clearance;
    const number = operator.task === "goto" && operator.reached < operator.sent ? ` ${operator.reached + 1}` : "s";
    const words = { goto: `to waypoint${number}`, wander: "wandering", follow: "following", approach: "to the marker" };
    const parts = task ? [words[task] || task] : ["click or tap to set waypoints"];
    const usual = { goto: "waypoint", wander: "field", follow: "marker", approach: "marker" };
    const lead = way.lead === usual[task] ? [] : [way.lead];
    if (way.lead) parts.push(...[...lead, way.why].filter(Boolean));
    if (clear !== null && way.lead) parts.push(`${clear.toFixed(2)} m clear`);
    if (["follow", "approach"].includes(task) && age !== null && age > 1) parts.push(`marker seen ${age.toFixed(0)} s ago`);
    const text = parts.join(" · ");
    if (this.note.textContent !== text) { this.note.textContent = text; this.note.title = text; }
    this.note.classList.toggle("warn", ["blind", "escape"].includes(way.lead));
    const open = operator.waypoints.length > operator.sent || operator.reached >= operator.waypoints.length;
    for (const button of this.root.querySelectorAll("[data-task]")) {
      const goes = button.dataset.task === "goto";
      const on = button.dataset.task === operator.task && !(goes && open);
      button.classList.toggle("now", on);
      if (goes) { button.firstChild.textContent = on ? "Pause" : "Go"; button.disabled = !operator.waypoints.length; }
    }
    this.role("clear").disabled = !operator.waypoints.length;
  }
  // Pixels of a place (m forward, m left), and back.
  pixel(x, y) { return [this.w / 2 - (y - this.centre[1]) * this.scale, this.h / 2 - (x - this.centre[0]) * this.scale]; }
  place(px, py) { return [this.centre[0] - (py - this.h / 2) / this.scale, this.centre[1] - (px - this.w / 2) / this.scale]; }
  fit() {
    const { position, operator } = this.state, robot = position[0] === null ? [0, 0] : position.slice(0, 2);
    const inside = (share) => ([x, y]) => {
      const [px, py] = this.pixel(x, y), edge = (1 - share) / 2;
      return px > edge * this.w && px < (1 - edge) * this.w && py > edge * this.h && py < (1 - edge) * this.h;
    };
    if (!this.fitted) {
      if (!inside(0.9)(robot)) this.centre = robot;
      return;
    }
    const all = [robot, ...operator.waypoints, ...this.path.filter((_, i) => i % 20 === 0)];
    if (all.every(inside(0.92)) && this.span <= 4) return;
    const range = (k) => [Math.min(...all.map((p) => p[k])), Math.max(...all.map((p) => p[k]))];
    const [[x0, x1], [y0, y1]] = [range(0), range(1)], small = Math.min(this.w, this.h);
    const need = Math.max((x1 - x0) * small / this.h, (y1 - y0) * small / this.w) / 0.8;
    const span = Math.max(4, need);
    // It moves only when something is outside, or when it is far too small: a map that swims cannot be clicked.
    if (all.every(inside(0.92)) && this.span < 1.6 * span) return;
    this.span = span; this.centre = [(x0 + x1) / 2, (y0 + y1) / 2];
  }
  draw() {
    const { g, w, h } = fitCanvas(this.canvas);
    if (!w || !this.state) return;
    this.w = w; this.h = h; this.g = g;
    this.scale = Math.min(w, h) / this.span;
    this.fit();
    this.scale = Math.min(w, h) / this.span;
    const css = getComputedStyle(this.canvas), colour = (name) => css.getPropertyValue(`--${name}`).trim();
    this.line = colour("line"); this.ink = colour("ink"); this.muted = colour("muted"); this.accent = colour("accent"); this.card = colour("card");
    this.grid();
    this.trace(this.path, this.accent, 2, []);
    this.points();
    this.marker();
    this.robot();
  }
  trace(places, colour, width, dash) {
    const g = this.g;
    if (places.length < 2) return;
    g.strokeStyle = colour; g.lineWidth = width; g.lineJoin = "round"; g.setLineDash(dash); g.beginPath();
    places.forEach(([x, y], i) => { const at = this.pixel(x, y); if (i) g.lineTo(...at); else g.moveTo(...at); });
    g.stroke(); g.setLineDash([]);
  }
  grid() {
    const g = this.g, step = [0.25, 0.5, 1, 2, 5, 10].find((size) => size * this.scale >= 34) || 20;
    const [top, left] = this.place(0, 0), [bottom, right] = this.place(this.w, this.h);
    g.strokeStyle = this.line; g.fillStyle = this.muted; g.font = "10px system-ui, sans-serif";
    g.textBaseline = "bottom"; g.textAlign = "left";
    const number = (value) => `${+value.toFixed(2)}`.replace("-", "\u2212");
    for (let x = Math.ceil(bottom / step) * step; x <= top; x += step) {
      const [, y] = this.pixel(x, 0);
      g.lineWidth = Math.abs(x) < 1e-6 ? 1.6 : 0.8; g.beginPath(); g.moveTo(0, y); g.lineTo(this.w, y); g.stroke();
      if (y > 14) g.fillText(`${number(x)} m`, 3, y - 1);
    }
    g.textAlign = "center";
    for (let y = Math.ceil(right / step) * step; y <= left; y += step) {
      const [x] = this.pixel(0, y);
      g.lineWidth = Math.abs(y) < 1e-6 ? 1.6 : 0.8; g.beginPath(); g.moveTo(x, 0); g.lineTo(x, this.h); g.stroke();
      if (x > 40 && x < this.w - 14) g.fillText(number(y), x, this.h - 2);
    }
  }
  points() {
    const { waypoints, sent, reached } = this.state.operator, g = this.g;
    const [x, y] = this.state.position, from = x === null ? [0, 0] : [x, y];
    this.trace([from, ...waypoints.slice(reached)], this.muted, 1.25, [5, 4]);
    g.font = "700 11px system-ui, sans-serif"; g.textAlign = "center"; g.textBaseline = "middle";
    waypoints.forEach((point, i) => {
      const at = this.pixel(...point), done = i < reached, there = i < sent;
      g.beginPath(); g.arc(...at, 10, 0, 7);
      g.fillStyle = done ? this.line : there ? this.accent : this.card; g.fill();
      g.strokeStyle = done ? this.line : this.accent; g.lineWidth = 2; g.stroke();
      g.fillStyle = done ? this.muted : there ? this.card : this.accent; g.fillText(`${i + 1}`, at[0], at[1] + 0.5);
    });
  }
  marker() {
    const [x, y] = this.state.way.marker, age = this.state.way.markerAge, g = this.g;
    if (x === null) return;
    const at = this.pixel(x, y);
    g.globalAlpha = age === null || age > 10 ? 0.35 : 1;
    g.fillStyle = "#d0342c"; g.beginPath(); g.arc(...at, 6, 0, 7); g.fill();
    g.strokeStyle = this.card; g.lineWidth = 1.5; g.stroke();
    g.fillStyle = this.ink; g.font = "10px system-ui, sans-serif"; g.textAlign = "left"; g.textBaseline = "middle";
    g.fillText("marker", at[0] + 9, at[1]);
    g.globalAlpha = 1;
  }
  robot() {
    const [x, y] = this.state.position, yaw = this.state.rpy[2], g = this.g;
    if (x === null || yaw === null) return;
    const [px, py] = this.pixel(x, y), half = Math.max(7, 0.2 * this.scale);
    g.save(); g.translate(px, py); g.rotate(-yaw);
    g.globalAlpha = 0.18; g.fillStyle = "#e07020"; g.fillRect(-half, -half, 2 * half, 2 * half); g.globalAlpha = 1;
    const size = Math.max(9, Math.min(16, 0.16 * this.scale));
    g.fillStyle = "#e07020"; g.strokeStyle = this.card; g.lineWidth = 1.5; g.beginPath();
    g.moveTo(0, -1.25 * size); g.lineTo(0.8 * size, 0.85 * size); g.lineTo(0, 0.45 * size); g.lineTo(-0.8 * size, 0.85 * size); g.closePath();
    g.fill(); g.stroke(); g.restore();
  }
}

"use strict";
// Replay of a recorded run: one clock, a 3D view on meshcat's viewer, a plan view on a canvas.

function unpack(packed) {
  const raw = atob(packed.bdata === undefined ? packed : packed.bdata);
  const bytes = Uint8Array.from(raw, (c) => c.charCodeAt(0));
  return packed.bdata === undefined ? bytes : new Float32Array(bytes.buffer);
}

class Recording {
  // With a capacity, room for that many frames to come; without, the frames in the data.
  constructor(data, capacity) {
    this.data = data;
    const widths = { time: 1, q: 23, feet: 12, states: 1, com: 3, zmp: 2, zmpPlan: 2, push: 3, mode: 1 };
    for (const [key, width] of Object.entries(widths)) {
      if (capacity) this[key] = key === "states" || key === "mode" ? new Uint8Array(capacity) : new Float32Array(width * capacity);
      else this[key] = data[key] ? unpack(data[key]) : null;
    }
    this.count = this.room = this.time.length;
    this.width = this.count ? this.q.length / this.count : 23;
    this.duration = this.count ? this.time[this.count - 1] : 0;
  }
  // Index of the frame at or before t, and how far on to the next one it is.
  at(t) {
    let low = 0, high = this.count - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.time[middle] <= t) low = middle; else high = middle - 1;
    }
    const next = Math.min(low + 1, this.count - 1);
    const span = this.time[next] - this.time[low];
    return { i: low, j: next, s: span > 0 ? Math.min(1, Math.max(0, (t - this.time[low]) / span)) : 0 };
  }
  foot(i, leg) { return this.feet.subarray(12 * i + 3 * leg, 12 * i + 3 * leg + 3); }
  loaded(i, leg) { return (this.states[i] >> leg) & 1; }
  scheduled(i, leg) { return (this.states[i] >> (leg + 4)) & 1; }
  yaw(i) {
    const [x, y, z, w] = this.q.subarray(this.width * i + 3, this.width * i + 7);
    return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
  }
  rollPitch(i) {
    const [x, y, z, w] = this.q.subarray(this.width * i + 3, this.width * i + 7);
    return [Math.atan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y)), Math.asin(Math.max(-1, Math.min(1, 2 * (w * y - x * z))))];
  }
  groundHeight(x, y) { const [a, b, c] = this.data.ground; return a + b * x + c * y; }
  support(i) {
    const points = [];
    for (let leg = 0; leg < 4; leg++) if (this.scheduled(i, leg)) points.push(this.foot(i, leg));
    return hull(points.map((p) => [p[0], p[1], p[2]]));
  }
  // Height of the ground under a foot: on uneven ground what the foot itself tells.
  under(x, y, z) { return this.data.rough ? z - this.data.rough.below : this.groundHeight(x, y); }
}

// Degrees of an angle in rad, as text without a negative zero.
function degrees(angle) {
  return ((angle * 180 / Math.PI).toFixed(1) + "°").replace(/^-(?=0\.0°)/, "").replace("-", "\u2212");
}

function hull(points) {
  if (points.length < 3) return points;
  const sorted = points.slice().sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const turn = (o, a, b) => (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
  const half = (list) => {
    const out = [];
    for (const p of list) {
      while (out.length >= 2 && turn(out[out.length - 2], out[out.length - 1], p) <= 0) out.pop();
      out.push(p);
    }
    out.pop();
    return out;
  };
  return half(sorted).concat(half(sorted.reverse()));
}

class Clock {
  constructor(duration) {
    this.duration = duration; this.time = 0; this.rate = 1; this.playing = false; this.watchers = [];
    this.last = null;
    this.tick = this.tick.bind(this);
  }
  watch(callback) { this.watchers.push(callback); callback(this.time); }
  seek(t) { this.time = Math.min(this.duration, Math.max(0, t)); this.tell(); }
  tell() { for (const watcher of this.watchers) watcher(this.time); }
  toggle(on) {
    this.playing = on === undefined ? !this.playing : on;
    if (this.playing && this.time >= this.duration) this.time = 0;
    this.last = null;
    if (this.playing) requestAnimationFrame(this.tick);
    this.tell();
  }
  tick(now) {
    if (!this.playing) return;
    if (this.last !== null) this.time += Math.min(0.1, (now - this.last) / 1000) * this.rate;
    this.last = now;
    if (this.time >= this.duration) { this.time = this.duration; this.playing = false; }
    this.tell();
    if (this.playing) requestAnimationFrame(this.tick);
  }
}

class View3D {
  constructor(pane, recording) {
    this.pane = pane; this.rec = recording; this.follow = true; this.shown = { support: true, path: true, sweep: true, cloud: true, map: false };
    const viewer = this.viewer = new MeshCat.Viewer(pane);
    viewer.set_3d_pane_size = () => this.resize();
    viewer.gui.domElement.remove();
    for (const command of recording.data.commands) viewer.handle_command(command);
    for (const command of recording.data.surroundings || []) viewer.handle_command(command);
    this.room = recording.data.bounds || null;
    this.far = this.room ? 14 : 5.2;
    this.nodes = recording.data.nodes.map((node) => {
      const object = viewer.scene_tree.find(node.path).object;
      return { object, rest: object.quaternion.clone(), axis: new MeshCat.THREE.Vector3(...node.axis), q: node.q };
    });
    this.dress();
    this.addOverlays();
    const { leader, sweeps, waypoints } = recording.data;
    this.leader = leader ? new LeaderView(viewer, leader) : null;
    this.sweeps = sweeps ? new SweepView(viewer.scene, sweeps, recording) : null;
    this.goals = sweeps || waypoints ? new GoalView(viewer.scene) : null;
    const { terrain } = recording.data;
    this.ground = terrain ? new GroundView(viewer.scene, terrain, recording.data.legs) : null;
    if (waypoints) this.goals.place(waypoints, 0, null);
    this.trunk = [0, 0, 0];
    this.preset("corner");
    new ResizeObserver(() => this.resize()).observe(pane);
    this.resize();
  }
  resize() {
    const { clientWidth: w, clientHeight: h } = this.pane;
    if (!w || !h) return;
    this.viewer.camera.aspect = w / h;
    this.viewer.camera.updateProjectionMatrix();
    this.viewer.renderer.setSize(w, h);
    this.viewer.set_dirty();
  }
  dress() {
    const T = MeshCat.THREE, viewer = this.viewer;
    for (const path of ["Lights", "Grid", "Axes"]) viewer.set_property([path], "visible", false);
    viewer.scene.add(new T.HemisphereLight(0xffffff, 0xa9a49c, 0.75));
    const sun = this.sun = new T.DirectionalLight(0xfff1df, 0.72);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    const half = this.room ? 0.75 * this.roomSize() : 0.45;  // m; in a room all of it throws shadows
    Object.assign(sun.shadow.camera, { left: -half, right: half, top: half, bottom: -half, near: 0.2, far: this.room ? 4 * half : 4 });
    sun.shadow.bias = this.room ? -0.002 : -0.0006;
    sun.shadow.radius = 5;
    viewer.scene.add(sun, sun.target);
    const rim = new T.DirectionalLight(0xcfe2ff, 0.28);
    rim.position.set(-1, -1.5, 1);
    viewer.scene.add(rim);
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = 256;
    const texture = this.checker = new T.CanvasTexture(canvas);
    texture.wrapS = texture.wrapT = T.RepeatWrapping;
    texture.anisotropy = viewer.renderer.capabilities.getMaxAnisotropy();
    texture.repeat.set(60, 60);
    // The floor keeps the page's own colours whatever the light; a second sheet catches the shadow.
    const sheet = new T.PlaneGeometry(12, 12);
    this.floor = new T.Group();
    this.floor.add(new T.Mesh(sheet, new T.MeshBasicMaterial({ map: texture })));
    const shade = new T.Mesh(sheet, new T.ShadowMaterial({ opacity: 0.3 }));
    shade.receiveShadow = true;
    shade.position.z = 0.0004;
    this.floor.add(shade);
    const [, b, c] = this.rec.data.rough ? [0, 0, 0] : this.rec.data.ground;
    this.floor.quaternion.setFromUnitVectors(new T.Vector3(0, 0, 1), new T.Vector3(-b, -c, 1).normalize());
    viewer.scene.add(this.floor);
    viewer.camera.fov = 33;
    viewer.camera.near = 0.02;
    this.theme();
  }
  roomSize() { const [x0, y0, x1, y1] = this.room; return Math.max(x1 - x0, y1 - y0); }
  // The sun follows the robot; in a room it stands over its middle.
  light(x, y, z) {
    let far = 1;
    if (this.room) {
      x = (this.room[0] + this.room[2]) / 2; y = (this.room[1] + this.room[3]) / 2;
      far = 0.9 * this.roomSize();
    }
    this.sun.target.position.set(x, y, z);
    this.sun.position.set(x + 0.5 * far, y - 0.55 * far, z + 1.6 * far);
  }
  theme() {
    const T = MeshCat.THREE, css = getComputedStyle(this.pane);
    const colour = (name) => css.getPropertyValue(name).trim();
    const sky = new T.Color(colour("--scene"));
    this.viewer.scene.background = sky;
    this.viewer.scene.fog = new T.Fog(sky, this.room ? 6 : 1.8, this.far);
    const context = this.checker.image.getContext("2d");
    context.fillStyle = colour("--floor-a"); context.fillRect(0, 0, 256, 256);
    context.fillStyle = colour("--floor-b"); context.fillRect(0, 0, 128, 128); context.fillRect(128, 128, 128, 128);
    this.checker.needsUpdate = true;
    this.viewer.set_dirty();
  }
  addOverlays() {
    const T = MeshCat.THREE, scene = this.viewer.scene, rec = this.rec;
    const flat = (colour, opacity) => new T.MeshBasicMaterial({ color: colour, transparent: true, opacity, depthWrite: false, side: T.DoubleSide });
    this.discs = rec.data.legs.map((leg) => {
      const disc = new T.Mesh(new T.RingGeometry(0.011, 0.017, 40), flat(leg.colour, 0.9));
      scene.add(disc);
      return disc;
    });
    this.support = new T.Mesh(new T.BufferGeometry(), flat(0x12a17c, 0.22));
    this.support.geometry.setAttribute("position", new T.BufferAttribute(new Float32Array(12), 3));
    this.support.geometry.setIndex([0, 1, 2, 0, 2, 3]);
    this.support.frustumCulled = false;
    this.edge = new T.LineLoop(new T.BufferGeometry(), new T.LineBasicMaterial({ color: 0x12a17c }));
    this.edge.geometry.setAttribute("position", this.support.geometry.getAttribute("position"));
    this.edge.frustumCulled = false;
    scene.add(this.support, this.edge);
    this.zmp = new T.Mesh(new T.CircleGeometry(0.007, 32), flat(0xd1495b, 0.95));
    scene.add(this.zmp);
    this.pathLine(T, scene);
    this.arrow = new T.ArrowHelper(new T.Vector3(1, 0, 0), new T.Vector3(), 0.2, 0xd1495b, 0.05, 0.03);
    this.arrow.visible = false;
    scene.add(this.arrow);
    for (const item of [...this.discs, this.support, this.edge, this.zmp]) item.renderOrder = 2;
  }
  pathLine(T, scene) {
    this.drawn = 0;
    this.path = new T.Line(new T.BufferGeometry(), new T.LineBasicMaterial({ color: 0x6b5bd2 }));
    this.path.geometry.setAttribute("position", new T.BufferAttribute(new Float32Array(3 * this.rec.room), 3));
    this.path.frustumCulled = false;
    scene.add(this.path);
  }
  // Lays the path up to frame i; what was laid before stays.
  extendPath(i) {
    const rec = this.rec, points = this.path.geometry.getAttribute("position");
    if (i < this.drawn - 1 && rec.count < this.drawn) this.drawn = 0;
    for (; this.drawn <= i; this.drawn++) {
      const [x, y, z] = rec.q.subarray(rec.width * this.drawn, rec.width * this.drawn + 3);
      points.setXYZ(this.drawn, x, y, rec.data.rough ? z : rec.groundHeight(x, y) + 0.0015);
      points.needsUpdate = true;
    }
    this.path.geometry.setDrawRange(0, this.shown.path ? i + 1 : 0);
  }
  // Camera and target live in a frame that meshcat turns: world (x, y, z) is local (x, z, -y).
  preset(name) {
    const offsets = { corner: this.room ? [-1.0, -1.25, 1.55] : this.rec.data.rough ? [-0.62, -0.95, 0.62] : [0.62, -0.85, 0.42], side: [0.02, -1.15, 0.16], front: [1.15, 0.0, 0.18], top: [-0.01, 0, 1.5] };
    const [x, y] = this.trunk, z = this.rec.groundHeight(x, y);
    const { camera, controls } = this.viewer;
    if (name === "path") {
      const [low, high] = this.bounds(), size = Math.max(high[0] - low[0], high[1] - low[1], 0.5);
      const cx = (low[0] + high[0]) / 2, cy = (low[1] + high[1]) / 2, away = 0.75 * size + 0.7;
      controls.target.set(cx, 0.03, -cy);
      camera.position.set(cx + 0.15 * away, 0.62 * away, -cy + 0.95 * away);
      this.viewer.scene.fog.far = 5.2 + 3 * size;
    } else {
      const [dx, dy, dz] = offsets[name], ahead = name === "corner" && this.rec.data.rough ? 0.3 : 0;  // m
      controls.target.set(x + ahead, z + 0.06, -y);
      camera.position.set(x + dx, z + 0.06 + dz, -(y + dy));
      this.viewer.scene.fog.far = this.far;
    }
    this.follow = name !== "path";
    controls.update();
    this.viewer.set_dirty();
  }
  bounds() {
    const rec = this.rec, low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    if (this.room) return [this.room.slice(0, 2), this.room.slice(2)];
    for (let i = 0; i < rec.count; i++) for (const axis of [0, 1]) {
      low[axis] = Math.min(low[axis], rec.q[rec.width * i + axis]);
      high[axis] = Math.max(high[axis], rec.q[rec.width * i + axis]);
    }
    return [low, high];
  }
  show(t) {
    const T = MeshCat.THREE, rec = this.rec;
    if (!rec.count) return;
    const { i, j, s } = rec.at(t), a = rec.width * i, b = rec.width * j;
    const mix = (array, offset, next) => array[offset] + s * (array[next] - array[offset]);
    const trunk = [0, 1, 2].map((k) => mix(rec.q, a + k, b + k));
    const [body, ...joints] = this.nodes;
    body.object.position.set(...trunk);
    body.object.quaternion.set(...rec.q.subarray(a + 3, a + 7)).slerp(new T.Quaternion(...rec.q.subarray(b + 3, b + 7)), s);
    for (const joint of joints) {
      joint.object.quaternion.setFromAxisAngle(joint.axis, mix(rec.q, a + joint.q, b + joint.q)).premultiply(joint.rest);
    }
    this.showGround(i, (leg, k) => mix(rec.feet, 12 * i + 3 * leg + k, 12 * j + 3 * leg + k));
    this.showPush(i, trunk);
    this.extendPath(i);
    if (this.leader && this.leader.time) this.leader.show(t);
    if (this.sweeps && this.sweeps.time) this.sweeps.show(t, this.shown.sweep);
    if (this.ground && this.ground.aims) this.ground.show(t, this.shown);
    this.move(trunk);
    this.viewer.set_dirty();
  }
  showGround(i, foot) {
    const rec = this.rec, corners = rec.support(i), position = this.support.geometry.getAttribute("position");
    this.discs.forEach((disc, leg) => {
      const x = foot(leg, 0), y = foot(leg, 1);
      disc.position.set(x, y, rec.under(x, y, foot(leg, 2)) + 0.0025);
      disc.quaternion.copy(this.floor.quaternion);
      disc.visible = Boolean(rec.loaded(i, leg));
    });
    const visible = this.shown.support && corners.length >= 2;
    this.support.visible = visible && corners.length >= 3;
    this.edge.visible = visible;
    for (let k = 0; k < 4; k++) {
      const [x, y, z] = corners[Math.min(k, corners.length - 1)] || [0, 0, 0];
      position.setXYZ(k, x, y, rec.under(x, y, z) + 0.002);
    }
    position.needsUpdate = true;
    const x = rec.zmp[2 * i], y = rec.zmp[2 * i + 1];
    this.zmp.visible = this.shown.support && Number.isFinite(x);
    const middle = corners.reduce((sum, p) => sum + p[2], 0) / Math.max(1, corners.length);
    if (this.zmp.visible) this.zmp.position.set(x, y, rec.under(x, y, middle) + 0.003);
  }
  showPush(i, trunk) {
    const rec = this.rec;
    const force = rec.push ? rec.push.subarray(3 * i, 3 * i + 3) : [0, 0, 0], size = Math.hypot(...force);
    this.arrow.visible = size > 0.1;
    if (!this.arrow.visible) return;
    const direction = new MeshCat.THREE.Vector3(...force).normalize(), length = 0.1 + 0.006 * size;
    this.arrow.setDirection(direction);
    this.arrow.setLength(length, 0.05, 0.03);
    this.arrow.position.set(...trunk).addScaledVector(direction, -length - 0.11).setZ(trunk[2] + 0.05);
  }
  move(trunk) {
    const [dx, dy] = [trunk[0] - this.trunk[0], trunk[1] - this.trunk[1]];
    const dz = this.rec.groundHeight(trunk[0], trunk[1]) - this.rec.groundHeight(this.trunk[0], this.trunk[1]);
    this.trunk = trunk;
    if (this.follow) {
      for (const vector of [this.viewer.camera.position, this.viewer.controls.target]) {
        vector.x += dx; vector.y += dz; vector.z -= dy;
      }
    }
    const z = this.rec.groundHeight(trunk[0], trunk[1]);
    this.light(trunk[0], trunk[1], z);
    // The floor moves by whole tiles, so that it seems to be endless and at rest.
    const fx = 0.2 * Math.round(trunk[0] / 0.2), fy = 0.2 * Math.round(trunk[1] / 0.2);
    const { rough } = this.rec.data;
    this.floor.position.set(fx, fy, rough ? rough.floor : this.rec.groundHeight(fx, fy));
  }
}

class PlanView {
  constructor(canvas, recording) {
    this.canvas = canvas; this.rec = recording; this.time = 0;
    this.half = 0.2;  // m shown to each side: what the first stance needs
    this.fitted = false;
    new ResizeObserver(() => this.show(this.time)).observe(canvas);
  }
  show(t) {
    this.time = t;
    const { canvas, rec } = this, ratio = window.devicePixelRatio || 1;
    const w = canvas.clientWidth, h = canvas.clientHeight;
    if (!w || !h || !rec.count) return;
    if (!this.fitted) this.fit();
    if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
      canvas.width = Math.round(w * ratio); canvas.height = Math.round(h * ratio);
    }
    const g = canvas.getContext("2d"), css = getComputedStyle(canvas);
    const colour = (name) => css.getPropertyValue(name).trim();
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, w, h);
    const { i } = rec.at(t), x0 = rec.q[rec.width * i], y0 = rec.q[rec.width * i + 1];
    const scale = Math.min(w, h) / (2 * this.half);
    // Forward (x) is up, left (y) is left.
    const at = (x, y) => [w / 2 - (y - y0) * scale, h / 2 - (x - x0) * scale];
    this.grid(g, at, w, h, scale, x0, y0, colour("--line"));
    this.trail(g, at, rec.zmp, 2, i, 60, "#d1495b", 0.35);
    this.trail(g, at, rec.com, 3, i, 100, "#6b5bd2", 0.6);
    this.trunkOutline(g, at, i, x0, y0, colour("--muted"));
    this.polygon(g, at, i);
    for (let leg = 0; leg < 4; leg++) this.foot(g, at, i, leg, colour("--card"));
    this.marker(g, at, rec.zmpPlan, 2, i, "#d1495b", true);
    this.marker(g, at, rec.com, 3, i, "#6b5bd2", false);
    this.marker(g, at, rec.zmp, 2, i, "#d1495b", false);
    g.fillStyle = colour("--muted"); g.font = "11px system-ui, sans-serif"; g.textAlign = "left";
    g.strokeStyle = g.fillStyle; g.lineWidth = 1.5; g.beginPath(); g.moveTo(12, h - 12); g.lineTo(12 + 0.1 * scale, h - 12); g.stroke();
    g.fillText("100 mm", 12, h - 18);
  }
  fit() {
    const rec = this.rec;
    for (let leg = 0; leg < 4; leg++) {
      const [x, y] = rec.foot(0, leg);
      this.half = Math.max(this.half, 1.62 * Math.abs(x - rec.q[0]), 1.62 * Math.abs(y - rec.q[1]));
    }
    this.fitted = true;
  }
  grid(g, at, w, h, scale, x0, y0, colour) {
    g.strokeStyle = colour; g.lineWidth = 1; g.beginPath();
    const across = w / 2 / scale, along = h / 2 / scale, step = 0.1;
    for (let x = Math.ceil((x0 - along) / step) * step; x < x0 + along; x += step) { const [, v] = at(x, 0); g.moveTo(0, v); g.lineTo(w, v); }
    for (let y = Math.ceil((y0 - across) / step) * step; y < y0 + across; y += step) { const [u] = at(0, y); g.moveTo(u, 0); g.lineTo(u, h); }
    g.stroke();
  }
  trail(g, at, values, width, i, length, colour, alpha) {
    g.strokeStyle = colour; g.globalAlpha = alpha; g.lineWidth = 1.5; g.beginPath();
    let open = false;
    for (let k = Math.max(0, i - length); k <= i; k++) {
      const x = values[width * k], y = values[width * k + 1];
      if (!Number.isFinite(x)) { open = false; continue; }
      const [u, v] = at(x, y);
      if (open) g.lineTo(u, v); else g.moveTo(u, v);
      open = true;
    }
    g.stroke(); g.globalAlpha = 1;
  }
  trunkOutline(g, at, i, x0, y0, colour) {
    const yaw = this.rec.yaw(i), c = Math.cos(yaw), s = Math.sin(yaw), d = 0.1, n = 0.13;
    const corner = (a, b) => at(x0 + c * a - s * b, y0 + s * a + c * b);
    g.strokeStyle = colour; g.globalAlpha = 0.55; g.lineWidth = 1.25; g.beginPath();
    for (const [k, p] of [[d, d], [n, 0], [d, -d], [-d, -d], [-d, d]].entries()) { const [u, v] = corner(...p); if (k) g.lineTo(u, v); else g.moveTo(u, v); }
    g.closePath(); g.stroke(); g.globalAlpha = 1;
  }
  polygon(g, at, i) {
    const corners = this.rec.support(i);
    if (corners.length < 2) return;
    g.beginPath();
    corners.forEach(([x, y], k) => { const [u, v] = at(x, y); if (k) g.lineTo(u, v); else g.moveTo(u, v); });
    g.closePath();
    g.fillStyle = "rgba(18,161,124,0.16)"; g.fill();
    g.strokeStyle = "#12a17c"; g.lineWidth = 1.5; g.stroke();
  }
  foot(g, at, i, leg, paper) {
    const [x, y] = this.rec.foot(i, leg), [u, v] = at(x, y), { name, colour } = this.rec.data.legs[leg];
    g.beginPath(); g.arc(u, v, 7, 0, 7); g.lineWidth = 2.5; g.strokeStyle = colour;
    g.fillStyle = this.rec.loaded(i, leg) ? colour : paper; g.fill(); g.stroke();
    g.fillStyle = colour; g.font = "600 11px system-ui, sans-serif"; g.textAlign = "center";
    g.fillText(name, u, v - 13);
  }
  marker(g, at, values, width, i, colour, hollow) {
    const x = values[width * i], y = values[width * i + 1];
    if (!Number.isFinite(x)) return;
    const [u, v] = at(x, y);
    g.beginPath(); g.arc(u, v, 5, 0, 7); g.lineWidth = 2; g.strokeStyle = colour; g.fillStyle = colour;
    if (hollow) g.stroke(); else g.fill();
  }
}

function openView(pane, recording) {
  try {
    return new View3D(pane, recording);
  } catch (error) {
    pane.innerHTML = '<p class="no-webgl">This browser shows no 3D (WebGL is off). The view from above still works.</p>';
    console.warn("no 3D view:", error);
    return null;
  }
}

function wireControls(root, view, redraw) {
  for (const item of root.querySelectorAll("[data-camera]")) item.onclick = () => { if (view) view.preset(item.dataset.camera); };
  for (const item of root.querySelectorAll("[data-show]")) {
    item.onchange = () => { if (view) { view.shown[item.dataset.show] = item.checked; redraw(); } };
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { if (view) view.theme(); redraw(); });
}

// Ties clock, views and the controls inside `root` together. Elements are found by data-role.
function startReplay(root, data) {
  const role = (name) => root.querySelector(`[data-role="${name}"]`);
  const recording = new Recording(data), clock = new Clock(recording.duration);
  const plan = role("plan") ? new PlanView(role("plan"), recording) : null;
  const view = openView(role("view"), recording);
  const slider = role("time"), button = role("play"), label = role("clock"), state = role("state");
  slider.max = recording.duration; slider.step = 0.01;
  clock.watch((t) => {
    if (view) view.show(t);
    if (plan) plan.show(t);
    slider.value = t;
    label.textContent = `${t.toFixed(2)} s`;
    button.textContent = clock.playing ? "\u275A\u275A" : "\u25B6";
    button.setAttribute("aria-label", clock.playing ? "Pause" : "Play");
    if (state && recording.count) {
      const { i } = recording.at(t), [roll, pitch] = recording.rollPitch(i);
      state.textContent = `${data.modes[recording.mode[i]]} · roll ${degrees(roll)} · pitch ${degrees(pitch)}`;
    }
  });
  button.onclick = () => clock.toggle();
  slider.oninput = () => clock.seek(Number(slider.value));
  role("rate").onchange = (event) => { clock.rate = Number(event.target.value); };
  wireControls(root, view, () => clock.tell());
  root.addEventListener("keydown", (event) => {
    if (event.target.tagName === "SELECT") return;
    const step = { ArrowLeft: -0.1, ArrowRight: 0.1 }[event.key];
    if (event.key === " " && event.target.tagName !== "BUTTON") { clock.toggle(); event.preventDefault(); }
    if (step) { clock.seek(clock.time + step); event.preventDefault(); }
  });
  return { clock, view, plan, recording };
}

"use strict";
// Rough ground in the 3D view: the cloud, the map in force, the planned way and the chosen footholds.

class GroundView {
  constructor(scene, data, legs) {
    const T = MeshCat.THREE;
    this.data = data; this.scene = scene; this.drawn = null;
    this.scale = data.scale.map((colour) => new T.Color(colour));
    this.map = new T.Mesh(new T.BufferGeometry(), new T.MeshBasicMaterial({ vertexColors: true, side: T.DoubleSide, transparent: true, opacity: 0.85, polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1 }));
    this.route = new T.Line(new T.BufferGeometry(), new T.LineBasicMaterial({ color: 0xe61a8c }));
    this.discs = legs.map((leg) => new T.Mesh(new T.CircleGeometry(0.012, 32), new T.MeshBasicMaterial({ color: leg.colour, transparent: true, opacity: 0.85, depthWrite: false, side: T.DoubleSide })));
    for (const item of [this.map, this.route, ...this.discs]) { item.visible = false; item.frustumCulled = false; scene.add(item); }
    for (const item of [this.route, ...this.discs]) item.renderOrder = 3;
    if (data.points) this.readCloud(T);
    if (data.aims) {
      this.aims = { leg: data.aims.leg, time: unpack(data.aims.time), at: GroundView.whole(data.aims.at) };
    }
  }
  // Whole numbers of two bytes.
  static whole(text) { return new Int16Array(unpack(text).buffer); }
  colour(millimetres, into) {
    const last = this.scale.length - 1;
    const share = last * Math.min(1, Math.max(0, 0.5 + 0.5 * millimetres / this.data.span)), k = Math.min(last - 1, Math.floor(share));
    return into.copy(this.scale[k]).lerp(this.scale[k + 1], share - k);
  }
  readCloud(T) {
    const at = GroundView.whole(this.data.points), colours = new Float32Array(at.length), one = new T.Color();
    for (let k = 0; k < at.length; k += 3) this.colour(at[k + 2], one).toArray(colours, k);
    const geometry = new T.BufferGeometry();
    geometry.setAttribute("position", new T.BufferAttribute(Float32Array.from(at, (value) => value / 1000), 3));
    geometry.setAttribute("color", new T.BufferAttribute(colours, 3));
    this.cloud = new T.Points(geometry, new T.PointsMaterial({ vertexColors: true, size: 3, sizeAttenuation: false }));
    this.cloud.frustumCulled = false;
    this.cloudTime = unpack(this.data.pointTime);
    this.scene.add(this.cloud);
  }
  // One small square for each known cell, at its height.
  setMap(map) {
    if (map === this.drawn || (map && this.drawn && map.number && map.number === this.drawn.number)) return;
    this.drawn = map;
    this.map.visible = false;
    if (!map) return;
    if (map.span) this.data.span = map.span;
    const T = MeshCat.THREE, heights = GroundView.whole(map.heights), known = [];
    heights.forEach((height, k) => { if (height !== -32768) known.push(k); });
    const [x0, y0, yaw] = map.frame, c = Math.cos(yaw), s = Math.sin(yaw), { cell, columns } = map;
    const position = new Float32Array(12 * known.length), colours = new Float32Array(12 * known.length), index = new Uint32Array(6 * known.length), one = new T.Color();
    known.forEach((k, n) => {
      const row = Math.floor(k / columns), column = k % columns;
      this.colour(heights[k], one);
      [[0, 0], [1, 0], [1, 1], [0, 1]].forEach(([dx, dy], corner) => {
        const u = (column + dx) * cell, v = (row + dy) * cell, at = 12 * n + 3 * corner;
        position.set([x0 + c * u - s * v, y0 + s * u + c * v, heights[k] / 1000 + 0.001], at);
        one.toArray(colours, at);
      });
      index.set([0, 1, 2, 0, 2, 3].map((corner) => 4 * n + corner), 6 * n);
    });
    this.map.geometry.dispose();
    this.map.geometry = new T.BufferGeometry();
    this.map.geometry.setAttribute("position", new T.BufferAttribute(position, 3));
    this.map.geometry.setAttribute("color", new T.BufferAttribute(colours, 3));
    this.map.geometry.setIndex(new T.BufferAttribute(index, 1));
  }
  // Points (m) of the planned way, one after the other.
  setRoute(points) {
    if (points === this.planned) return;
    this.planned = points;
    this.route.visible = Boolean(points);
    if (!points) return;
    this.route.geometry.dispose();
    this.route.geometry = new MeshCat.THREE.BufferGeometry();
    this.route.geometry.setAttribute("position", new MeshCat.THREE.BufferAttribute(Float32Array.from(points), 3));
  }
  // Footholds: a place (m) for each leg, or null.
  setAims(places) {
    this.discs.forEach((disc, leg) => {
      const at = places[leg];
      disc.visible = Boolean(at);
      if (at) disc.position.set(at[0], at[1], at[2] + 0.003);
    });
  }
  show(t, shown) {
    const { data } = this, newest = (entries) => entries.filter((entry) => entry.time <= t + 1e-4).pop() || null;
    if (this.cloud) {
      let low = 0, high = this.cloudTime.length;
      while (low < high) { const middle = (low + high) >> 1; if (this.cloudTime[middle] <= t + 1e-4) low = middle + 1; else high = middle; }
      this.cloud.geometry.setDrawRange(0, low);
      this.cloud.visible = shown.cloud;
    }
    this.setMap(newest(data.maps));
    this.map.visible = shown.map && Boolean(this.drawn);
    const route = newest(data.routes);
    this.setRoute(route && route.points);
    this.route.visible = shown.path && Boolean(route);
    const places = [null, null, null, null], { leg, time, at } = this.aims;
    leg.forEach((one, k) => { if (time[2 * k] <= t && t < time[2 * k + 1]) places[one] = [0, 1, 2].map((axis) => at[3 * k + axis] / 1000); });
    this.setAims(places);
  }
}

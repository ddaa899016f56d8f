"use strict";
// What moves around the robot in the 3D view: a leader on its wheels, and the LIDAR's newest sweep.

class LeaderView {
  constructor(viewer, data) {
    const find = (...path) => viewer.scene_tree.find(["meshcat", "leader", ...path]).object;
    this.frame = find("frame"); this.base = find("wheels"); this.axle = data.axle;
    this.wheels = data.wheels.map((wheel) => ({ ...wheel, object: find("wheels", `wheel${wheel.index}`) }));
    for (const key of ["time", "pose", "turned", "steered"]) this[key] = data[key] ? unpack(data[key]) : null;
    this.frame.visible = this.base.visible = false;
  }
  // Pose: position of its point on the floor and quaternion; wheels: rad turned and steered.
  place(pose, turned, steered) {
    const T = MeshCat.THREE, [x, y, z, qx, qy, qz, qw] = pose;
    this.frame.visible = this.base.visible = Number.isFinite(x);
    if (!this.frame.visible) return;
    this.frame.position.set(x, y, z + this.axle);
    this.frame.quaternion.set(qx, qy, qz, qw);
    const up = new T.Vector3(0, 0, 1), ahead = new T.Vector3(1, 0, 0), roll = new T.Quaternion();
    this.base.position.set(x, y, z);
    this.base.quaternion.setFromAxisAngle(up, Math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz)));
    this.wheels.forEach((wheel, k) => {
      wheel.object.quaternion.setFromAxisAngle(up, wheel.axis + (steered[k] || 0));
      if (wheel.rolls) wheel.object.quaternion.multiply(roll.setFromAxisAngle(ahead, turned[k] || 0));
    });
  }
  show(t) {
    const { time, wheels } = this, last = time.length - 1;
    let i = 0, j = last;
    while (i < j) { const middle = (i + j + 1) >> 1; if (time[middle] <= t) i = middle; else j = middle - 1; }
    j = Math.min(i + 1, last);
    const s = j > i ? Math.min(1, Math.max(0, (t - time[i]) / (time[j] - time[i]))) : 0;
    const row = (array, width) => Array.from({ length: width }, (_, k) => array[width * i + k] + s * (array[width * j + k] - array[width * i + k]));
    const pose = row(this.pose, 7), size = Math.hypot(...pose.slice(3));
    // Neighbouring quaternions lie close together: their mean only needs its length back.
    this.place(pose.map((value, k) => (k < 3 ? value : value / size)), row(this.turned, wheels.length), row(this.steered, wheels.length));
  }
}

// Waypoints on the floor, and the marker where the robot believes it to be.
class GoalView {
  constructor(scene) {
    const T = MeshCat.THREE;
    this.scene = scene; this.discs = [];
    this.ghost = new T.Mesh(new T.SphereGeometry(0.07, 20, 14), new T.MeshBasicMaterial({ color: 0xe61a8c, wireframe: true, transparent: true, opacity: 0.35 }));
    this.ghost.visible = false;
    scene.add(this.ghost);
  }
  place(waypoints, reached, marker) {
    const T = MeshCat.THREE;
    while (this.discs.length < waypoints.length) {
      const disc = new T.Mesh(new T.RingGeometry(0.05, 0.07, 40), new T.MeshBasicMaterial({ color: 0x6b5bd2, transparent: true, side: T.DoubleSide }));
      this.discs.push(disc);
      this.scene.add(disc);
    }
    this.discs.forEach((disc, k) => {
      disc.visible = k < waypoints.length;
      if (!disc.visible) return;
      disc.position.set(waypoints[k][0], waypoints[k][1], 0.003);
      disc.material.opacity = k < reached ? 0.25 : k === reached ? 1 : 0.6;
    });
    this.ghost.visible = Boolean(marker);
    if (marker) this.ghost.position.set(...marker);
  }
}

class SweepView {
  constructor(scene, data, recording) {
    const T = MeshCat.THREE;
    this.rec = recording; this.mount = data.mount; this.shown = -1;
    this.turn = data.turn || [1, 0, 0, 0, 1, 0, 0, 0, 1];  // of the scan plane on the trunk, row by row
    this.bearing = unpack(data.bearing);
    this.time = data.time ? unpack(data.time) : null;
    this.distance = data.distance ? new Uint16Array(unpack(data.distance).buffer) : null;
    this.points = new T.Points(new T.BufferGeometry(), new T.PointsMaterial({ color: 0xe03a4e, size: 4, sizeAttenuation: false }));
    this.points.geometry.setAttribute("position", new T.BufferAttribute(new Float32Array(3 * this.bearing.length), 3));
    this.points.frustumCulled = false;
    this.points.visible = false;
    scene.add(this.points);
  }
  // Pose: trunk position and quaternion at the time of the sweep; millimetres, 0 where nothing came back.
  place(pose, millimetres) {
    const T = MeshCat.THREE, position = this.points.geometry.getAttribute("position");
    const turn = new T.Quaternion(pose[3], pose[4], pose[5], pose[6]), point = new T.Vector3(), [x, y, z] = this.mount;
    let n = 0;
    this.bearing.forEach((bearing, k) => {
      const away = millimetres[k] / 1000 - 0.02;  // m; shown a little before what they met, or it would hide them
      if (!(away > 0.05)) return;
      const u = away * Math.cos(bearing), v = away * Math.sin(bearing), [xx, xy, , yx, yy, , zx, zy] = this.turn;
      point.set(x + xx * u + xy * v, y + yx * u + yy * v, z + zx * u + zy * v).applyQuaternion(turn);
      position.setXYZ(n++, pose[0] + point.x, pose[1] + point.y, pose[2] + point.z);
    });
    this.points.geometry.setDrawRange(0, n);
    position.needsUpdate = true;
  }
  // Points in the world, mm, one after the other.
  put(millimetres, wanted) {
    const position = this.points.geometry.getAttribute("position"), n = millimetres.length / 3;
    for (let k = 0; k < n; k++) position.setXYZ(k, millimetres[3 * k] / 1000, millimetres[3 * k + 1] / 1000, millimetres[3 * k + 2] / 1000);
    this.points.geometry.setDrawRange(0, n);
    this.points.visible = wanted;
    position.needsUpdate = true;
  }
  show(t, wanted) {
    const { time, rec } = this, m = this.bearing.length;
    let i = 0, j = time.length - 1;
    while (i < j) { const middle = (i + j + 1) >> 1; if (time[middle] <= t + 1e-4) i = middle; else j = middle - 1; }
    const age = t - time[i], spacing = time.length > 1 ? time[1] - time[0] : 0.1;
    this.points.visible = wanted && age > -1e-4 && age < Math.max(0.5, 1.5 * spacing);
    if (!this.points.visible || this.shown === i) return;
    this.shown = i;
    const { i: frame } = rec.at(time[i] + 1e-4);
    this.place(rec.q.subarray(rec.width * frame, rec.width * frame + 7), this.distance.subarray(m * i, m * i + m));
  }
}

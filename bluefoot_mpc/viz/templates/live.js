"use strict";
// The same views as the replay's, on a recording that grows with every state from the server.
(function () {
  const CAPACITY = 20000;
  const root = document.getElementById("live");
  const role = (name) => root.querySelector(`[data-role="${name}"]`);

  class LiveRecording extends Recording {
    constructor(data) {
      super({ ...data, modes: [], ground: [0, 0, 0] }, CAPACITY);
      this.count = 0;
    }
    add(state) {
      if (this.count === CAPACITY) this.forget(CAPACITY / 2);
      const i = this.count++;
      const missing = [NaN, NaN, NaN];
      this.time[i] = state.time;
      this.q.set(state.q, this.width * i);
      this.feet.set(state.feet, 12 * i);
      this.states[i] = state.states;
      this.com.set(state.com || missing, 3 * i);
      this.zmp.set([NaN, NaN], 2 * i);
      this.zmpPlan.set(state.zmpPlan || [NaN, NaN], 2 * i);
      this.push.set(state.push || [0, 0, 0], 3 * i);
    }
    forget(n) {
      for (const key of ["time", "q", "feet", "states", "com", "zmp", "zmpPlan", "push"]) {
        const width = this[key].length / CAPACITY;
        this[key].copyWithin(0, width * n);
      }
      this.count -= n;
    }
  }

  const recording = new LiveRecording(JSON.parse(document.getElementById("run-data").textContent));
  const plan = new PlanView(role("plan"), recording);
  const view = openView(role("view"), recording);
  if (view) view.shown.map = true;
  wireControls(root, view, () => draw());
  let state = null, fresh = false;

  // What surrounds the robot; a sweep stays until the next one comes, or for half a second.
  let swept = 0;
  function around() {
    if (state.leader && view.leader) view.leader.place(state.leader, state.turned, state.steered);
    if (state.sweep) { swept = state.time; view.sweeps.put(state.sweep, view.shown.sweep); }
    if (state.time - swept > 0.5 || state.time < swept || !view.shown.sweep) view.sweeps.points.visible = false;
    const { ground } = view;
    if (state.map) ground.setMap(state.map);
    if (state.route) ground.setRoute(state.route);
    ground.map.visible = view.shown.map && Boolean(ground.drawn);
    ground.route.visible = view.shown.path && Boolean(ground.planned);
    ground.setAims(state.aims || []);
    view.goals.place(state.waypoints || [], state.reached || 0, state.marker || null);
  }

  function draw() {
    if (!state) return;
    const i = recording.count - 1;
    if (view) view.show(recording.time[i]);
    plan.show(recording.time[i]);
    if (view) around();
    const [roll, pitch] = recording.rollPitch(i), [forward, left, turn] = state.speed;
    const mm = (x) => (1000 * x).toFixed(0).replace("-", "\u2212");
    role("state").textContent = `${state.mode} · roll ${degrees(roll)} · pitch ${degrees(pitch)}`;
    role("clock").textContent = `${state.time.toFixed(1)} s`;
    role("command").textContent = state.mode === "walk"
      ? `${state.phase ? `${state.phase}${state.reason ? ` (${state.reason})` : ""} · ` : ""}${state.guided ? `led by: ${state.guided}${state.reason ? ` (${state.reason})` : ""} · ` : ""}${state.gait}, ${mm(forward)} mm/s forward, ${mm(left)} mm/s left, ${degrees(turn)}/s left turn` : state.mode;
    if (state.events.length) role("event").textContent = state.events[state.events.length - 1];
  }

  function frame() {
    if (fresh) { fresh = false; draw(); }
    requestAnimationFrame(frame);
  }

  function connect() {
    const socket = new WebSocket(`ws://${location.host}/state`);
    socket.onmessage = (message) => {
      const next = JSON.parse(message.data);
      if (state && next.time < state.time) recording.count = 0;  // a new run
      if (next.map) role("map-choice").hidden = false;
      if (fresh && state && state.sweep && !next.sweep) next.sweep = state.sweep;  // not drawn yet
      if (fresh && state && state.map && !next.map) { next.map = state.map; next.route = state.route; }
      state = next;
      recording.add(state);
      fresh = true;
    };
    socket.onclose = () => { role("state").textContent = "the run has ended"; setTimeout(connect, 1500); };
  }

  frame();
  connect();
})();

"use strict";
// The ground station's page: states come in, words of the operator go out.
(function () {
  const CAPACITY = 20000;
  const root = document.body, role = (name) => root.querySelector(`[data-role="${name}"]`);
  const facts = JSON.parse(document.getElementById("facts").textContent);
  const data = { ...JSON.parse(document.getElementById("run-data").textContent), modes: [], ground: [0, 0, 0] };

  const recording = new Recording(data, CAPACITY);
  recording.count = 0;
  recording.zmp.fill(NaN); recording.zmpPlan.fill(NaN); recording.com.fill(NaN);
  function record(state) {
    const last = recording.count ? recording.time[recording.count - 1] : -1;
    if (state.time === null || state.time === last) return;
    if (state.time < last) recording.count = 0;  // a new run
    if (recording.count === CAPACITY) {
      const half = CAPACITY / 2;
      for (const key of ["time", "q", "feet", "states"]) recording[key].copyWithin(0, recording[key].length / 2);
      recording.count = half;
    }
    const i = recording.count++;
    recording.time[i] = state.time;
    recording.q.set(state.q, recording.width * i);
    recording.feet.set(state.feet, 12 * i);
    recording.states[i] = state.states;
  }

  const view = openView(role("view"), recording);
  wireControls(root, view, () => { fresh = true; });
  const plot = new TimePlot(role("plot"), ["#1283d2", "#e07020"], 20);
  const legs = new LegTable(role("legs"), facts);
  let socket = null, state = null, fresh = false, lastText = 0, closedSince = performance.now();
  const say = (words) => { if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(words)); };
  const controls = new Controls(root, say), map = new WayMap(root, say);

  const set = (name, text, mood) => {
    const item = role(name);
    if (item.textContent !== text) item.textContent = text;
    if (mood !== undefined) { item.classList.remove("good", "warn", "bad"); if (mood) item.classList.add(mood); }
  };
  const percent = (share) => `${(100 * share).toFixed(0)} %`;
  const above = (value, warn, bad) => value === null ? "" : value >= bad ? "bad" : value >= warn ? "warn" : "";

  function show() {
    const link = state.link, lost = link.age === null || link.age > 1.5;
    set("link", link.age === null ? "no robot yet" : lost ? `lost for ${link.age.toFixed(0)} s` : "connected", lost ? "bad" : "good");
    const alarm = [6, 8].includes(state.alarm) ? "bad" : state.alarm === 5 ? "warn" : "good";
    const doing = state.way.task || state.gait;
    set("mode", state.mode ? `${state.mode}${state.mode === "walk" ? " · " + doing : ""}` : "–", lost || !state.mode ? "" : alarm);
    set("armed", state.mode ? (state.armed ? "torque on" : "torque off") + (state.state ? ` · ${state.state}` : "") : "–", state.armed && !lost ? "warn" : "");
    set("voltage", state.voltage === null ? "–" : `${state.voltage.toFixed(2)} V`, state.voltage === null ? "" : state.voltage < 10.2 ? "bad" : state.voltage < 10.8 ? "warn" : "");
    const warm = state.temperatures.filter((value) => value !== null), hottest = warm.length ? Math.max(...warm) : null;
    set("hottest", hottest === null ? "–" : `${hottest.toFixed(0)} °C`, above(hottest, 60, 65));
    set("load", state.load === null ? "–" : percent(state.load), above(state.load, 0.8, 1));
    set("traffic", `${percent(link.down)} + ${percent(link.up)}`, above(link.down + link.up, 0.6, 0.8));
    set("loss", `${percent(link.lossDown)} / ${percent(link.lossUp)}`, above(Math.max(link.lossDown, link.lossUp), 0.05, 0.25));
    set("clock", state.time === null ? "–" : `${state.time.toFixed(1)} s`);
    veil(lost, link.age);
    wanted();
    legs.show(state);
    map.show(state);
    if (state.rpy[0] !== null) {
      const [roll, pitch, yaw] = state.rpy;
      drawHorizon(role("horizon"), roll, pitch, yaw);
      set("roll", degrees(roll)); set("pitch", degrees(pitch)); set("yaw", degrees(yaw));
      plot.add(state.time, [roll * 180 / Math.PI, pitch * 180 / Math.PI]);
      plot.draw();
    }
    if (view && recording.count) view.show(recording.time[recording.count - 1]);
  }

  function veil(lost, age) {
    role("veil").hidden = !lost;
    if (!lost || age === null) return;
    set("veil-title", `No telemetry for ${age.toFixed(0)} s`);
    set("veil-text", "The robot stands after 1 s without commands, sits after 5 s and switches off after 30 s.");
  }

  function wanted() {
    const operator = state.operator, [forward, left, turn] = operator.velocity;
    const whole = (value) => value.toFixed(0).replace(/^-0$/, "0").replace("-", "\u2212");
    set("forward", whole(1000 * forward)); set("left", whole(1000 * left)); set("turn", whole(turn * 180 / Math.PI));
    const bad = !["", "accepted", "replaced"].includes(operator.result);
    set("result", operator.order ? `${operator.order}: ${operator.result || "…"}` : "\u00a0", bad ? "bad" : "");
    for (const button of root.querySelectorAll(".orders [data-order]")) {
      const name = button.dataset.order;
      button.classList.toggle("now", name === "arm" ? state.armed : name === state.mode);
    }
    for (const button of root.querySelectorAll("[data-gait]")) button.classList.toggle("now", button.dataset.gait === operator.gait);
  }

  function tell(texts) {
    const list = role("texts");
    for (const text of texts) {
      if (text.number <= lastText) continue;
      lastText = text.number;
      const item = document.createElement("li"), time = document.createElement("time"), words = document.createElement("span");
      time.textContent = text.clock; words.textContent = text.text;
      if (text.severity <= 4) words.className = text.severity <= 3 ? "bad" : "warn";
      item.append(time, words);
      list.prepend(item);
      while (list.children.length > 100) list.lastChild.remove();
    }
  }

  function frame() {
    if (fresh && state) { fresh = false; show(); }
    if (!socket || socket.readyState !== WebSocket.OPEN) {
      if (performance.now() - closedSince > 800) {
        set("link", "the station is gone", "bad");
        role("veil").hidden = false;
        set("veil-title", "The station has ended");
        set("veil-text", "Without it the robot stands after 1 s, sits after 5 s and switches off after 30 s.");
      }
    }
    requestAnimationFrame(frame);
  }

  function connect() {
    socket = new WebSocket(`ws://${location.host}/link${location.search}`);
    socket.onmessage = (message) => {
      state = JSON.parse(message.data);
      record(state);
      tell(state.texts);
      fresh = true;
    };
    socket.onclose = () => { controls.release(); closedSince = performance.now(); setTimeout(connect, 1000); };
  }

  window.station = { controls, map, get state() { return state; } };
  frame();
  connect();
})();

"use strict";
// Draws the figures, keeps their time axes together, and ties them to the replay's clock.
(function () {
  const figures = JSON.parse(document.getElementById("figures").textContent);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const root = document.getElementById("replay");
  const replay = root ? startReplay(root, JSON.parse(document.getElementById("run-data").textContent)) : null;
  const drawn = [];

  // Colours beginning with "@" are the page's own and change with its theme.
  function themed(value, colour) {
    if (typeof value === "string") return value.startsWith("@") ? colour("--" + value.slice(1)) : value;
    if (Array.isArray(value)) return value.map((item) => themed(item, colour));
    if (value && typeof value === "object" && value.bdata === undefined) {
      return Object.fromEntries(Object.entries(value).map(([key, item]) => [key, themed(item, colour)]));
    }
    return value;
  }

  function layoutFor(figure, colour) {
    const layout = themed(figure.layout, colour);
    const axis = { gridcolor: colour("--line"), zerolinecolor: colour("--line"), linecolor: colour("--line"), tickcolor: colour("--line"), zeroline: false, title: { standoff: 8 } };
    for (const key of Object.keys(layout)) {
      if (/^[xy]axis\d*$/.test(key)) layout[key] = { ...axis, automargin: key[0] === "y", ...layout[key], title: { ...axis.title, ...layout[key].title } };
    }
    return {
      ...layout,
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", hovermode: layout.hovermode || "x unified", dragmode: "zoom",
      font: { family: "system-ui, -apple-system, Segoe UI, Roboto, Arial, sans-serif", size: 12, color: colour("--muted") },
      hoverlabel: { bgcolor: colour("--card"), bordercolor: colour("--line"), font: { color: colour("--ink") } },
      legend: { orientation: "h", x: 0, y: 1.01, xanchor: "left", yanchor: "bottom" },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: colour("--line"), activecolor: colour("--accent") },
      margin: { l: 56, r: 14, t: 30, b: 44, ...layout.margin },
    };
  }

  function draw() {
    for (const node of document.querySelectorAll("[data-figure]")) {
      const figure = figures[node.dataset.figure];
      drawOne(node, figure);
      if (!node.dataset.tied) tie(node, figure);
    }
  }

  function drawOne(node, figure) {
    const css = getComputedStyle(document.documentElement), colour = (name) => css.getPropertyValue(name).trim();
    Plotly.react(node, themed(figure.data, colour), layoutFor(figure, colour), { displaylogo: false, responsive: true, modeBarButtons: [["zoom2d", "pan2d", "resetScale2d", "toImage"]] });
  }

  function tie(node, figure) {
    node.dataset.tied = "yes";
    drawn.push({ node, figure });
    if (figure.follows) mark(node, drawn[drawn.length - 1]);
    if (!figure.time) return;
    const line = document.createElement("div");
    line.className = "cursor";
    node.appendChild(line);
    drawn[drawn.length - 1].line = line;
    node.on("plotly_click", (event) => { if (replay && event.points.length) replay.clock.seek(event.points[0].x); });
    node.on("plotly_relayout", (change) => {
      if (busy) return;
      if (change["xaxis.range[0]"] !== undefined) together(node, [change["xaxis.range[0]"], change["xaxis.range[1]"]]);
      else if (change["xaxis.autorange"]) together(node, null);
      placeCursors();
    });
  }

  // On a map the replayed robot is marked, and pressing the way goes there.
  function mark(node, entry) {
    const here = entry.here = document.createElement("div");
    here.className = "here";
    here.innerHTML = '<svg viewBox="-8 -8 16 16"><path d="M7 0L-5 -5.5L-2.5 0L-5 5.5Z"/></svg>';
    node.appendChild(here);
    node.on("plotly_click", (event) => {
      const facts = event.points.length && event.points[0].customdata;
      const t = facts ? Number(facts[0]) : NaN;
      if (replay && Number.isFinite(t)) replay.clock.seek(t);
    });
    node.on("plotly_relayout", () => placeHere(entry));
  }

  function placeHere({ node, here }) {
    const full = node._fullLayout;
    if (!replay || !full || !full.xaxis) return;
    const recording = replay.recording, { i } = recording.at(replay.clock.time), size = full._size;
    const x = full.xaxis.l2p(recording.q[recording.width * i]), y = full.yaxis.l2p(recording.q[recording.width * i + 1]);
    const visible = x >= 0 && x <= full.xaxis._length && y >= 0 && y <= full.yaxis._length;
    here.style.display = visible ? "block" : "none";
    here.style.left = `${full.xaxis._offset + x}px`;
    here.style.top = `${full.yaxis._offset + y}px`;
    here.style.transform = `rotate(${-recording.yaw(i)}rad)`;
  }

  // A figure of several instants: its buttons choose one, and take the replay there.
  function wireSteps(row) {
    const figure = figures[row.dataset.steps], node = document.querySelector(`[data-figure="${row.dataset.steps}"]`);
    const buttons = [...row.querySelectorAll("[data-step]")], note = row.querySelector("[data-role=step-note]");
    const choose = (index) => {
      figure.data = figure.steps[index].data;
      buttons.forEach((button, k) => button.setAttribute("aria-pressed", String(k === index)));
      note.textContent = buttons[index].title;
      drawOne(node, figure);
    };
    buttons.forEach((button, k) => {
      button.onclick = () => { choose(k); if (replay) replay.clock.seek(figure.steps[k].time); };
    });
    row.addEventListener("keydown", (event) => {
      const now = buttons.findIndex((button) => button.getAttribute("aria-pressed") === "true");
      const next = now + ({ ArrowLeft: -1, ArrowRight: 1 }[event.key] || 0);
      if (next === now || !buttons[next]) return;
      event.preventDefault();
      buttons[next].focus();
      buttons[next].click();
    });
    choose(Math.max(0, buttons.findIndex((button) => button.title)));
  }

  let busy = false;
  let held = false;  // a person has zoomed in: nothing pages until that is undone
  async function together(source, range) {
    windowWidth = 0;
    held = Boolean(range);
    busy = true;
    for (const { node, figure } of drawn) {
      if (!figure.time || (node === source && range)) continue;
      await Plotly.relayout(node, { "xaxis.range": range || figure.full });
    }
    busy = false;
    placeCursors();
  }

  function placeCursors() {
    if (!replay) return;
    const t = replay.clock.time;
    for (const entry of drawn) {
      const { node, line } = entry;
      if (entry.here) placeHere(entry);
      const full = node._fullLayout;
      if (!line || !full || !full.xaxis) continue;
      const inside = full.xaxis.l2p(t), size = full._size;
      const visible = inside >= 0 && inside <= full.xaxis._length;
      line.style.display = visible ? "block" : "none";
      if (!visible) continue;
      line.style.left = `${size.l + inside}px`;
      line.style.top = `${size.t}px`;
      line.style.height = `${size.h}px`;
    }
  }

  // Figures that show a window of the run page along with the replay.
  function page(t) {
    if (busy || held) return;
    for (const { node, figure } of drawn) {
      const width = windowWidth || (figure.follow ? figure.window : 0);
      if (!figure.time || !width) continue;
      const [low, high] = node._fullLayout.xaxis.range;
      if (t >= low && t <= high && Math.abs(high - low - width) < 1e-6) continue;
      if (!windowWidth && t >= low && t <= high) continue;
      const start = Math.max(0, Math.min(Math.floor(t / width) * width, figures.duration));
      relayout(node, [start, start + width]);
    }
  }

  function relayout(node, range) {
    busy = true;
    Plotly.relayout(node, { "xaxis.range": range }).then(() => { busy = false; placeCursors(); });
  }

  let windowWidth = 0;
  function chooseWindow(width) {
    windowWidth = width;
    held = false;
    for (const { node, figure } of drawn) {
      if (figure.time && !width) relayout(node, figure.full);
    }
    if (replay) page(replay.clock.time);
  }

  draw();
  for (const row of document.querySelectorAll("[data-steps]")) wireSteps(row);
  dark.addEventListener("change", draw);
  addEventListener("resize", () => setTimeout(placeCursors, 60));
  if (replay) {
    replay.clock.watch((t) => { placeCursors(); page(t); });
    const chooser = document.querySelector("[data-role=window]");
    if (chooser) chooser.onchange = () => chooseWindow(Number(chooser.value));
    for (const button of document.querySelectorAll("[data-seek]")) {
      button.onclick = () => { replay.clock.seek(Number(button.dataset.seek)); root.scrollIntoView({ block: "nearest" }); };
    }
    replay.clock.seek(Math.min(figures.start || 0, replay.clock.duration));
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (!calm) new IntersectionObserver((entries, observer) => {
      if (entries.some((entry) => entry.isIntersecting)) { observer.disconnect(); replay.clock.toggle(true); }
    }, { threshold: 0.4 }).observe(root);
    window.replay = replay;
  }
})();

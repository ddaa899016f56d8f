"use strict";
// Instruments of the ground station: artificial horizon, attitude over time, legs.

function fitCanvas(canvas) {
  const ratio = window.devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
  if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
    canvas.width = Math.round(w * ratio); canvas.height = Math.round(h * ratio);
  }
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, w, h);
  return { g, w, h };
}

// roll: right side down +, pitch: nose down +, yaw: left +, all rad.
function drawHorizon(canvas, roll, pitch, yaw) {
  const { g, w, h } = fitCanvas(canvas), r = w / 2, perDegree = r / 24;
  if (!w) return;
  g.save();
  g.beginPath(); g.arc(r, h / 2, r, 0, 7); g.clip();
  g.translate(r, h / 2); g.rotate(-roll);
  const drop = -pitch * 180 / Math.PI * perDegree;  // nose down: the horizon rises
  g.fillStyle = "#5fa8dd"; g.fillRect(-2 * r, -4 * r + drop, 4 * r, 4 * r);
  g.fillStyle = "#a5794e"; g.fillRect(-2 * r, drop, 4 * r, 4 * r);
  g.strokeStyle = "#fff"; g.lineWidth = 2; g.beginPath(); g.moveTo(-2 * r, drop); g.lineTo(2 * r, drop); g.stroke();
  g.lineWidth = 1.25; g.fillStyle = "#fff"; g.font = "9.5px system-ui, sans-serif"; g.textAlign = "right"; g.textBaseline = "middle";
  for (let mark = -15; mark <= 15; mark += 5) {
    if (!mark) continue;
    const y = drop - mark * perDegree, half = mark % 10 ? 11 : 22;
    g.beginPath(); g.moveTo(-half, y); g.lineTo(half, y); g.stroke();
    if (mark % 10 === 0) g.fillText(`${Math.abs(mark)}`, -half - 4, y);
  }
  g.restore();
  g.strokeStyle = "#fff"; g.lineWidth = 1.25;
  for (const mark of [-30, -20, -10, 0, 10, 20, 30]) {
    const a = (mark - 90) * Math.PI / 180, inner = r - (mark % 30 ? 8 : 12);
    g.beginPath(); g.moveTo(r + inner * Math.cos(a), h / 2 + inner * Math.sin(a)); g.lineTo(r + (r - 3) * Math.cos(a), h / 2 + (r - 3) * Math.sin(a)); g.stroke();
  }
  const needle = -roll - Math.PI / 2, tip = r - 13;
  g.fillStyle = "#ffd24a"; g.beginPath();
  g.moveTo(r + tip * Math.cos(needle), h / 2 + tip * Math.sin(needle));
  for (const side of [-0.07, 0.07]) g.lineTo(r + (tip - 11) * Math.cos(needle + side), h / 2 + (tip - 11) * Math.sin(needle + side));
  g.fill();
  g.strokeStyle = "#ffd24a"; g.lineWidth = 3; g.beginPath();
  g.moveTo(r - 44, h / 2); g.lineTo(r - 16, h / 2); g.lineTo(r - 8, h / 2 + 7); g.moveTo(r + 44, h / 2); g.lineTo(r + 16, h / 2); g.lineTo(r + 8, h / 2 + 7);
  g.stroke();
  compass(g, r, h - 22, yaw);
}

function compass(g, x, y, yaw) {
  g.fillStyle = "rgba(10,20,35,.55)"; g.beginPath(); g.arc(x, y, 15, 0, 7); g.fill();
  g.strokeStyle = "rgba(255,255,255,.6)"; g.lineWidth = 1; g.stroke();
  const a = -yaw - Math.PI / 2;
  g.strokeStyle = "#ffd24a"; g.lineWidth = 2.5; g.beginPath();
  g.moveTo(x - 9 * Math.cos(a), y - 9 * Math.sin(a)); g.lineTo(x + 11 * Math.cos(a), y + 11 * Math.sin(a)); g.stroke();
  g.fillStyle = "#ffd24a"; g.beginPath(); g.arc(x + 11 * Math.cos(a), y + 11 * Math.sin(a), 3, 0, 7); g.fill();
}

// Values of the last seconds; lines are drawn against the time of the robot.
class TimePlot {
  constructor(canvas, colours, seconds) {
    this.canvas = canvas; this.colours = colours; this.seconds = seconds; this.rows = [];
  }
  add(time, values) {
    const last = this.rows[this.rows.length - 1];
    if (last && time <= last[0]) { if (time < last[0]) this.rows = []; else return; }
    this.rows.push([time, ...values]);
    while (this.rows.length && this.rows[0][0] < time - this.seconds) this.rows.shift();
  }
  draw() {
    const { g, w, h } = fitCanvas(this.canvas), rows = this.rows;
    if (!w || !rows.length) return;
    const css = getComputedStyle(this.canvas), line = css.getPropertyValue("--line"), ink = css.getPropertyValue("--muted");
    const biggest = Math.max(...rows.map((row) => Math.max(...row.slice(1).map(Math.abs))));
    const full = [3, 6, 12, 30, 90].find((size) => size >= biggest) || 180;
    const left = 34, bottom = h - 18, top = 6, now = rows[rows.length - 1][0];
    const x = (t) => w - 4 - (now - t) / this.seconds * (w - left - 4), y = (v) => top + (1 - v / full) * (bottom - top) / 2;
    g.font = "11px system-ui, sans-serif"; g.fillStyle = ink; g.strokeStyle = line; g.lineWidth = 1;
    g.textBaseline = "middle"; g.textAlign = "right";
    for (const share of [-1, -0.5, 0, 0.5, 1]) {
      g.beginPath(); g.moveTo(left, y(share * full)); g.lineTo(w - 4, y(share * full)); g.stroke();
      g.fillText(`${share * full}°`.replace("-", "\u2212"), left - 5, y(share * full));
    }
    g.textAlign = "center"; g.textBaseline = "alphabetic";
    for (let ago = 0; ago < this.seconds; ago += 5) g.fillText(ago ? `\u2212${ago} s` : "now", Math.min(w - 16, x(now - ago)), h - 3);
    g.save(); g.beginPath(); g.rect(left, 0, w - left, bottom + 2); g.clip();
    this.colours.forEach((colour, k) => {
      g.strokeStyle = colour; g.lineWidth = 1.75; g.lineJoin = "round"; g.beginPath();
      rows.forEach((row, i) => { if (i) g.lineTo(x(row[0]), y(row[k + 1])); else g.moveTo(x(row[0]), y(row[k + 1])); });
      g.stroke();
    });
    g.restore();
  }
}

class LegTable {
  constructor(root, facts) {
    this.facts = facts;
    this.legs = facts.legs.map((leg, l) => {
      const box = document.createElement("div");
      box.className = "leg"; box.style.setProperty("--leg", leg.colour);
      box.innerHTML = `<h3><i></i>${leg.words}</h3>` + facts.joints.map((name) =>
        `<div class="joint"><span>${name}</span><b></b><em></em><div class="track"><i></i></div></div>`).join("");
      box.dataset.leg = leg.name;
      root.append(box);
      return { dot: box.querySelector("h3 i"), rows: [...box.querySelectorAll(".joint")].map((row) => ({
        row, value: row.querySelector("b"), heat: row.querySelector("em"), mark: row.querySelector(".track i"),
      })) };
    });
  }
  show(state) {
    const { lower, upper } = this.facts;
    this.legs.forEach(({ dot, rows }, l) => {
      dot.className = !state.contactValid[l] ? "unknown" : state.contact[l] ? "on" : "";
      rows.forEach(({ row, value, heat, mark }, j) => {
        const i = 4 * l + j, angle = state.joints[i], warm = state.temperatures[i];
        row.classList.toggle("lost", !state.jointValid[i]);
        value.textContent = angle === null ? "–" : degrees(angle);
        heat.textContent = warm === null ? "" : `${warm.toFixed(0)} °C`;
        heat.className = warm >= 65 ? "bad" : warm >= 60 ? "warn" : "";
        const share = angle === null ? 0.5 : (angle - lower[i]) / (upper[i] - lower[i]);
        mark.style.left = `${(100 * Math.max(0, Math.min(1, share))).toFixed(1)}%`;
      });
    });
  }
}

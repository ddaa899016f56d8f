"use strict";
// What the operator does, as words to the station. Sticks are a dead man's handle: what is held is
// said again and again; released, hidden, out of focus or disconnected means zero.

class Controls {
  constructor(root, say) {
    this.root = root; this.say = say;
    this.pad = { x: 0, y: 0 }; this.sideways = 0; this.keys = new Set(); this.zeros = 0;
    this.travel = 0.6;
    const role = this.role = (name) => root.querySelector(`[data-role="${name}"]`);
    for (const button of root.querySelectorAll("[data-order]")) button.onclick = () => this.order(button.dataset.order);
    for (const button of root.querySelectorAll("[data-gait]")) button.onclick = () => say({ gait: button.dataset.gait });
    this.trunk = [...root.querySelectorAll("[data-trunk]")];
    for (const slider of this.trunk) slider.oninput = () => this.tilt();
    role("level").onclick = (event) => { event.preventDefault(); for (const slider of this.trunk) slider.value = 0; this.tilt(); };
    role("speed").oninput = (event) => { this.travel = event.target.value / 100; role("travel").textContent = `${event.target.value} %`; };
    this.wirePad(role("pad"), role("knob"));
    this.wireSideways(role("sideways"));
    this.wireKeys();
    for (const name of ["blur", "pagehide"]) window.addEventListener(name, () => this.release());
    document.addEventListener("visibilitychange", () => { if (document.hidden) this.release(); });
    setInterval(() => this.tell(), 50);
    // On a small screen STOP stays in reach when its button has scrolled away.
    const [stop, near] = root.querySelectorAll(".stop");
    new IntersectionObserver(([seen]) => { near.hidden = seen.isIntersecting; }).observe(stop);
  }
  order(name) { this.release(); this.say({ order: name }); }
  tilt() { this.say({ trunk: this.trunk.map((slider) => slider.value / 100) }); }
  sticks() {
    const held = (...names) => names.some((name) => this.keys.has(name)) ? 1 : 0;
    const forward = this.pad.y + held("w", "arrowup") - held("s", "arrowdown");
    const left = this.sideways + held("a") - held("d");
    const turn = this.pad.x + held("q", "arrowleft") - held("e", "arrowright");
    return [forward, left, turn].map((value) => this.travel * Math.max(-1, Math.min(1, value)));
  }
  tell() {
    const sticks = this.sticks(), moving = sticks.some(Boolean);
    // A few zeros, should one of them be lost; after that silence, so that other sources may drive.
    this.zeros = moving ? 3 : Math.max(0, this.zeros - 1);
    if (moving || this.zeros) this.say({ sticks });
  }
  release() {
    this.pad = { x: 0, y: 0 }; this.sideways = 0; this.keys.clear();
    this.role("sideways").value = 0;
    this.knob();
    this.say({ sticks: [0, 0, 0] });
  }
  knob() {
    const knob = this.role("knob"), reach = 58;
    knob.style.transform = `translate(${-this.pad.x * reach}px, ${-this.pad.y * reach}px)`;
  }
  wirePad(pad) {
    const move = (event) => {
      const box = pad.getBoundingClientRect(), reach = 58;
      let x = (event.clientX - box.left - box.width / 2) / reach, y = (event.clientY - box.top - box.height / 2) / reach;
      const size = Math.max(1, Math.hypot(x, y));
      const soft = (value) => Math.abs(value) < 0.08 ? 0 : value;
      this.pad = { x: soft(-x / size), y: soft(-y / size) };
      this.knob();
    };
    pad.onpointerdown = (event) => { pad.setPointerCapture(event.pointerId); pad.classList.add("held"); move(event); };
    pad.onpointermove = (event) => { if (pad.classList.contains("held")) move(event); };
    const drop = () => { pad.classList.remove("held"); this.release(); };
    pad.onpointerup = pad.onpointercancel = pad.onlostpointercapture = drop;
  }
  wireSideways(slider) {
    slider.oninput = () => { this.sideways = -slider.value / 100; };
    slider.onpointerup = slider.onpointercancel = slider.onchange = () => { if (this.sideways) this.release(); };
  }
  wireKeys() {
    const drive = new Set(["w", "a", "s", "d", "q", "e", "arrowup", "arrowdown", "arrowleft", "arrowright"]);
    window.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const key = event.key.toLowerCase();
      if (key === "escape") { this.order("stop"); event.preventDefault(); return; }
      if (key === " ") { this.order("halt"); event.preventDefault(); return; }
      if (!drive.has(key) || (key.startsWith("arrow") && event.target.type === "range")) return;
      this.keys.add(key); event.preventDefault();
    });
    window.addEventListener("keyup", (event) => { if (this.keys.delete(event.key.toLowerCase()) && !this.keys.size) this.release(); });
  }
}

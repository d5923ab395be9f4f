// Title, time, a body to follow, and what is under the pointer, over viser's page.
"use strict";
(() => {
  const told = window.MSTMM;
  const floats = (text) => new Float32Array(
    Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const times = floats(told.times);
  for (const one of Object.values(told.owners)) one.values = floats(one.values);
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  window.__VISER_EMBED_CONFIG__ = { darkMode: dark };

  const make = (tag, style, parent, text) => {
    const one = document.createElement(tag);
    one.style.cssText = style;
    if (text) one.textContent = text;
    parent.append(one);
    return one;
  };
  const number = (x, digits) => Number.isFinite(x) ? String(+x.toPrecision(digits)) : "none";

  function panel() {
    const ink = dark ? "#e6e8eb" : "#1b1f24", ground = dark ? "#1c1f24e0" : "#ffffffe0";
    const look = `font:13px/1.45 system-ui,sans-serif;color:${ink};background:${ground};` +
      "border-radius:6px;padding:.45em .7em;box-shadow:0 1px 6px #0003;";
    const box = make("div", `position:fixed;left:.7em;bottom:4em;z-index:5;max-width:70vw;${look}`,
      document.body);
    box.id = "mstmm";
    make("b", "", box, told.title);
    const clock = make("div", "font-variant-numeric:tabular-nums", box);
    for (const note of told.notes) make("div", "opacity:.75", box, note);
    const row = make("label", "display:block", box, "follow ");
    const pick = make("select", "font:inherit;color:inherit;background:transparent;" +
      "border:1px solid #8886;border-radius:4px;max-width:14em", row);
    make("option", `color:${ink};background:${ground}`, pick, "nothing").value = "";
    for (const [owner, one] of Object.entries(told.owners))
      if (owner.startsWith("/bodies/"))
        make("option", `color:${ink};background:${ground}`, pick, one.name).value = owner;
    const tip = make("div", `position:fixed;z-index:6;pointer-events:none;display:none;${look}` +
      "white-space:pre;font-variant-numeric:tabular-nums", document.body);
    return { clock, pick, tip };
  }

  function place(view, owner) {
    const node = view.nodeRefFromName[owner];
    if (!node || !view.camera) return null;
    const Vector = view.camera.position.constructor;
    return node.localToWorld(new Vector(...told.owners[owner].anchor));
  }

  function under(view, pointer) {
    const frame = view.canvas.getBoundingClientRect();
    let best = null, least = 22;
    for (const owner of Object.keys(told.owners)) {
      const at = place(view, owner);
      if (!at) continue;
      at.project(view.camera);
      if (at.z > 1) continue;
      const x = frame.left + (at.x + 1) / 2 * frame.width;
      const y = frame.top + (1 - at.y) / 2 * frame.height;
      const away = Math.hypot(x - pointer.x, y - pointer.y);
      if (away < least) { best = owner; least = away; }
    }
    return best;
  }

  function words(owner, moment) {
    const one = told.owners[owner], width = one.labels.length;
    const values = one.labels.map(([label, unit], i) =>
      `${label} = ${number(one.values[moment * width + i], 4)} ${unit}`);
    return [one.name, ...one.text, ...values].join("\n");
  }

  // The first look fits a screen that is wider than tall; on others it is from further away.
  const SETTLED = 12, WIDE = 1.3;  // pictures after which viser has set its camera
  function fit(view) {
    const narrow = WIDE * innerHeight / innerWidth;
    if (narrow > 1) view.cameraControl.dollyTo(view.cameraControl.distance * narrow, false);
    view.requestRender();
  }

  function start() {
    const { clock, pick, tip } = panel();
    const pointer = { x: -1e6, y: -1e6 };
    addEventListener("pointermove", (e) => { pointer.x = e.clientX; pointer.y = e.clientY; });
    const rate = told.speed === 1 ? "" : `, ${number(told.speed, 3)} s in a second`;
    let last = null, ticks = 0;
    const tick = () => {
      requestAnimationFrame(tick);
      const view = window.__viserMutable;
      if (!view || !view.nodePoseData || !view.canvas || !view.cameraControl) return;
      if (view.nodePoseData["/clock"] && ++ticks === SETTLED) fit(view);
      const pose = view.nodePoseData["/clock"];
      const moment = Math.min(times.length - 1, Math.round(pose ? pose.position[0] : 0));
      clock.textContent = times.length > 1 ? `t = ${times[moment].toFixed(told.digits)} s${rate}` :
        `t = ${number(times[0], 6)} s`;
      const at = pick.value ? place(view, pick.value) : null;
      if (at && last) {
        const aim = view.cameraControl.getTarget(at.clone());
        aim.add(at).sub(last);
        view.cameraControl.moveTo(aim.x, aim.y, aim.z, false);
        view.requestRender();
      }
      last = at;
      const owner = under(view, pointer);
      tip.style.display = owner ? "block" : "none";
      if (owner) {
        tip.textContent = words(owner, moment);
        tip.style.left = `${Math.min(pointer.x + 14, innerWidth - tip.offsetWidth - 8)}px`;
        tip.style.top = `${Math.min(pointer.y + 14, innerHeight - tip.offsetHeight - 60)}px`;
      }
    };
    tick();
  }

  if (document.body) start(); else addEventListener("DOMContentLoaded", start);
})();

// Title, time, a body to follow, and what is under the pointer, over viser's page.
"use strict";
(() => {
  const told = window.MSTMM;
  const floats = (text) => new Float32Array(
    Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const times = floats(told.times);
  for (const one of Object.values(told.owners)) one.values = floats(one.values);
  const within = window.frameElement;  // a page around this one may be light alone
  const dark = !(within && within.dataset.theme === "light") &&
    matchMedia("(prefers-color-scheme: dark)").matches;
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
    const list = (label, entries) => {
      const row = make("label", "display:block", box, `${label} `);
      const one = make("select", "font:inherit;color:inherit;background:transparent;" +
        "border:1px solid #8886;border-radius:4px;max-width:16em", row);
      for (const [text, value] of entries)
        make("option", `color:${ink};background:${ground}`, one, text).value = value;
      return one;
    };
    const choice = told.choices.length ?
      list("show", told.choices.map((name) => [name, `/${name}`])) : null;
    const bodies = Object.entries(told.owners).filter(([owner]) =>
      owner.startsWith(`${told.choices.length ? `/${told.choices[0]}` : ""}/bodies/`));
    const pick = list("follow", [["nothing", ""],
      ...bodies.map(([owner, one]) => [one.name, owner.slice(owner.indexOf("/bodies/"))])]);
    const tip = make("div", `position:fixed;z-index:6;pointer-events:none;display:none;${look}` +
      "white-space:pre;font-variant-numeric:tabular-nums", document.body);
    return { clock, choice, pick, tip };
  }

  function place(view, owner) {
    const node = view.nodeRefFromName[owner];
    if (!node || !view.camera) return null;
    const Vector = view.camera.position.constructor;
    return node.localToWorld(new Vector(...told.owners[owner].anchor));
  }

  // What is not chosen is far away; the recording puts it there, and back, whenever it begins anew.
  function show(view, chosen) {
    for (const name of told.choices) {
      const pose = view.nodePoseData[`/${name}`], x = `/${name}` === chosen ? 0 : told.away;
      if (!pose || pose.position[0] === x) continue;
      pose.position = [x, 0, 0];
      pose.poseUpdateState = "needsUpdate";
      view.requestRender();
    }
  }

  function under(view, pointer, root) {
    const frame = view.canvas.getBoundingClientRect();
    let best = null, least = 22;
    for (const owner of Object.keys(told.owners)) {
      if (!owner.startsWith(`${root}/`)) continue;
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
    const { clock, choice, pick, tip } = panel();
    const pointer = { x: -1e6, y: -1e6 };
    addEventListener("pointermove", (e) => { pointer.x = e.clientX; pointer.y = e.clientY; });
    const [what, unit] = told.clock, digits = unit === "s" ? told.digits : 0;
    const rate = told.speed === 1 || unit !== "s" ? "" : `, speed ${number(told.speed, 3)}`;
    let last = null, ticks = 0;
    const tick = () => {
      requestAnimationFrame(tick);
      const view = window.__viserMutable;
      if (!view || !view.nodePoseData || !view.canvas || !view.cameraControl) return;
      if (view.nodePoseData["/clock"] && ++ticks === SETTLED) fit(view);
      const pose = view.nodePoseData["/clock"];
      const moment = Math.min(times.length - 1, Math.round(pose ? pose.position[0] : 0));
      clock.textContent = times.length > 1 ?
        `${what} = ${times[moment].toFixed(digits)} ${unit}${rate}` :
        `${what} = ${number(times[0], 6)} ${unit}`;
      const root = choice ? choice.value : "";
      show(view, root);
      const at = pick.value ? place(view, root + pick.value) : null;
      if (at && last) {
        const aim = view.cameraControl.getTarget(at.clone());
        aim.add(at).sub(last);
        view.cameraControl.moveTo(aim.x, aim.y, aim.z, false);
        view.requestRender();
      }
      last = at;
      const owner = under(view, pointer, root);
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

// SPDX-License-Identifier: Apache-2.0
"use strict";

const byId = (id) => document.getElementById(id);

// The scene of a step on a canvas of WebGL.
class Stage {
  static LIGHT = [0.35, -0.55, 1.25]; // seen from azimuth -60

  constructor(canvas, recording) {
    this.recording = recording;
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    this.renderer.outputEncoding = THREE.sRGBEncoding;
    this.renderer.setClearColor(recording.colours.background);
    this.renderer.setPixelRatio(devicePixelRatio);
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    this.scene = new THREE.Scene();
    this.surfaces = new Surfaces(recording);
    this.contacts = new Contacts(recording);
    this.curves = new Curves(recording);
    const { group: curves, arrows } = this.curves;
    this.scene.add(this.surfaces.group, this.contacts.group, curves, arrows, ...this.lights(recording.view.azimuth));
    this.camera = new OrbitCamera(canvas, recording.view.azimuth, recording.view.elevation, () => this.later());
    this.tint = true;
    this.waiting = false;
  }

  lights(azimuth) {
    const sky = new THREE.HemisphereLight(0xeef5ff, 0x55585f, 0.5);
    sky.position.set(0, 0, 1);
    const sun = new THREE.DirectionalLight(0xfff8ec, 0.85);
    sun.position.set(...Stage.LIGHT).applyAxisAngle(new THREE.Vector3(0, 0, 1), ((azimuth + 60) * Math.PI) / 180);
    sun.position.setLength(4);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    Object.assign(sun.shadow.camera, { left: -1.8, right: 1.8, bottom: -1.8, top: 1.8, near: 1, far: 7 });
    sun.shadow.normalBias = 0.012;
    sun.shadow.bias = -0.0005;
    return [sky, sun];
  }

  show(step) {
    this.step = step;
    this.surfaces.show(step, this.tint);
    this.contacts.show(step);
    this.curves.show(step);
    if (this.reach && !this.camera.touched && this.widen(step)) this.camera.frame(this.reach);
    this.later();
  }

  // Draw once before the next picture of the screen, however often this is asked for.
  later() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.draw(); });
  }

  draw() {
    this.camera.update();
    this.renderer.render(this.scene, this.camera.three);
    this.drawn?.();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    this.renderer.setSize(width, height, false);
    this.curves.resize(width, height);
    this.camera.three.aspect = width / Math.max(height, 1);
    if (this.framed && !this.camera.touched) this.fit(this.framed);
    this.draw();
  }

  // Frame the meshes that are shown, at these steps; and from then on at others, too, unless the view is moved by hand.
  fit(steps) {
    this.framed = steps;
    this.camera.touched = false;
    this.reach = null;
    for (const step of steps) this.widen(step);
    if (this.reach) this.camera.frame(this.reach);
  }

  // True where the view has to be wider for this step. Planes extend beyond it.
  widen(step) {
    const { recording } = this, before = this.reach;
    for (const [mesh, visible] of this.surfaces.visible.entries()) {
      const shown = visible && recording.shown(mesh, step);
      if (!shown || !shown.topology.vertices || recording.meshes[mesh].plane) continue;
      const start = shown.frame * shown.topology.vertices;
      const places = new Float32Array(3 * shown.topology.vertices);
      recording.place(recording.meshes[mesh], shown.topology.positions, start, start + shown.topology.vertices, places);
      const reach = this.camera.reach(places);
      for (const side of Object.keys(this.reach ?? {})) reach[side] = Math.max(reach[side], this.reach[side]);
      this.reach = reach;
    }
    return Boolean(before) && Object.keys(before).some((side) => this.reach[side] > before[side] + 1e-6);
  }

  contactAt(x, y) {
    if (!this.contacts.group.visible) return null;
    return this.contacts.at(x, y, this.camera.three, this.canvas.clientWidth, this.canvas.clientHeight);
  }

  // Outline both sides of a contact, or of none.
  point(contact) {
    const places = contact && [0, 1].map((side) => this.corners(contact, side));
    this.contacts.point(places);
    this.later();
  }

  corners(contact, side) {
    const shown = this.recording.shown(contact.meshes[side], this.step);
    const grid = this.recording.meshes[contact.meshes[side]];
    return this.surfaces.vertices(contact, side, this.step).flatMap((vertex) => {
      const at = shown.frame * shown.topology.vertices + vertex, place = [0, 0, 0];
      this.recording.place(grid, shown.topology.positions, at, at + 1, place);
      return place;
    });
  }
}

// The page around it: what is said, and what is pressed.
class Viewer {
  static FITTED = 6; // steps that the first view frames
  static LISTED = 4; // depths beside the scene

  constructor(recording) {
    this.recording = recording;
    this.playing = null;
    document.title = `${recording.title} · hpccd`;
    byId("name").textContent = recording.title;
    try {
      this.stage = new Stage(byId("scene"), recording);
    } catch (error) {
      halt(`WebGL: not available in this browser (${error.message}); only the chart is drawn.`);
    }
    this.chart = new Chart(byId("chart"), recording, (step) => this.choose(step));
    this.times = new Times(byId("times"), recording);
    this.listMeshes();
    for (const kind of ["intersecting", "curves", "depth"]) {
      document.querySelector(`#${kind} .swatch`).style.background = recording.colours[kind];
    }
    this.writeNotes();
    this.bindControls();
    this.worst = recording.steps.reduce((best, step, i, all) => (worse(step, all[best]) ? i : best), 0);
    byId("intersecting").append(recording.intersectingFacesAre);
    this.show(this.worst);
    if (this.stage) {
      this.stage.resize();
      this.stage.fit(this.busy());
      this.stage.drawn = () => this.follow();
      this.stage.draw();
      this.bindPointer();
      new ResizeObserver(() => this.stage.resize()).observe(byId("view"));
    }
    new ResizeObserver(() => { this.chart.draw(); this.times.show(this.step); }).observe(byId("chart"));
  }

  // Some of those steps in which most happens.
  busy() {
    const totals = this.recording.steps.map((step) => step.total ?? 0), most = totals[this.worst];
    const busy = [...totals.keys()].filter((step) => totals[step] >= 0.5 * most);
    const even = Array.from({ length: Viewer.FITTED }, (_, i) => busy[Math.floor((i * (busy.length - 1)) / (Viewer.FITTED - 1))]);
    return [...new Set([this.worst, ...even])];
  }

  show(step) {
    this.step = step;
    const { steps } = this.recording;
    const { step: number, where, total, facts, notices, time } = steps[step];
    const what = total === null ? "No contacts known" : `${total.toLocaleString("en")} contact${total === 1 ? "" : "s"}`;
    byId("title").textContent = `${what} in ${where ?? `step ${number} of ${steps.at(-1).step}`}`;
    // Lines break between facts only.
    byId("facts").textContent = facts.map((fact) => fact.replaceAll(" ", "\u00a0")).join("  ·  ") || "\u00a0";
    const calm = total === 0 ? ["No contacts in this step."] : [];
    byId("notices").replaceChildren(...notices.map((text) => item(text)), ...calm.map((text) => item(text, "calm")));
    byId("slider").value = step;
    byId("place").textContent = `${step + 1} of ${steps.length}${time === null ? "" : `, ${time.toFixed(3)} s`}`;
    for (const id of ["first", "back"]) byId(id).disabled = step === 0;
    for (const id of ["forward", "last"]) byId(id).disabled = step === steps.length - 1;
    byId("intersecting").hidden = !steps[step].intersecting.some(Boolean);
    byId("curves").hidden = !steps[step].curves[0];
    this.listDepths(steps[step].depths);
    this.forget();
    this.stage?.show(step);
    this.chart.show(step);
    this.times.show(step);
    document.body.dataset.step = number; // of the step that is shown, for programs
  }

  choose(step) {
    this.pause();
    this.show(Math.max(0, Math.min(this.recording.steps.length - 1, step)));
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  play() {
    const last = this.recording.steps.length - 1;
    if (!last) return;
    if (this.step === last) this.show(0);
    byId("play").textContent = "pause";
    let due = performance.now();
    const next = (now) => {
      const pace = 1000 / Number(byId("speed").value);
      if (now - due >= pace) {
        due = Math.max(due + pace, now - pace);
        this.show(this.step + 1);
      }
      if (this.step >= last) this.pause();
      else this.playing = requestAnimationFrame(next);
    };
    this.playing = requestAnimationFrame(next);
  }

  pause() {
    cancelAnimationFrame(this.playing);
    this.playing = null;
    byId("play").textContent = "play";
  }

  bindControls() {
    const last = this.recording.steps.length - 1;
    const actions = {
      play: () => this.toggle(), back: () => this.choose(this.step - 1), forward: () => this.choose(this.step + 1),
      first: () => this.choose(0), last: () => this.choose(last), fit: () => this.stage?.fit([this.step]),
    };
    for (const [id, action] of Object.entries(actions)) {
      byId(id).addEventListener("click", (event) => {
        if (event.detail) event.currentTarget.blur(); // pressed by a pointer: keys go on to the page
        action();
      });
    }
    byId("slider").max = last;
    byId("play").disabled = last === 0;
    byId("slider").addEventListener("input", (event) => this.choose(Number(event.target.value)));
    byId("show-contacts").addEventListener("change", (event) => {
      if (this.stage) this.stage.contacts.group.visible = event.target.checked;
      this.redraw();
    });
    byId("show-tint").addEventListener("change", (event) => {
      if (this.stage) this.stage.tint = event.target.checked;
      this.redraw();
    });
    byId("show-intersecting").addEventListener("change", (event) => {
      if (this.stage) this.stage.surfaces.withMarks = event.target.checked;
      this.redraw();
    });
    byId("show-curves").addEventListener("change", (event) => {
      if (this.stage) this.stage.curves.group.visible = event.target.checked;
      this.redraw();
    });
    byId("show-depth").addEventListener("change", (event) => {
      if (this.stage) this.stage.curves.arrows.visible = event.target.checked;
      this.redraw();
    });
    byId("show-edges").addEventListener("change", (event) => {
      if (this.stage) this.stage.surfaces.withEdges = event.target.checked;
      this.redraw();
    });
    const keys = {
      " ": actions.play, ArrowLeft: actions.back, ArrowRight: actions.forward, Home: actions.first, End: actions.last,
      PageUp: () => this.choose(this.step - 10), PageDown: () => this.choose(this.step + 10), f: actions.fit, F: actions.fit,
    };
    window.addEventListener("keydown", (event) => {
      const pressed = event.target.closest?.("button, select, summary, input[type=checkbox]");
      if (!keys[event.key] || event.ctrlKey || event.altKey || event.metaKey) return;
      if (pressed && (event.key === " " || pressed.tagName === "SELECT")) return;
      event.preventDefault();
      keys[event.key]();
    });
  }

  // An entry for each mesh, and for all links of a robot together.
  listMeshes() {
    const { meshes, steps } = this.recording, groups = new Map();
    meshes.forEach((mesh, number) => groups.set(mesh.group, [...(groups.get(mesh.group) ?? []), number]));
    byId("meshes").replaceChildren(...[...groups].map(([group, numbers]) => {
      const label = document.createElement("label"), box = document.createElement("input");
      const first = meshes[numbers[0]];
      Object.assign(box, { type: "checkbox", checked: !first.hidden });
      box.addEventListener("change", () => {
        for (const number of numbers) if (this.stage) this.stage.surfaces.visible[number] = box.checked;
        this.redraw();
      });
      const swatch = element("span", "", "swatch");
      swatch.style.background = first.colour;
      const triangles = numbers.reduce((sum, number) => sum + (meshes[number].topologies.at(-1)?.faces ?? 0), 0);
      const size = numbers.length === 1 ? sizeOf(first, steps.length)
        : `${numbers.length} links, ${triangles.toLocaleString("en")} triangles`;
      label.append(box, swatch, element("span", group, "of"), element("small", size));
      const entry = document.createElement("li");
      entry.append(label);
      return entry;
    }));
  }

  // The largest first.
  listDepths(depths) {
    const names = this.recording.meshes.map((mesh) => mesh.name);
    const largest = [...depths].sort((a, b) => Number(b[2]) - Number(a[2])), listed = largest.slice(0, Viewer.LISTED);
    const lines = listed.map(([a, b, length]) => item(`${names[a]} out of ${names[b]}: ${length}`));
    const others = depths.length - listed.length;
    byId("depth").hidden = !depths.length;
    byId("depths").replaceChildren(...lines, ...(others ? [item(`${others} more`)] : []));
  }

  writeNotes() {
    const { notes, meshes, contacts, library } = this.recording;
    const rounded = meshes.filter((mesh) => mesh.topologies.length)
      .map((mesh) => `${mesh.name}: ${short(mesh.step)}`).join(", ");
    byId("notes").replaceChildren(...[
      ...notes,
      this.recording.origin,
      `Positions are rounded to multiples of these lengths, in the unit of the scene: `
      + `${rounded}; points of contacts: ${short(contacts.step)}. Times of impact are rounded to 1/${contacts.times}.`,
      `Drawn with three.js r${library.revision}, bundled with ${library.source}. This file uses no network.`,
    ].map((text) => item(text)));
    const warnings = notes.length;
    if (warnings) document.querySelector("aside > details").open = true;
  }

  redraw() {
    this.forget();
    this.stage?.show(this.step);
  }

  bindPointer() {
    const canvas = byId("scene");
    canvas.addEventListener("pointermove", (event) => {
      this.pointer = { x: event.offsetX, y: event.offsetY };
      if (this.stage.camera.moving) this.forget();
      else this.hover();
    });
    canvas.addEventListener("pointerleave", () => { this.pointer = null; this.forget(); });
  }

  hover() {
    const found = this.pointer && this.stage.contactAt(this.pointer.x, this.pointer.y);
    if (!found) { this.forget(); return; }
    if (this.hovered === found.index) return;
    this.hovered = found.index;
    const contact = this.recording.contact(this.step, found.index);
    this.stage.point(contact);
    const tip = byId("tip");
    tip.textContent = this.describe(contact);
    tip.hidden = false;
    this.follow();
  }

  forget() {
    if (this.hovered === undefined) return;
    this.hovered = undefined;
    byId("tip").hidden = true;
    byId("ring").style.visibility = "hidden";
    this.stage?.point(null);
  }

  // Keep the mark on the contact that is pointed to.
  follow() {
    if (this.hovered === undefined) return;
    const found = this.stage.contactAt(this.pointer.x, this.pointer.y);
    if (!found || found.index !== this.hovered) { this.forget(); return; }
    const ring = byId("ring"), tip = byId("tip"), view = byId("view");
    ring.setAttribute("cx", found.x);
    ring.setAttribute("cy", found.y);
    ring.style.visibility = "visible";
    const left = found.x + 18 + tip.offsetWidth < view.clientWidth ? found.x + 18 : found.x - 18 - tip.offsetWidth;
    const top = Math.min(Math.max(found.y - tip.offsetHeight / 2, 4), view.clientHeight - tip.offsetHeight - 4);
    tip.style.left = `${Math.max(left, 4)}px`;
    tip.style.top = `${top}px`;
  }

  describe({ vf, meshes, features, toc, point }) {
    const [a, b] = meshes.map((mesh) => this.recording.meshes[mesh].name);
    const side = (mesh, first, second) => (first === NO_VERTEX ? `plane ${mesh}`
      : second === NO_VERTEX ? `vertex ${mesh}:${first}` : `edge ${mesh}:${first}-${second}`);
    const pair = vf ? `vertex ${a}:${features[0]} – face ${b}:${features[2]}`
      : `${side(a, features[0], features[1])} – ${side(b, features[2], features[3])}`;
    const digits = Math.min(20, Math.max(0, Math.ceil(-Math.log10(this.recording.contacts.step))));
    const place = point.map((value) => (Math.abs(value) < 1e9 ? value.toFixed(digits) : value.toPrecision(6)));
    return `${pair}\nt = ${toc.toFixed(4)} of the step\nat ${place.join(", ")}`;
  }
}

function sizeOf(mesh, steps) {
  if (mesh.plane) return mesh.topologies.length ? "plane" : "plane, far away";
  if (!mesh.topologies.length) return "no frames";
  const last = mesh.topologies.at(-1), versions = mesh.topologies.length;
  const count = (kind) => last[kind].toLocaleString("en");
  const faces = last.faces ? `${count("faces")} triangles` : "", edges = last.edges ? `${count("edges")} edges` : "";
  const what = [faces, edges].filter(Boolean).join(", ") || `${count("vertices")} points, no faces`;
  const moves = steps === 1 || versions > 1 || last.frames > 1 ? "" : ", at rest";
  return what + moves + (versions > 1 ? `, ${versions} topologies` : "");
}

const short = (value) => String(Number(value.toPrecision(2)));

// Whether a step has more contacts than another one, or as many and more faces that intersect.
function worse(step, other) {
  const faces = (of) => of.intersecting.reduce((sum, count) => sum + count, 0);
  const more = (step.total ?? -1) - (other.total ?? -1);
  return more > 0 || (more === 0 && faces(step) > faces(other));
}

function element(tag, text, name = "") {
  const made = document.createElement(tag);
  made.textContent = text;
  made.className = name;
  return made;
}

const item = (text, name) => element("li", text, name);

function halt(text) {
  byId("halt").textContent = text;
}

async function start() {
  if (typeof DecompressionStream === "undefined") {
    byId("title").textContent = "Not shown";
    halt("This browser is too old for this page: it needs DecompressionStream (Chrome 92, Firefox 113, Safari 16.4).");
    return;
  }
  const recording = new Recording(JSON.parse(byId("content").textContent));
  await recording.unpack();
  new Viewer(recording);
  document.body.dataset.ready = "yes";
}

start().catch((error) => {
  byId("title").textContent = "Not shown";
  halt(`This page cannot be shown: ${error.message}`);
  throw error;
});

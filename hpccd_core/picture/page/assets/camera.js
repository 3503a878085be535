// SPDX-License-Identifier: Apache-2.0
"use strict";

// A camera around a target, z up, moved by pointer and wheel. `changed` is called when it has moved; `touched`: by hand.
class OrbitCamera {
  static FIELD_OF_VIEW = 24; // degrees, vertical; small ones flatten
  static MARGIN = 1.05;

  constructor(canvas, azimuth, elevation, changed) {
    this.three = new THREE.PerspectiveCamera(OrbitCamera.FIELD_OF_VIEW);
    this.three.up.set(0, 0, 1);
    this.target = new THREE.Vector3();
    this.distance = 4;
    this.azimuth = (azimuth * Math.PI) / 180;
    this.elevation = (elevation * Math.PI) / 180;
    this.canvas = canvas;
    this.changed = changed;
    this.touched = false;
    this.pointers = new Map();
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.moved(event));
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => this.pointers.delete(event.pointerId));
    }
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(Math.max(-120, Math.min(120, event.deltaY)) * 0.0015));
    }, { passive: false });
  }

  get moving() { return this.pointers.size > 0; }

  axes() {
    const a = this.azimuth, e = this.elevation;
    const backward = new THREE.Vector3(Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e));
    const right = new THREE.Vector3(-Math.sin(a), Math.cos(a), 0);
    return { right, up: new THREE.Vector3().crossVectors(backward, right), backward };
  }

  update() {
    const { backward } = this.axes();
    this.three.position.copy(this.target).addScaledVector(backward, this.distance);
    this.three.lookAt(this.target);
    // The scene lies in a ball of radius sqrt(3) around the origin.
    const away = this.three.position.length();
    this.three.near = Math.max(away - 2, 1e-3 * this.distance);
    this.three.far = away + 2;
    this.three.updateProjectionMatrix();
    this.three.updateMatrixWorld();
  }

  // How far places, flat x y z, reach towards each side of the view, and along it.
  reach(places) {
    const { right, up, backward } = this.axes(), { tall, wide } = this.slopes();
    const most = { right: -Infinity, left: -Infinity, top: -Infinity, bottom: -Infinity, front: -Infinity, back: -Infinity };
    const place = new THREE.Vector3();
    for (let i = 0; i < places.length; i += 3) {
      place.fromArray(places, i);
      const x = place.dot(right), y = place.dot(up), z = place.dot(backward);
      most.right = Math.max(most.right, x + wide * z);
      most.left = Math.max(most.left, wide * z - x);
      most.top = Math.max(most.top, y + tall * z);
      most.bottom = Math.max(most.bottom, tall * z - y);
      most.front = Math.max(most.front, z);
      most.back = Math.max(most.back, -z);
    }
    return most;
  }

  slopes() {
    const tall = Math.tan((OrbitCamera.FIELD_OF_VIEW * Math.PI) / 360) / OrbitCamera.MARGIN;
    return { tall, wide: tall * this.three.aspect };
  }

  // The closest distance from which everything within that reach stays in view: it must lie between the side planes.
  frame(most) {
    if (most.front === -Infinity) return;
    const { right, up, backward } = this.axes(), { tall, wide } = this.slopes();
    const eye = Math.max((most.right + most.left) / (2 * wide), (most.top + most.bottom) / (2 * tall), most.front + 1e-3);
    const middle = 0.5 * (most.front - most.back);
    this.distance = eye - middle;
    this.target.set(0, 0, 0).addScaledVector(right, 0.5 * (most.right - most.left))
      .addScaledVector(up, 0.5 * (most.top - most.bottom)).addScaledVector(backward, middle);
    this.changed();
  }

  zoom(factor) {
    this.touched = true;
    this.distance = Math.min(100, Math.max(1e-3, this.distance * factor));
    this.changed();
  }

  pan(dx, dy) {
    this.touched = true;
    const { right, up } = this.axes();
    const size = (2 * this.distance * Math.tan((OrbitCamera.FIELD_OF_VIEW * Math.PI) / 360)) / this.canvas.clientHeight;
    this.target.addScaledVector(right, -dx * size).addScaledVector(up, dy * size);
    this.changed();
  }

  turn(dx, dy) {
    this.touched = true;
    this.azimuth -= dx * 0.007;
    this.elevation = Math.max(-1.55, Math.min(1.55, this.elevation + dy * 0.007));
    this.changed();
  }

  down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, pan: event.button !== 0 || event.shiftKey });
  }

  moved(event) {
    const pointer = this.pointers.get(event.pointerId);
    if (!pointer) return;
    const dx = event.clientX - pointer.x, dy = event.clientY - pointer.y;
    const apart = this.spread();
    Object.assign(pointer, { x: event.clientX, y: event.clientY });
    if (this.pointers.size === 2) {
      this.zoom(apart / (this.spread() || 1));
      this.pan(dx / 2, dy / 2);
    } else if (pointer.pan) this.pan(dx, dy);
    else this.turn(dx, dy);
  }

  // Between two fingers.
  spread() {
    if (this.pointers.size !== 2) return 1;
    const [a, b] = [...this.pointers.values()];
    return Math.hypot(a.x - b.x, a.y - b.y) || 1;
  }
}

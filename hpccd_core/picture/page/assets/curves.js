// SPDX-License-Identifier: Apache-2.0
"use strict";

// The intersection curves of a step, faint where a surface is in front of them; and an arrow for each pair of meshes
// that has a depth, in front of everything, as most begin inside a mesh.
class Curves {
  constructor(recording) {
    this.recording = recording;
    this.screen = { value: new THREE.Vector2(1, 1) };
    this.group = new THREE.Group();
    this.arrows = new THREE.Group();
    const { colours } = recording;
    const lines = new THREE.BufferGeometry(), arrows = new THREE.BufferGeometry(), border = new THREE.BufferGeometry();
    this.add(this.group, lines, Ribbons.material(this.screen, colours.curves, 0.35, false), 1);
    this.add(this.group, lines, Ribbons.material(this.screen, colours.curves, 1, true), 2);
    this.add(this.arrows, border, Ribbons.material(this.screen, colours.background, 1, false), 3);
    this.add(this.arrows, arrows, Ribbons.material(this.screen, colours.depth, 1, false), 4);
  }

  add(group, geometry, material, order) {
    const object = new THREE.Mesh(geometry, material);
    object.frustumCulled = false;
    object.renderOrder = order;
    group.add(object);
  }

  resize(width, height) {
    this.screen.value.set(0.5 * width, 0.5 * height);
  }

  show(step) {
    const { lines, depths } = this.recording.curvesOf(step);
    const curves = new Ribbons(), arrows = [1.5, 0].map(() => new Ribbons());
    for (const line of lines) for (let i = 1; i < line.length; i++) curves.line(line[i - 1], line[i], 1);
    for (const [start, end] of depths) [1.5, 0].forEach((border, i) => arrows[i].arrow(start, end, border));
    curves.fill(this.group.children[0].geometry);
    arrows.forEach((ribbons, i) => ribbons.fill(this.arrows.children[i].geometry));
  }
}

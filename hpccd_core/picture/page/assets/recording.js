// SPDX-License-Identifier: Apache-2.0
"use strict";

// Content of the page, unpacked. Places are drawn in a box around the origin whose longest half is 1: WebGL has single
// precision only, and a scene may be far away or of any size.
class Recording {
  constructor(content) {
    Object.assign(this, content);
    const boxes = this.meshes.filter((mesh) => mesh.topologies.some((topology) => topology.vertices));
    const low = [0, 1, 2].map((axis) => Math.min(...boxes.map((mesh) => mesh.low[axis])));
    const high = [0, 1, 2].map((axis) => Math.max(...boxes.map((mesh) => mesh.high[axis])));
    this.centre = low.map((value, axis) => (boxes.length ? 0.5 * value + 0.5 * high[axis] : 0));
    this.scale = (boxes.length && Math.max(...low.map((value, axis) => 0.5 * high[axis] - 0.5 * value))) || 1;
    this.firstContact = [0];
    this.firstIntersecting = [0];
    this.firstCurve = [0];
    this.firstOfCurves = [0]; // points: of the curves of a step, then two of each depth
    for (const step of this.steps) {
      this.firstContact.push(this.firstContact.at(-1) + step.drawn[0] + step.drawn[1]);
      this.firstCurve.push(this.firstCurve.at(-1) + step.curves[0]);
      this.firstOfCurves.push(this.firstOfCurves.at(-1) + step.curves[1] + 2 * step.depths.length);
      this.firstIntersecting.push(step.intersecting.reduce((sum, count) => sum + count, this.firstIntersecting.at(-1)));
    }
  }

  async unpack() {
    for (const [number, mesh] of this.meshes.entries()) {
      for (const [t, topology] of mesh.topologies.entries()) {
        const { edges, faces, frames, vertices } = topology;
        topology.indices = await unpack(`mesh-${number}-faces-${t}`, 4, 1, faces, 3);
        topology.ends = await unpack(`mesh-${number}-edges-${t}`, 4, 1, edges, 2);
        topology.positions = await unpack(`mesh-${number}-positions-${t}`, 2, frames, vertices, 3);
      }
    }
    this.intersecting = await unpack("intersecting-faces", 4, 1, this.firstIntersecting.at(-1), 1);
    const { contacts, curves } = this;
    curves.lengths = await unpack("curves-lengths", 4, 1, curves.lines, 1);
    curves.points = await unpack("curves-points", 2, 1, curves.count, 3);
    contacts.meshes = await unpack("contacts-meshes", 4, 1, contacts.count, 2);
    contacts.features = await unpack("contacts-features", 4, 1, contacts.count, 4);
    contacts.toc = await unpack("contacts-toc", 2, 1, 1, contacts.count);
    contacts.points = await unpack("contacts-points", 2, 1, contacts.count, 3);
  }

  // Places `first` to `end` of rounded ones, as they are drawn, into `target`.
  place(grid, rounded, first, end, target) {
    const { centre, scale } = this;
    const origin = [0, 1, 2].map((axis) => (grid.low[axis] - centre[axis]) / scale);
    const step = grid.step / scale;
    for (let i = 3 * first, to = 0; i < 3 * end; i++, to++) target[to] = origin[to % 3] + step * rounded[i];
  }

  // {topology, frame} of a mesh at a step, or null.
  shown(mesh, step) {
    const shown = this.meshes[mesh].shown[step];
    return shown && { topology: this.meshes[mesh].topologies[shown[0]], number: shown[0], frame: shown[1] };
  }

  // Numbers of the faces of a mesh that intersect another mesh at the end of a step.
  intersectingFaces(mesh, step) {
    const counts = this.steps[step].intersecting;
    const first = counts.slice(0, mesh).reduce((sum, count) => sum + count, this.firstIntersecting[step]);
    return this.intersecting.subarray(first, first + (counts[mesh] ?? 0));
  }

  // {lines: [[x, y, z], ...] of each intersection curve of a step, depths: [start, end] of each of its depths}
  curvesOf(step) {
    const first = this.firstOfCurves[step], end = this.firstOfCurves[step + 1];
    const flat = new Float32Array(3 * (end - first)), lines = [], depths = [];
    this.place(this.curves, this.curves.points, first, end, flat);
    let at = 0;
    const next = (count) => Array.from({ length: count }, () => [...flat.subarray(at, (at += 3))]);
    for (let k = this.firstCurve[step]; k < this.firstCurve[step + 1]; k++) lines.push(next(this.curves.lengths[k]));
    for (const _ of this.steps[step].depths) depths.push(next(2));
    return { lines, depths };
  }

  // Contact `index` of all: {vf, meshes, features, toc, point}.
  contact(step, index) {
    const { meshes, features, toc, points, times, low, step: unit } = this.contacts;
    return {
      vf: index < this.firstContact[step] + this.steps[step].drawn[0],
      meshes: [...meshes.subarray(2 * index, 2 * index + 2)],
      features: [...features.subarray(4 * index, 4 * index + 4)],
      toc: toc[index] / times,
      point: [...points.subarray(3 * index, 3 * index + 3)].map((value, axis) => low[axis] + unit * value),
    };
  }

  tocColour(toc) {
    const shades = this.colours.toc;
    const at = toc * (shades.length - 1), below = Math.min(Math.floor(at), shades.length - 2);
    return shades[below].map((value, k) => value + (at - below) * (shades[below + 1][k] - value));
  }
}

function linear(colour) {
  return colour.map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
}

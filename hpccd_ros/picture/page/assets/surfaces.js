// SPDX-License-Identifier: Apache-2.0
"use strict";

// The meshes of a step, each in its colour, tinted around contacts. Edges beside those of its faces
// are lines between its vertices, and one without faces is drawn as its vertices.
class Surfaces {
  constructor(recording) {
    this.recording = recording;
    this.group = new THREE.Group();
    this.visible = recording.meshes.map(() => true);
    this.own = recording.meshes.map((mesh) => linear(new THREE.Color(mesh.colour).toArray()));
    this.drawn = recording.meshes.map(() => []); // per mesh and topology, made when it is first shown
    this.material = new THREE.MeshStandardMaterial({
      vertexColors: true, side: THREE.DoubleSide, roughness: 0.55, metalness: 0,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
    });
    this.edges = new THREE.MeshBasicMaterial({ color: 0x0a0d13, wireframe: true, transparent: true, opacity: 0.35 });
    this.points = new THREE.PointsMaterial({ vertexColors: true, size: 3 * devicePixelRatio, sizeAttenuation: false });
    this.lines = new THREE.LineBasicMaterial({ vertexColors: true });
    this.withEdges = false;
  }

  show(step, tint) {
    const { recording } = this;
    this.group.clear();
    const earliest = tint ? this.earliest(step) : null;
    for (const mesh of recording.meshes.keys()) {
      const shown = recording.shown(mesh, step);
      if (!shown || !shown.topology.vertices || !this.visible[mesh]) continue;
      const drawn = (this.drawn[mesh][shown.number] ??= this.make(shown.topology));
      const { position, color } = drawn.geometry.attributes;
      const start = shown.frame * shown.topology.vertices;
      recording.place(recording.meshes[mesh], shown.topology.positions, start, start + position.count, position.array);
      this.colour(color.array, this.own[mesh], shown.topology, earliest && earliest[mesh]);
      position.needsUpdate = color.needsUpdate = true;
      if (shown.topology.faces) drawn.geometry.computeVertexNormals();
      this.group.add(drawn.object);
      if (drawn.lines) this.group.add(drawn.lines);
      if (this.withEdges && shown.topology.faces) this.group.add(drawn.edges);
    }
  }

  make(topology) {
    const geometry = new THREE.BufferGeometry();
    for (const name of ["position", "color"]) {
      const attribute = new THREE.BufferAttribute(new Float32Array(3 * topology.vertices), 3);
      geometry.setAttribute(name, attribute.setUsage(THREE.DynamicDrawUsage));
    }
    geometry.setIndex(topology.faces ? new THREE.BufferAttribute(topology.indices, 1) : null);
    const object = topology.faces ? new THREE.Mesh(geometry, this.material) : new THREE.Points(geometry, this.points);
    const edges = new THREE.Mesh(geometry, this.edges);
    object.castShadow = object.receiveShadow = true;
    object.frustumCulled = edges.frustumCulled = false; // its bounds would be those of another step
    return { geometry, object, edges, lines: topology.edges ? this.makeLines(geometry, topology) : null };
  }

  makeLines(geometry, topology) {
    const same = new THREE.BufferGeometry();
    for (const name of ["position", "color"]) same.setAttribute(name, geometry.attributes[name]);
    same.setIndex(new THREE.BufferAttribute(topology.ends, 1));
    const lines = new THREE.LineSegments(same, this.lines);
    lines.frustumCulled = false;
    return lines;
  }

  // Per mesh the earliest time of contact of each vertex: its own, that of an edge it ends, or of a face around it.
  earliest(step) {
    const { recording } = this;
    const times = recording.meshes.map((_, mesh) => {
      const shown = recording.shown(mesh, step);
      return shown && new Float32Array(shown.topology.vertices).fill(Infinity);
    });
    for (let index = recording.firstContact[step]; index < recording.firstContact[step + 1]; index++) {
      const contact = recording.contact(step, index);
      for (const side of [0, 1]) {
        const of = times[contact.meshes[side]];
        if (!of) continue;
        for (const vertex of this.vertices(contact, side, step)) of[vertex] = Math.min(of[vertex], contact.toc);
      }
    }
    return times;
  }

  // Vertices of a side of a contact: of a vertex, a face or an edge.
  vertices(contact, side, step) {
    const [first, second] = contact.features.slice(2 * side, 2 * side + 2);
    if (!contact.vf) return [first, second];
    if (side === 0) return [first];
    return [...this.recording.shown(contact.meshes[1], step).topology.indices.subarray(3 * first, 3 * first + 3)];
  }

  colour(target, own, topology, earliest) {
    for (let i = 0; i < target.length; i++) target[i] = own[i % 3];
    if (!earliest || !topology.faces || earliest.every((toc) => toc === Infinity)) return;
    const { tint } = this.recording.colours;
    const glow = this.glow(topology, earliest);
    for (let vertex = 0; vertex < topology.vertices; vertex++) {
      const weight = glow[4 * vertex + 3];
      for (let k = 0; k < 3; k++) {
        target[3 * vertex + k] = (1 - tint * weight) * own[k] + tint * glow[4 * vertex + k];
      }
    }
  }

  // Per vertex a colour times its weight, and the weight: spread twice over the edges, or single vertices would make
  // stars. So contacts between layers show on the outside of the layers.
  glow(topology, earliest) {
    const { indices, vertices } = topology;
    const degree = (topology.degree ??= degrees(indices, vertices));
    let values = new Float32Array(4 * vertices);
    earliest.forEach((toc, vertex) => {
      if (toc !== Infinity) values.set([...linear(this.recording.tocColour(toc)), 1], 4 * vertex);
    });
    for (let round = 0; round < 2; round++) {
      const around = new Float32Array(4 * vertices);
      for (let i = 0; i < indices.length; i++) {
        const a = indices[i], b = indices[i % 3 === 2 ? i - 2 : i + 1];
        for (let k = 0; k < 4; k++) {
          around[4 * a + k] += values[4 * b + k];
          around[4 * b + k] += values[4 * a + k];
        }
      }
      values = values.map((value, i) => 0.5 * (value + around[i] / degree[i >> 2]));
    }
    return values;
  }
}

function degrees(indices, vertices) {
  const degree = new Float32Array(vertices);
  for (const vertex of indices) degree[vertex] += 2;
  return degree.map((count) => Math.max(count, 1));
}

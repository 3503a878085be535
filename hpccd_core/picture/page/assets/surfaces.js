// SPDX-License-Identifier: Apache-2.0
"use strict";

// In place of a second vertex, or of both for a plane, as in ContactArray.
const NO_VERTEX = 4294967295;

// The meshes of a step, each in its colour, tinted around contacts. Edges beside those of its faces
// are lines between its vertices, and one without faces is drawn as its vertices.
class Surfaces {
  constructor(recording) {
    this.recording = recording;
    this.group = new THREE.Group();
    this.visible = recording.meshes.map((mesh) => !mesh.hidden);
    this.own = recording.meshes.map((mesh) => linear(new THREE.Color(mesh.colour).toArray()));
    this.drawn = recording.meshes.map(() => []); // per mesh and topology, made when it is first shown
    this.material = new THREE.MeshStandardMaterial({
      vertexColors: true, side: THREE.DoubleSide, roughness: 0.55, metalness: 0,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
    });
    this.tint = new Tint(recording);
    this.tint.paint(this.material);
    this.planes = this.material.clone(); // seen from outside, a plane would hide the meshes: only its edges are drawn
    this.planes.side = THREE.FrontSide;
    this.marks = this.material.clone(); // without the offset: in front of the surface
    this.marks.setValues({ vertexColors: false, polygonOffset: false, transparent: true, opacity: 0.7 });
    this.marks.color.set(recording.colours.intersecting).convertSRGBToLinear();
    this.edges = new THREE.MeshBasicMaterial({ color: 0x0a0d13, wireframe: true, transparent: true, opacity: 0.35 });
    this.points = new THREE.PointsMaterial({ vertexColors: true, size: 3 * devicePixelRatio, sizeAttenuation: false });
    this.lines = new THREE.LineBasicMaterial({ vertexColors: true });
    this.withEdges = false;
    this.withMarks = true;
  }

  show(step, tint) {
    const { recording } = this;
    this.group.clear();
    this.tint.show(step, tint);
    for (const mesh of recording.meshes.keys()) {
      const shown = recording.shown(mesh, step);
      if (!shown || !shown.topology.vertices || !this.visible[mesh]) continue;
      const drawn = (this.drawn[mesh][shown.number] ??= this.make(shown.topology, this.own[mesh], recording.meshes[mesh]));
      const { position } = drawn.geometry.attributes;
      const start = shown.frame * shown.topology.vertices;
      recording.place(recording.meshes[mesh], shown.topology.positions, start, start + position.count, position.array);
      position.needsUpdate = true;
      if (shown.topology.faces) drawn.geometry.computeVertexNormals();
      drawn.place?.();
      this.group.add(drawn.object);
      if (drawn.lines) this.group.add(drawn.lines);
      const marked = recording.intersectingFaces(mesh, step);
      if (marked.length && this.withMarks) this.group.add(this.mark(drawn, shown.topology, marked));
      if (this.withEdges && shown.topology.faces) this.group.add(drawn.edges);
    }
  }

  make(topology, colour, { plane, thickness }) {
    const geometry = new THREE.BufferGeometry();
    const places = new THREE.BufferAttribute(new Float32Array(3 * topology.vertices), 3);
    geometry.setAttribute("position", places.setUsage(THREE.DynamicDrawUsage));
    const colours = Float32Array.from({ length: 3 * topology.vertices }, (_, i) => colour[i % 3]);
    geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
    geometry.setIndex(topology.faces ? new THREE.BufferAttribute(topology.indices, 1) : null);
    const material = plane ? this.planes : this.material;
    const object = topology.faces ? new THREE.Mesh(geometry, material) : new THREE.Points(geometry, this.points);
    if (!topology.faces && thickness > 0) return this.makeCapsules(geometry, topology, colour, thickness);
    const edges = new THREE.Mesh(geometry, this.edges);
    object.receiveShadow = true;
    object.castShadow = !plane;
    object.frustumCulled = edges.frustumCulled = false; // its bounds would be those of another step
    return { geometry, object, edges, lines: topology.edges ? this.makeLines(geometry, topology) : null };
  }

  // Some of the faces in the colour of those that intersect another mesh.
  mark(drawn, { indices }, faces) {
    drawn.marked?.dispose();
    drawn.marked = new THREE.BufferGeometry();
    for (const name of ["position", "normal"]) drawn.marked.setAttribute(name, drawn.geometry.attributes[name]);
    const corners = new Uint32Array(3 * faces.length);
    faces.forEach((face, i) => corners.set(indices.subarray(3 * face, 3 * face + 3), 3 * i));
    drawn.marked.setIndex(new THREE.BufferAttribute(corners, 1));
    const object = new THREE.Mesh(drawn.marked, this.marks);
    object.receiveShadow = true;
    object.frustumCulled = false;
    return object;
  }

  // A sphere around each vertex and a tube around each edge. `place`: to the positions of `geometry`.
  makeCapsules(geometry, { vertices, edges, ends }, colour, thickness) {
    const radius = thickness / this.recording.scale;
    const material = new THREE.MeshStandardMaterial({ color: new THREE.Color(...colour), roughness: 0.55, metalness: 0 });
    const [around, above] = vertices > 5000 ? [6, 4] : [16, 12];
    const spheres = new THREE.InstancedMesh(new THREE.SphereGeometry(radius, around, above), material, vertices);
    const tubes = new THREE.InstancedMesh(new THREE.CylinderGeometry(radius, radius, 1, around, 1, true), material, edges);
    const object = new THREE.Group();
    for (const part of [spheres, tubes]) {
      part.castShadow = part.receiveShadow = true;
      part.frustumCulled = false;
      if (part.count) object.add(part);
    }
    const matrix = new THREE.Matrix4(), turn = new THREE.Quaternion(), size = new THREE.Vector3(1, 1, 1);
    const [from, to, along] = [0, 1, 2].map(() => new THREE.Vector3()), up = new THREE.Vector3(0, 1, 0); // of a cylinder
    const place = () => {
      const { array } = geometry.attributes.position;
      for (let i = 0; i < vertices; i++) {
        spheres.setMatrixAt(i, matrix.makeTranslation(array[3 * i], array[3 * i + 1], array[3 * i + 2]));
      }
      for (let i = 0; i < edges; i++) {
        along.subVectors(to.fromArray(array, 3 * ends[2 * i + 1]), from.fromArray(array, 3 * ends[2 * i]));
        size.y = along.length();
        turn.setFromUnitVectors(up, along.normalize());
        tubes.setMatrixAt(i, matrix.compose(from.add(to).multiplyScalar(0.5), turn, size));
      }
      spheres.instanceMatrix.needsUpdate = tubes.instanceMatrix.needsUpdate = true;
    };
    return { geometry, object, place };
  }

  makeLines(geometry, topology) {
    const same = new THREE.BufferGeometry();
    for (const name of ["position", "color"]) same.setAttribute(name, geometry.attributes[name]);
    same.setIndex(new THREE.BufferAttribute(topology.ends, 1));
    const lines = new THREE.LineSegments(same, this.lines);
    lines.frustumCulled = false;
    return lines;
  }

  // Vertices of a side of a contact: of a vertex, a face or an edge.
  vertices(contact, side, step) {
    const [first, second] = contact.features.slice(2 * side, 2 * side + 2);
    if (!contact.vf) return [first, second].filter((vertex) => vertex !== NO_VERTEX);
    if (side === 0) return [first];
    return [...this.recording.shown(contact.meshes[1], step).topology.indices.subarray(3 * first, 3 * first + 3)];
  }
}

// SPDX-License-Identifier: Apache-2.0
"use strict";

// The contacts of a step as points coloured by their time; faint where a surface is in front of them.
class Contacts {
  constructor(recording) {
    this.recording = recording;
    this.geometry = new THREE.BufferGeometry();
    this.group = new THREE.Group();
    this.first = 0;
    for (const behind of [true, false]) {
      const points = new THREE.Points(this.geometry, contactMaterial(behind));
      points.frustumCulled = false;
      points.renderOrder = behind ? 1 : 2;
      this.group.add(points);
    }
    this.outline = new THREE.LineSegments(
      new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: 0xffffff, depthTest: false, transparent: true }),
    );
    this.outline.renderOrder = 3;
    this.outline.frustumCulled = false;
    this.group.add(this.outline);
  }

  show(step) {
    const { recording } = this;
    this.first = recording.firstContact[step];
    const end = recording.firstContact[step + 1], count = end - this.first;
    const position = new Float32Array(3 * count), color = new Float32Array(3 * count);
    recording.place(recording.contacts, recording.contacts.points, this.first, end, position);
    for (let i = 0; i < count; i++) {
      const toc = recording.contacts.toc[this.first + i] / recording.contacts.times;
      color.set(linear(recording.tocColour(toc)), 3 * i);
    }
    this.geometry.dispose();
    this.geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
    this.geometry.setAttribute("color", new THREE.BufferAttribute(color, 3));
    const size = Math.min(8, Math.max(3.5, 3 + 60 / Math.sqrt(Math.max(count, 1)))) * devicePixelRatio;
    this.group.children[0].material.size = 0.8 * size;
    this.group.children[1].material.size = size;
    this.point(null);
  }

  // The contact nearest to a pixel, {index, x, y}, or null where none is near.
  at(x, y, camera, width, height) {
    const place = new THREE.Vector3(), places = this.geometry.attributes.position;
    let best = null, least = 9 * 9;
    for (let i = 0; i < places.count; i++) {
      place.fromBufferAttribute(places, i).project(camera);
      const px = (0.5 + 0.5 * place.x) * width, py = (0.5 - 0.5 * place.y) * height;
      const away = (px - x) ** 2 + (py - y) ** 2;
      if (away < least && Math.abs(place.z) < 1) {
        least = away;
        best = { index: this.first + i, x: px, y: py };
      }
    }
    return best;
  }

  // Draw the outline of both sides, [flat x y z of 1 to 3 vertices]; null: of none.
  point(sides) {
    const lines = [];
    for (const side of sides ?? []) {
      const corners = side.length / 3;
      for (let i = 0; i < (corners === 3 ? 3 : corners - 1); i++) {
        const next = (i + 1) % corners;
        lines.push(...side.slice(3 * i, 3 * i + 3), ...side.slice(3 * next, 3 * next + 3));
      }
    }
    this.outline.visible = lines.length > 0;
    this.outline.geometry.dispose();
    this.outline.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(lines), 3));
  }
}

function contactMaterial(behind) {
  const material = new THREE.PointsMaterial({
    vertexColors: true, sizeAttenuation: false, transparent: true, depthWrite: false,
    depthTest: !behind, opacity: behind ? 0.3 : 1, map: disc(),
  });
  material.onBeforeCompile = (shader) => {
    // Towards the eye: contacts lie on the surfaces or, as these have moved on since, somewhat behind them.
    const lift = "gl_Position = projectionMatrix * (mvPosition + vec4(0.0, 0.0, 0.02, 0.0));";
    shader.vertexShader = shader.vertexShader.replace("#include <project_vertex>", `#include <project_vertex>\n${lift}`);
  };
  return material;
}

// A round spot with a soft border.
function disc() {
  const size = 64, canvas = document.createElement("canvas");
  canvas.width = canvas.height = size;
  const context = canvas.getContext("2d");
  const gradient = context.createRadialGradient(size / 2, size / 2, 0, size / 2, size / 2, size / 2);
  for (const [at, alpha] of [[0, 1], [0.7, 1], [1, 0]]) gradient.addColorStop(at, `rgba(255, 255, 255, ${alpha})`);
  context.fillStyle = gradient;
  context.fillRect(0, 0, size, size);
  return new THREE.CanvasTexture(canvas);
}

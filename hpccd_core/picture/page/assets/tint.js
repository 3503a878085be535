// SPDX-License-Identifier: Apache-2.0
"use strict";

// Tints surfaces around the contacts of a step in the colour of their times, as tint.py does: a texture of the space
// around the contacts, so that the radius does not depend on the size of faces.
class Tint {
  static CELLS = 2; // grid cells to the radius
  static MOST = 96; // cells along an axis

  constructor(recording) {
    this.recording = recording;
    this.radius = 2 * recording.colours.radius; // the longest side of the scene is drawn with length 2
    this.uniforms = {
      tintVolume: { value: this.texture([1, 1, 1], new Uint8Array(4)) },
      tintLow: { value: new THREE.Vector3() },
      tintSize: { value: new THREE.Vector3(1, 1, 1) },
      tintStrength: { value: recording.colours.tint },
    };
  }

  texture([width, height, depth], data) {
    const texture = new THREE.Data3DTexture(data, width, height, depth);
    texture.minFilter = texture.magFilter = THREE.LinearFilter;
    texture.needsUpdate = true;
    return texture;
  }

  // Make `material` show it.
  paint(material) {
    material.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, this.uniforms);
      shader.vertexShader = `varying vec3 vTintPlace;\n${shader.vertexShader}`
        .replace("#include <begin_vertex>", "#include <begin_vertex>\nvTintPlace = transformed;");
      shader.fragmentShader = `
        varying vec3 vTintPlace;
        uniform highp sampler3D tintVolume;
        uniform vec3 tintLow, tintSize;
        uniform float tintStrength;
        ${shader.fragmentShader}`.replace("#include <color_fragment>", `#include <color_fragment>
        vec3 tintAt = (vTintPlace - tintLow) / tintSize;
        if (all(greaterThan(tintAt, vec3(0.0))) && all(lessThan(tintAt, vec3(1.0)))) {
          vec4 tint = tintStrength * texture(tintVolume, tintAt);
          diffuseColor.rgb = (1.0 - tint.a) * diffuseColor.rgb + tint.rgb;
        }`);
    };
  }

  // on: false for no tint.
  show(step, on) {
    const places = on ? this.places(step) : [];
    this.uniforms.tintVolume.value.dispose();
    if (!places.length) {
      this.uniforms.tintVolume.value = this.texture([1, 1, 1], new Uint8Array(4));
      return;
    }
    const low = [0, 1, 2].map((axis) => Math.min(...extremes(places, axis)) - 1.5 * this.radius);
    const high = [0, 1, 2].map((axis) => Math.max(...extremes(places, axis)) + 1.5 * this.radius);
    const cell = Math.max(this.radius / Tint.CELLS, Math.max(...low.map((value, axis) => high[axis] - value)) / Tint.MOST);
    const sizes = low.map((value, axis) => Math.ceil((high[axis] - value) / cell));
    this.uniforms.tintLow.value.fromArray(low);
    this.uniforms.tintSize.value.fromArray(sizes).multiplyScalar(cell);
    this.uniforms.tintVolume.value = this.texture(sizes, this.volume(places, low, sizes, cell));
  }

  // [x, y, z, red, green, blue] of each contact near the drawn surfaces.
  places(step) {
    const { recording } = this, first = recording.firstContact[step], end = recording.firstContact[step + 1];
    const points = new Float32Array(3 * (end - first)), found = [];
    recording.place(recording.contacts, recording.contacts.points, first, end, points);
    for (let i = 0; i < end - first; i++) {
      const place = [points[3 * i], points[3 * i + 1], points[3 * i + 2]];
      if (place.some((value) => Math.abs(value) > 1 + this.radius)) continue;
      const toc = recording.contacts.toc[first + i] / recording.contacts.times;
      found.push([...place, ...linear(recording.tocColour(toc))]);
    }
    return found;
  }

  // Colour times weight, and weight, of each cell. A single contact has weight 0.8 where it is; many have nearly 1.
  volume(places, low, sizes, cell) {
    const [width, height, depth] = sizes, sums = new Float32Array(4 * width * height * depth);
    const reach = Math.ceil(this.radius / cell), far = this.radius * this.radius;
    for (const [x, y, z, red, green, blue] of places) {
      const at = [x, y, z].map((value, axis) => (value - low[axis]) / cell - 0.5);
      const [i, j, k] = at.map(Math.round);
      for (let c = Math.max(0, k - reach); c <= Math.min(depth - 1, k + reach); c++) {
        for (let b = Math.max(0, j - reach); b <= Math.min(height - 1, j + reach); b++) {
          for (let a = Math.max(0, i - reach); a <= Math.min(width - 1, i + reach); a++) {
            const away = ((a - at[0]) ** 2 + (b - at[1]) ** 2 + (c - at[2]) ** 2) * cell * cell;
            if (away >= far) continue;
            const part = (1 - away / far) ** 4, n = 4 * (a + width * (b + height * c));
            sums[n] += part * red;
            sums[n + 1] += part * green;
            sums[n + 2] += part * blue;
            sums[n + 3] += part;
          }
        }
      }
    }
    const data = new Uint8Array(sums.length);
    for (let n = 0; n < sums.length; n += 4) {
      if (!sums[n + 3]) continue;
      const weight = 1 - Math.exp(-1.6 * sums[n + 3]);
      for (let k = 0; k < 3; k++) data[n + k] = Math.round((255 * weight * sums[n + k]) / sums[n + 3]);
      data[n + 3] = Math.round(255 * weight);
    }
    return data;
  }
}

function extremes(places, axis) {
  return places.reduce(([low, high], place) => [Math.min(low, place[axis]), Math.max(high, place[axis])], [Infinity, -Infinity]);
}

// SPDX-License-Identifier: Apache-2.0
"use strict";

// Lines and arrows some pixels wide: lines of WebGL are one pixel wide.
class Ribbons {
  constructor() {
    this.corners = [];
    this.indices = [];
  }

  // A corner at `place`, `side` pixels beside the line from there to `other`, and `ahead` pixels along it.
  corner(place, other, side, ahead = 0) {
    this.corners.push({ place, other, away: [side, ahead] });
    return this.corners.length - 1;
  }

  // From a to b, `radius` pixels to both sides; shortened at b.
  line(a, b, radius, shortened = 0) {
    const first = this.corner(a, b, radius), second = this.corner(a, b, -radius);
    // From b the line is seen the other way round, so left is right.
    const third = this.corner(b, a, radius, shortened), fourth = this.corner(b, a, -radius, shortened);
    this.indices.push(first, second, third, first, third, fourth);
  }

  // Wider by `border` pixels on all sides.
  arrow(from, to, border) {
    this.line(from, to, 1.5 + border, 8);
    const half = 5 + 1.8 * border, back = 12 + border;
    this.indices.push(
      this.corner(to, from, 0, -2.2 * border), this.corner(to, from, half, back), this.corner(to, from, -half, back),
    );
  }

  fill(geometry) {
    const column = (name, width) => {
      const values = Float32Array.from(this.corners.flatMap((corner) => corner[name]));
      return new THREE.BufferAttribute(values, width);
    };
    geometry.dispose();
    geometry.setAttribute("position", column("place", 3));
    geometry.setAttribute("other", column("other", 3));
    geometry.setAttribute("away", column("away", 2));
    geometry.setIndex(this.indices);
  }

  // screen: a uniform, half of the size of the canvas in pixels of the page.
  static material(screen, colour, opacity, depthTest) {
    const { r, g, b } = new THREE.Color(colour);
    return new THREE.ShaderMaterial({
      uniforms: { screen, colour: { value: new THREE.Vector4(r, g, b, opacity) } },
      vertexShader: `
        attribute vec3 other;
        attribute vec2 away;
        uniform vec2 screen;
        void main() {
          // Towards the eye: the surfaces on which it lies would flicker through.
          vec4 lift = vec4(0.0, 0.0, 0.004, 0.0);
          vec4 here = projectionMatrix * (modelViewMatrix * vec4(position, 1.0) + lift);
          vec4 there = projectionMatrix * (modelViewMatrix * vec4(other, 1.0) + lift);
          vec2 along = (there.xy / there.w - here.xy / here.w) * screen;
          along = length(along) > 0.0 ? normalize(along) : vec2(1.0, 0.0);
          here.xy += (away.x * vec2(-along.y, along.x) + away.y * along) / screen * here.w;
          gl_Position = here;
        }`,
      fragmentShader: "uniform vec4 colour; void main() { gl_FragColor = colour; }",
      transparent: true, depthWrite: false, side: THREE.DoubleSide, depthTest,
    });
  }
}

// SPDX-License-Identifier: Apache-2.0
"use strict";

// Unpacks data of packing.py: groups * rows * width integers of 2 or 4 bytes, as a typed array.
async function unpack(id, bytesEach, groups, rows, width) {
  const text = atob(document.getElementById(id).textContent);
  const compressed = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) compressed[i] = text.charCodeAt(i);
  const inflated = new Blob([compressed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(inflated).arrayBuffer());
  const count = groups * rows * width;
  if (planes.length !== count * bytesEach) throw new Error(`${id} has ${planes.length} bytes`);
  const values = bytesEach === 2 ? new Uint16Array(count) : new Uint32Array(count);
  for (let i = 0; i < count; i++) {
    let folded = 0;
    for (let plane = bytesEach - 1; plane >= 0; plane--) folded = (folded << 8) | planes[plane * count + i];
    values[i] = (folded >>> 1) ^ -(folded & 1);
  }
  const group = rows * width;
  for (let start = 0; start < count; start += group) {
    for (let i = start + width; i < start + group; i++) values[i] += values[i - width];
    if (start) for (let i = start; i < start + group; i++) values[i] += values[i - group];
  }
  return values;
}

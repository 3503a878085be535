// SPDX-License-Identifier: Apache-2.0
"use strict";

// How many of a step's drawn contacts happen at which time, in the colours of the times: their legend, too.
class Times {
  static BINS = 40;

  constructor(canvas, recording) {
    Object.assign(this, { canvas, recording });
  }

  show(step) {
    const { recording } = this;
    const { width, height, context } = sharp(this.canvas);
    const counts = new Array(Times.BINS).fill(0);
    for (let i = recording.firstContact[step]; i < recording.firstContact[step + 1]; i++) {
      const toc = recording.contacts.toc[i] / recording.contacts.times;
      counts[Math.min(Times.BINS - 1, Math.floor(toc * Times.BINS))] += 1;
    }
    if (!counts.some(Boolean)) {
      context.font = "13px system-ui, sans-serif";
      context.fillStyle = recording.colours.faint;
      const known = recording.steps[step].total !== null;
      context.fillText(known ? "No contacts in this step." : "No contacts are known.", 0, 20);
      return;
    }
    const most = Math.max(...counts, 1), left = 12, right = width - 52, top = 6, bottom = height - 18;
    const tall = (bottom - top) / Times.BINS;
    counts.forEach((count, bin) => {
      const colour = recording.tocColour((bin + 0.5) / Times.BINS).map((c) => Math.round(255 * c));
      context.fillStyle = `rgb(${colour})`;
      context.fillRect(0, bottom - (bin + 1) * tall, 7, tall + 0.5); // the scale
      context.fillRect(left, bottom - (bin + 1) * tall, (count / most) * (right - left), Math.max(tall - 1, 0.5));
    });
    context.font = "11px system-ui, sans-serif";
    context.fillStyle = recording.colours.faint;
    for (const [toc, text] of [[0, "0 start"], [0.25, "¼"], [0.5, "½"], [0.75, "¾"], [1, "1 end"]]) {
      context.fillText(text, right + 8, bottom - toc * (bottom - top) + (toc === 1 ? 8 : toc === 0 ? 0 : 4));
    }
    context.textAlign = "center";
    context.fillText("0", left + 3, height - 4);
    context.fillText(most.toLocaleString("en"), right, height - 4);
    context.fillText("contacts", (left + right) / 2, height - 4);
  }
}

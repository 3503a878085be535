// SPDX-License-Identifier: Apache-2.0
"use strict";

// Contacts and milliseconds of each step. `chosen(step)` is called where it is clicked or dragged over.
class Chart {
  static LEFT = 60;
  static RIGHT = 60;
  static TOP = 16;
  static BOTTOM = 18;
  static CONTACTS = "#e0668c";
  static MILLISECONDS = "#7fd1e0";

  constructor(canvas, recording, chosen) {
    Object.assign(this, { canvas, recording, step: 0, hovered: null });
    const { steps } = recording;
    this.mostContacts = ceiling(steps.map((step) => step.total ?? 0));
    this.mostMilliseconds = ceiling([usual(steps.map((step) => step.milliseconds ?? 0))]);
    const choose = (event) => chosen(this.stepAt(event.offsetX));
    canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); choose(event); });
    canvas.addEventListener("pointermove", (event) => {
      this.hovered = this.stepAt(event.offsetX);
      if (event.buttons & 1) choose(event);
      this.draw();
    });
    canvas.addEventListener("pointerleave", () => { this.hovered = null; this.draw(); });
  }

  show(step) {
    this.step = step;
    this.draw();
  }

  stepAt(x) {
    const { steps } = this.recording;
    const at = Math.floor(((x - Chart.LEFT) / (this.canvas.clientWidth - Chart.LEFT - Chart.RIGHT)) * steps.length);
    return Math.max(0, Math.min(steps.length - 1, at));
  }

  draw() {
    const { width, height, context } = sharp(this.canvas);
    const { steps, colours } = this.recording;
    const wide = (width - Chart.LEFT - Chart.RIGHT) / steps.length, floor = height - Chart.BOTTOM;
    const x = (step) => Chart.LEFT + step * wide, tall = floor - Chart.TOP;
    context.font = "11px system-ui, sans-serif";

    steps.forEach((step, i) => {
      context.fillStyle = step.total === null ? "#4a4f5c" : Chart.CONTACTS;
      context.globalAlpha = 0.45;
      const part = step.total === null ? 1 : step.total / this.mostContacts;
      context.fillRect(x(i), floor - part * tall, Math.max(wide - (wide > 4 ? 1 : 0), 0.5), part * tall);
      context.globalAlpha = 1;
      context.fillStyle = step.total === null ? "#4a4f5c" : Chart.CONTACTS;
      if (step.total) context.fillRect(x(i), floor - part * tall - 1, Math.max(wide - (wide > 4 ? 1 : 0), 0.5), 1.5);
      context.fillStyle = "#ffc46b";
      if (step.gap) context.fillRect(x(i) - 1, Chart.TOP, 1.5, tall);
    });

    context.strokeStyle = Chart.MILLISECONDS;
    context.lineWidth = 1.3;
    context.beginPath();
    let pen = "moveTo";
    steps.forEach((step, i) => {
      if (step.milliseconds === null) { pen = "moveTo"; return; }
      const y = floor - Math.min(step.milliseconds / this.mostMilliseconds, 1) * tall;
      if (pen === "moveTo") context.moveTo(x(i + 0.5) - 1, y);
      context.lineTo(x(i + 0.5), y);
      pen = "lineTo";
    });
    context.stroke();
    context.fillStyle = Chart.MILLISECONDS;
    steps.forEach((step, i) => { // beyond the axis
      if (step.milliseconds > this.mostMilliseconds) triangle(context, x(i + 0.5), Chart.TOP);
    });

    context.fillStyle = colours.faint;
    if (!steps.some((step) => step.total)) {
      context.textAlign = "center";
      context.fillText("No contacts in any step.", width / 2, Chart.TOP + tall / 2);
    }
    context.fillRect(Chart.LEFT, floor, width - Chart.LEFT - Chart.RIGHT, 1);
    context.textAlign = "center";
    const every = ceiling([70 / wide], [1, 2, 5, 10]), counted = steps.every((step, i) => Number(step.step) - Number(steps[0].step) === i);
    steps.forEach((step, i) => {
      const number = counted ? Number(step.step) : i;
      if (number % Math.ceil(every) === 0) context.fillText(step.step, x(i + 0.5), floor + 13);
    });
    axis(context, Chart.CONTACTS, "contacts", "right", Chart.LEFT - 7, this.mostContacts, Chart.TOP, floor);
    if (steps.some((step) => step.milliseconds !== null)) {
      axis(context, Chart.MILLISECONDS, "ms", "left", width - Chart.RIGHT + 7, this.mostMilliseconds, Chart.TOP, floor);
    }

    context.fillStyle = colours.ink;
    context.fillRect(x(this.step + 0.5) - 0.75, Chart.TOP - 3, 1.5, tall + 3);
    this.describe(context, this.hovered ?? this.step, x, width);
  }

  describe(context, step, x, width) {
    const { step: number, where, total, milliseconds } = this.recording.steps[step];
    const what = total === null ? "no contacts known" : `${total.toLocaleString("en")} contacts`
      + (milliseconds === null ? "" : `, ${milliseconds.toFixed(1)} ms`);
    const text = `${where ?? `step ${number}`}: ${what}`, half = context.measureText(text).width / 2;
    context.textAlign = "center";
    context.fillText(text, Math.max(Chart.LEFT + half, Math.min(width - Chart.RIGHT - half, x(step + 0.5))), 10);
  }
}

function axis(context, colour, name, align, x, most, top, floor) {
  context.fillStyle = colour;
  context.textAlign = align;
  context.fillText(name, x, 10);
  context.fillText(most.toLocaleString("en"), x, top + 12);
  context.fillText((most / 2).toLocaleString("en"), x, (top + floor) / 2 + 5);
  context.fillText("0", x, floor);
}

function triangle(context, x, y) {
  context.beginPath();
  context.moveTo(x - 4, y + 6);
  context.lineTo(x + 4, y + 6);
  context.lineTo(x, y);
  context.fill();
}

// The range of the axis: the largest 5 % of the values, such as those of a warm-up, do not determine it.
function usual(values) {
  const sorted = [...values].sort((a, b) => a - b), most = sorted.at(-1);
  const common = sorted[Math.max(0, sorted.length - 1 - Math.max(1, Math.floor(sorted.length / 20)))];
  return most < 2.5 * common || !common ? most : 1.3 * common;
}

// A round number that is not less than any of `values`: one of `digits` times a power of ten.
function ceiling(values, digits = [1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10]) {
  const most = values.reduce((a, b) => Math.max(a, b), 0) || 1;
  const unit = 10 ** Math.floor(Math.log10(most));
  return digits.map((k) => k * unit).find((value) => value >= most) ?? most;
}

// A canvas with as many pixels as the screen shows of it, empty, measured in CSS pixels.
function sharp(canvas) {
  const width = canvas.clientWidth, height = canvas.clientHeight, ratio = devicePixelRatio;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  context.scale(ratio, ratio);
  return { width, height, context };
}

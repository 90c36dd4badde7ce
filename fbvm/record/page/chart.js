// The time chart: a canvas as large as what is in view, names beside it.

const ROW = 26, RULER = 38, LANE = 18;

class Chart {
  constructor(run, state, move) {
    this.run = run;
    this.state = state;
    this.move = move;
    this.canvas = document.getElementById("canvas");
    this.scroll = document.getElementById("scroll");
    this.spacer = document.getElementById("spacer");
    this.labels = document.getElementById("labels");
    this.head = RULER + (run.frames.length ? LANE : 0);
    document.getElementById("lane").hidden = !run.frames.length;
    document.getElementById("corner").style.height = `${this.head}px`;
    this.frames = new Map();
    for (const frame of run.frames) this.frames.set(frame.scan, [...(this.frames.get(frame.scan) ?? []), frame]);
    this.own = run.frames[0]?.sender;
    this.shown = [];
    this.scroll.addEventListener("scroll", () => this.draw());
    new ResizeObserver(() => this.draw()).observe(this.scroll);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
    this.fingers = new Map();
    this.canvas.addEventListener("pointerdown", event => this.down(event));
    this.canvas.addEventListener("pointermove", event => this.drag(event));
    for (const name of ["pointerup", "pointercancel"]) this.canvas.addEventListener(name, event => this.fingers.delete(event.pointerId));
    this.canvas.addEventListener("wheel", event => this.wheel(event), {passive: false});
  }

  get left() { return this.labels.offsetWidth; }
  get width() { return Math.max(50, this.scroll.clientWidth - this.left); }
  get scale() { return this.width / this.state.span; }
  x(scan) { return this.left + (scan - this.state.start) * this.scale; }

  // --- what is chosen

  /** Takes the signals that the filter lets through, and makes their names. */
  choose() {
    const words = this.state.filter.toLowerCase().split(/\s+/).filter(Boolean);
    const end = this.state.start + this.state.span;
    this.shown = this.run.signals.map((_, number) => number).filter(number => {
      const signal = this.run.signals[number], text = `${signal.name} ${signal.said}`.toLowerCase();
      if (!words.every(word => text.includes(word))) return false;
      if (!this.state.moving) return true;
      return signal.track.place(end) > Math.max(0, signal.track.place(this.state.start));
    });
    this.labels.replaceChildren(...this.shown.map((number, at) => this.label(number, at)));
    this.labels.style.top = `${this.head}px`;
    this.spacer.style.height = `${this.head + this.shown.length * ROW}px`;
  }

  label(number, at) {
    const signal = this.run.signals[number], row = document.createElement("div");
    row.className = "label";
    row.style.top = `${at * ROW}px`;
    row.dataset.signal = number;
    row.title = signal.said ? `${signal.name}: ${signal.said}` : signal.name;
    const name = document.createElement("button");
    name.textContent = `\u200e${signal.name}`;
    name.addEventListener("click", () => this.move({chosen: number}));
    const value = document.createElement("output");
    const pin = document.createElement("button");
    pin.className = "pin";
    pin.textContent = "⚲";
    pin.title = "A column in the scan table";
    pin.setAttribute("aria-pressed", this.state.pinned.includes(number));
    pin.addEventListener("click", () => {
      const pinned = this.state.pinned.includes(number);
      this.move({pinned: pinned ? this.state.pinned.filter(other => other !== number) : [...this.state.pinned, number]});
      pin.setAttribute("aria-pressed", !pinned);
    });
    row.append(name, value, pin);
    return row;
  }

  values() {
    for (const row of this.labels.children) {
      const number = Number(row.dataset.signal), signal = this.run.signals[number];
      const text = this.run.text(number, this.state.scan, this.state.row), value = row.children[1];
      const shown = this.run.show(signal, text);
      if (value.textContent !== shown) value.textContent = shown;
      value.className = signal.bit && text === "1" ? "on" : "";
      row.classList.toggle("chosen", number === this.state.chosen);
    }
  }

  // --- what is drawn

  draw() {
    const wide = this.scroll.clientWidth, high = this.scroll.clientHeight, dots = devicePixelRatio || 1;
    if (!wide || !high) return;
    this.canvas.style.height = `${high}px`;
    this.canvas.style.marginBottom = `${-high}px`;
    if (this.canvas.width !== Math.round(wide * dots) || this.canvas.height !== Math.round(high * dots)) {
      this.canvas.width = Math.round(wide * dots);
      this.canvas.height = Math.round(high * dots);
    }
    const pen = this.pen = this.canvas.getContext("2d");
    pen.setTransform(dots, 0, 0, dots, 0, 0);
    const style = getComputedStyle(document.documentElement);
    this.colour = Object.fromEntries(["bg", "fg", "dim", "line", "grid", "on", "word", "fill", "cursor", "band", "out", "in"]
      .map(name => [name, style.getPropertyValue(`--${name}`).trim()]));
    pen.fillStyle = this.colour.bg;
    pen.fillRect(0, 0, wide, high);
    pen.font = "12px ui-monospace, monospace";
    this.letter = pen.measureText("0").width;
    pen.save();
    pen.beginPath();
    pen.rect(this.left, 0, this.width, high);
    pen.clip();
    this.rulers(high);
    const top = this.scroll.scrollTop, from = Math.max(0, Math.floor(top / ROW));
    pen.save();
    pen.beginPath();
    pen.rect(this.left, this.head, this.width, high);
    pen.clip();
    for (let at = from; at < this.shown.length && at * ROW - top < high; at++) {
      this.row(this.run.signals[this.shown[at]], this.head + at * ROW - top);
    }
    pen.restore();
    const x = this.x(this.state.scan), broad = Math.max(2, this.scale);
    pen.fillStyle = this.colour.band;
    pen.fillRect(x, 0, broad, high);
    pen.fillStyle = this.colour.cursor;
    pen.fillRect(x, 0, broad > 6 ? 1.5 : 1, high);
    pen.restore();
  }

  rulers(high) {
    const pen = this.pen, {start, span} = this.state;
    let step = 1;
    for (let at = 0; step * this.scale < 72; at++) step *= at % 3 === 1 ? 2.5 : 2;
    pen.textBaseline = "middle";
    for (let scan = Math.ceil(start / step) * step; scan <= start + span && scan <= this.run.last; scan += step) {
      const x = this.x(scan);
      pen.fillStyle = this.colour.grid;
      pen.fillRect(x, RULER, 1, high);
      pen.fillStyle = this.colour.dim;
      pen.fillText(String(scan), x + 3, 10);
      pen.fillText(showTime(this.run.time(scan)), x + 3, 28);
    }
    pen.fillStyle = this.colour.line;
    pen.fillRect(this.left, this.head - 1, this.width, 1);
    let until = -Infinity;
    for (const [scan, frames] of this.frames) {
      const x = this.x(scan + .5);
      if (x < this.left - 8 || x > this.left + this.width || x < until) continue;
      const out = frames.filter(frame => frame.sender === this.own).length;
      if (out) this.arrow(x - (out < frames.length ? 4 : 0), true);
      if (out < frames.length) this.arrow(x + (out ? 4 : 0), false);
      until = x + 1;
    }
  }

  /** Up for what the unit sends, down for what comes to it. */
  arrow(x, out) {
    const pen = this.pen, tip = RULER + (out ? 2 : LANE - 4), foot = RULER + (out ? LANE - 4 : 2);
    pen.fillStyle = pen.strokeStyle = out ? this.colour.out : this.colour.in;
    pen.beginPath();
    pen.moveTo(x, tip);
    pen.lineTo(x - 3.5, tip + (out ? 6 : -6));
    pen.lineTo(x + 3.5, tip + (out ? 6 : -6));
    pen.fill();
    pen.fillRect(x - .75, Math.min(tip, foot), 1.5, Math.abs(tip - foot));
  }

  row(signal, y) {
    const pen = this.pen, {start, span} = this.state, track = signal.track, end = Math.min(start + span, this.run.last + 1);
    pen.fillStyle = this.colour.grid;
    pen.fillRect(this.left, y + ROW - 1, this.width, 1);
    const from = Math.max(0, track.place(start)), to = track.place(end);
    if (to - from > 3 * this.width) {
      pen.fillStyle = this.colour.fill;
      pen.fillRect(this.left, y + 5, this.x(end) - this.left, ROW - 10);
      return;
    }
    for (let at = from; at <= to; at++) {
      const left = Math.max(this.left, this.x(track.scans[at]));
      const right = Math.min(this.x(at + 1 < track.scans.length ? Math.min(track.scans[at + 1], end) : end), this.left + this.width);
      if (right <= left && at < to) continue;
      if (signal.bit) this.bit(left, right, y, track.values[at] === "1");
      else this.value(signal, at, left, right, y, track.scans[at] > start);
    }
  }

  bit(left, right, y, on) {
    this.pen.fillStyle = on ? this.colour.on : this.colour.line;
    this.pen.fillRect(left, on ? y + 5 : y + ROW - 8, Math.max(1, right - left), on ? ROW - 11 : 2);
  }

  value(signal, at, left, right, y, edge) {
    const pen = this.pen, wide = right - left, text = signal.track.values[at];
    if (signal.levels && signal.high > signal.low) {
      const level = (ROW - 10) * (signal.levels[at] - signal.low) / (signal.high - signal.low);
      pen.fillStyle = this.colour.fill;
      pen.fillRect(left, y + ROW - 5 - level, Math.max(1, wide), level + 1);
      pen.fillStyle = this.colour.word;
      pen.fillRect(left, y + ROW - 5 - level, Math.max(1, wide), 1.5);
    } else {
      pen.strokeStyle = this.colour.line;
      pen.strokeRect(left + .5, y + 4.5, Math.max(1, wide), ROW - 9);
    }
    if (edge) {
      pen.fillStyle = this.colour.word;
      pen.fillRect(left, y + 4, 1, ROW - 8);
    }
    const room = Math.floor((wide - 5) / this.letter);
    if (room >= 1 && (room >= text.length || room >= 4)) {
      const shown = room >= text.length ? text : `${text.slice(0, room - 1)}…`;
      pen.strokeStyle = this.colour.bg;
      pen.lineWidth = 3;
      pen.strokeText(shown, left + 4, y + ROW / 2);
      pen.lineWidth = 1;
      pen.fillStyle = this.colour.fg;
      pen.fillText(shown, left + 4, y + ROW / 2);
    }
  }

  // --- fingers and wheels

  scanAt(event) {
    const x = event.clientX - this.canvas.getBoundingClientRect().left - this.left;
    return Math.floor(this.state.start + x / this.scale);
  }

  down(event) {
    if (event.offsetX < this.left) return;
    this.canvas.setPointerCapture?.(event.pointerId);
    this.fingers.set(event.pointerId, event.clientX);
    if (this.fingers.size === 1) this.move({scan: this.scanAt(event), row: -1});
  }

  drag(event) {
    if (!this.fingers.has(event.pointerId)) return;
    const before = [...this.fingers.values()];
    this.fingers.set(event.pointerId, event.clientX);
    const now = [...this.fingers.values()];
    if (now.length === 1) this.move({scan: this.scanAt(event), row: -1});
    else if (Math.abs(now[0] - now[1]) > 5) {
      const middle = this.state.start + ((now[0] + now[1]) / 2 - this.left) / this.scale;
      this.zoom(Math.abs(before[0] - before[1]) / Math.abs(now[0] - now[1]), middle);
    }
  }

  wheel(event) {
    if (event.ctrlKey || event.metaKey) {
      event.preventDefault();
      this.zoom(Math.exp(event.deltaY / 200), this.state.start + (event.offsetX - this.left) / this.scale);
    } else if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
      event.preventDefault();
      this.move({start: this.state.start + (event.deltaX || event.deltaY) / this.scale});
    }
  }

  zoom(factor, around = this.state.scan + .5) {
    const span = Math.min(Math.max(this.state.span * factor, 5), Math.max(5, this.run.count));
    this.move({start: around - (around - this.state.start) * span / this.state.span, span});
  }
}

// The time chart: a canvas as large as what is in view, names beside it.

const RULER = 38, LANE = 18;
const PICTURE_MS = 8, LABELS_MS = 4;
const FEW_PARTS = 8;
const NAMES = 8;

class Chart {
  constructor(run, state, move) {
    this.run = run;
    this.state = state;
    this.move = move;
    this.canvas = document.getElementById("canvas");
    this.scroll = document.getElementById("scroll");
    this.spacer = document.getElementById("spacer");
    this.labels = document.getElementById("labels");
    this.head = RULER + (run.packets.length ? LANE : 0);
    document.getElementById("lane").hidden = !run.packets.length;
    document.getElementById("corner").style.height = `${this.head}px`;
    this.shown = [];
    this.old = new Set();
    this.scroll.addEventListener("scroll", () => this.move({}));
    new ResizeObserver(() => { if (this.drawn !== this.size) this.draw(); }).observe(this.scroll);  // it calls once at the beginning
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
    this.fingers = new Map();
    this.canvas.addEventListener("pointerdown", event => this.down(event));
    this.canvas.addEventListener("pointermove", event => this.drag(event));
    for (const name of ["pointerup", "pointercancel"]) this.canvas.addEventListener(name, event => this.fingers.delete(event.pointerId));
    this.canvas.addEventListener("wheel", event => this.wheel(event), {passive: false});
  }

  get size() { return `${this.scroll.clientWidth} x ${this.scroll.clientHeight}`; }
  get left() { return this.labels.offsetWidth; }
  get width() { return Math.max(50, this.scroll.clientWidth - this.left); }
  get scale() { return this.width / this.state.span; }
  x(scan) { return this.left + (scan - this.state.start) * this.scale; }

  // --- what is chosen

  /** Takes the signals that the filter lets through; `values` makes the rows with their names. */
  choose() {
    const words = this.state.filter.toLowerCase().split(/\s+/).filter(Boolean), start = this.run.place(Math.floor(this.state.start));
    const end = this.run.place(Math.ceil(this.state.start + this.state.span) - 1) + 1;
    this.shown = this.run.signals.map((_, number) => number).filter(number => {
      const signal = this.run.signals[number], text = `${signal.name} ${signal.said}`.toLowerCase();
      if (!words.every(word => text.includes(word))) return false;
      if (!this.state.moving) return true;
      signal.column.extremes(start, end);
      return signal.column.least !== signal.column.most;
    });
    this.labels.replaceChildren();
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

  /** Writes the values at the cursor beside the names: of the rows in view at once, of the others, and these themselves, when
   * there is time; true if some are left. */
  values(moved) {
    const rows = this.labels.children, top = Math.floor(this.scroll.scrollTop / ROW), seen = Math.ceil(this.scroll.clientHeight / ROW);
    const until = performance.now() + LABELS_MS;
    this.name(top + seen + 1);
    if (moved) this.old = new Set(rows);
    for (let at = top; at <= top + seen && at < rows.length; at++) this.write(rows[at]);
    for (const row of this.old) {
      if (performance.now() > until) break;
      this.write(row);
    }
    while (rows.length < this.shown.length && performance.now() < until) this.name(rows.length + NAMES);
    return !this.isWritten;
  }

  /** Makes the rows before number `end` that are not there. */
  name(end) {
    const made = this.shown.slice(this.labels.children.length, end).map((number, at) => this.label(number, this.labels.children.length + at));
    for (const row of made) this.old.add(row);
    this.labels.append(...made);
  }

  get isWritten() { return this.old.size === 0 && this.labels.children.length === this.shown.length; }

  write(row) {
    if (!this.old.delete(row)) return;
    const number = Number(row.dataset.signal), signal = this.run.signals[number];
    const text = this.run.text(number, this.state.scan, this.state.row), value = row.children[1], shown = this.run.show(signal, text);
    if (value.textContent !== shown) value.textContent = shown;
    value.className = signal.bit && text === "1" ? "on" : "";
    row.classList.toggle("chosen", number === this.state.chosen);
  }

  // --- what is drawn

  /** Draws what is in view; true if it is drawn roughly, because there was no time to unpack all of it. */
  draw() {
    const wide = this.scroll.clientWidth, high = this.scroll.clientHeight, dots = devicePixelRatio || 1;
    if (!wide || !high) return false;
    this.drawn = this.size;
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
    this.run.columns.hurry(PICTURE_MS);
    const drawing = new Drawing(pen, this.colour, this.letter, this.run), {start, span} = this.state;
    for (let at = from; at < this.shown.length && at * ROW - top < high; at++) {
      drawing.row(this.run.signals[this.shown[at]], this.head + at * ROW - top, this.left, this.left + this.width, start, span);
    }
    const isRough = this.run.columns.isRough;
    this.run.columns.hurry(Infinity);
    pen.restore();
    const x = this.x(this.state.scan), broad = Math.max(2, this.scale);
    pen.fillStyle = this.colour.band;
    pen.fillRect(x, 0, broad, high);
    pen.fillStyle = this.colour.cursor;
    pen.fillRect(x, 0, broad > 6 ? 1.5 : 1, high);
    pen.restore();
    return isRough;
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
    pen.fillStyle = this.colour.cursor;
    for (const window of this.run.windows) {
      const from = Math.max(this.left, this.x(window.first)), to = Math.min(this.left + this.width, this.x(window.last + 1));
      if (to >= from) pen.fillRect(from, RULER - 3, Math.max(2, to - from), 2);
    }
    this.packets();
  }

  /** Arrows where packets passed, or a bar where that were very many. */
  packets() {
    const {run, pen} = this, right = this.left + this.width, seen = run.data.frames
      .map(([first, last], part) => [this.x(first), this.x(last + 1), part]).filter(([from, to]) => to >= this.left && from <= right);
    if (seen.length > FEW_PARTS) {
      pen.fillStyle = this.colour.out;
      for (const [from, to] of seen) pen.fillRect(Math.max(this.left, from), RULER + 5, Math.max(1, Math.min(to, right) - Math.max(this.left, from)), 7);
      return;
    }
    let until = -Infinity;
    for (const [, , part] of seen) {
      const frames = run.frames(part);
      for (let at = 0, next; at < frames.length; at = next) {
        const scan = frames[at].scan, x = this.x(scan + .5);
        let out = 0;
        for (next = at; next < frames.length && frames[next].scan === scan; next++) out += frames[next].out;
        if (x < this.left - 8 || x > right || x < until) continue;
        if (out) this.arrow(x - (out < next - at ? 4 : 0), true);
        if (out < next - at) this.arrow(x + (out ? 4 : 0), false);
        until = x + 1;
      }
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

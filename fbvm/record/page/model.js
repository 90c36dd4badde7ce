// The run: what every variable and word was in every scan.  Knows nothing of the page.

function showTime(ns) {
  const ms = ns / 1e6;
  if (ms < 1000) return `${+ms.toFixed(3)} ms`;
  return `${+(ms / 1000).toFixed(3)} s`;
}

/** A duration in nanoseconds, a BigInt, as a literal without its prefix: 1m2s50ms. */
function durationText(ns) {
  let rest = ns < 0n ? -ns : ns, text = "";
  for (const [unit, size] of [["d", 86400000000000n], ["h", 3600000000000n], ["m", 60000000000n], ["s", 1000000000n], ["ms", 1000000n],
                              ["us", 1000n], ["ns", 1n]]) {
    if (rest >= size) text += `${rest / size}${unit}`;
    rest %= size;
  }
  return (ns < 0n ? "-" : "") + (text || "0s");
}

/** A number with a fraction as fbvm writes it: 0.1, 1.0, 1e-05, 1e+16, inf, nan; of 32 bits the shortest text. */
function realText(value, isSingle) {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "nan" : value < 0 ? "-inf" : "inf";
  if (isSingle && value !== 0) {
    for (let digits = 1; digits < 10; digits++) {
      const short = Number(value.toPrecision(digits));
      if (Math.fround(short) === value) {
        value = short;
        break;
      }
    }
  }
  const [, sign, one, more = "", power] = value.toExponential().match(/^(-?)(\d)(?:\.(\d+))?e([+-]\d+)$/), exponent = Number(power);
  const front = sign || (Object.is(value, -0) ? "-" : ""), digits = one + more;
  if (exponent < -4 || exponent >= 16) {
    return `${front}${one}${more && "." + more}e${exponent < 0 ? "-" : "+"}${String(Math.abs(exponent)).padStart(2, "0")}`;
  }
  if (exponent < 0) return `${front}0.${"0".repeat(-exponent - 1)}${digits}`;
  const whole = digits.slice(0, exponent + 1).padEnd(exponent + 1, "0");
  return `${front}${whole}.${digits.slice(exponent + 1) || "0"}`;
}

/** A variable or an address: its column, and how its values are written. */
class Signal {
  constructor(row, column) {
    this.name = row.name;
    this.said = row.said;
    this.bit = row.bit === 1;
    this.column = column;
    this.form = row.form;
    this.texts = row.texts;
    const plain = !this.bit && column.code !== "text" && !Object.keys(row.texts).length;
    [this.low, this.high] = plain ? column.range() : [0, 0];
    this.isLevel = plain && this.high > this.low;
  }

  write(value) {
    if (this.column.texts) return this.column.texts[value];
    const known = this.texts[value];
    if (known !== undefined) return known;
    const {code, bytes} = this.column;
    if (this.form === "hex") return `${BigInt.asUintN(8 * bytes, BigInt(value)).toString(16).toUpperCase().padStart(2 * bytes, "0")}h`;
    if (this.form === "time") return durationText(BigInt(value));
    return code === "f32" || code === "f64" ? realText(value, code === "f32") : String(value);
  }
}

class Run {
  constructor(head, bytes) {
    this.data = head;
    [this.first, this.count] = head.scans;
    this.last = this.first + this.count - 1;
    let at = 0;
    const parts = head.parts.map(size => bytes.subarray(at, at += size)), take = count => parts.splice(0, count);
    const [index] = take(1);
    this.windows = take(head.windows.length).map((packed, number) => ({first: head.windows[number][0], last: head.windows[number][1], packed}));
    this.pictures = take(Math.ceil(head.pictures / head.pictures_a_part));
    this.packets = take(head.frames.length);
    this.columns = new Columns(head, inflate(index), bytes.subarray(at));
    const list = this.columns.list;
    this.signals = head.signals.map(row => new Signal(row, list[row.cell]));
    this.words = {};
    for (const area of new Set([...Object.keys(head.words), ...Object.keys(head.constants)])) {
      this.words[area] = new Map(Object.entries(head.constants[area] ?? {}).map(([word, value]) => [Number(word), value]));
      for (const [word, number] of Object.entries(head.words[area] ?? {})) this.words[area].set(Number(word), list[number]);
    }
  }

  /** The place of a scan among all that there are. */
  place(scan) { return Math.min(Math.max(scan - this.first, 0), Math.max(0, this.count - 1)); }

  time(scan) { return this.count ? Number(this.columns.list[0].at(this.place(scan))) : 0; }

  // --- what happened inside

  window(scan) {
    const found = this.windows.find(window => window.first <= scan && scan <= window.last);
    if (found) found.inside ??= inflateJson(found.packed);
    return found?.inside;
  }

  rows(scan) { return this.window(scan)?.rows[scan] ?? []; }

  ladder(scan) { return this.window(scan)?.ladder[scan] ?? []; }

  picture(number) {
    const part = Math.floor(number / this.data.pictures_a_part);
    if (!Array.isArray(this.pictures[part])) this.pictures[part] = inflateJson(this.pictures[part]);
    return this.pictures[part][number % this.data.pictures_a_part];
  }

  // --- packets

  /** The packets of a part of them. */
  frames(part) {
    if (!Array.isArray(this.packets[part])) {
      this.packets[part] = inflateJson(this.packets[part])
        .map(([scan, ns, sender, receiver, said, hex]) => ({scan, ns, sender, receiver, said, hex, out: sender === this.data.own}));
    }
    return this.packets[part];
  }

  // --- values

  show(signal, text) { return text === undefined ? "" : signal.bit ? (text === "1" ? "TRUE" : "FALSE") : text; }

  /** What a variable was after so many rows of a scan; at its end if `row` is negative. */
  text(number, scan, row = -1) {
    if (!this.count) return undefined;
    const signal = this.signals[number];
    if (row < 0) return signal.write(signal.column.at(this.place(scan)));
    let text = signal.write(signal.column.at(this.place(scan - 1)));
    for (const [, , ...moved] of this.rows(scan).slice(0, row + 1)) {
      for (let at = 0; at < moved.length; at += 2) if (moved[at] === number) text = moved[at + 1];
    }
    return text;
  }

  word(area, address, scan) {
    const found = this.words[area]?.get(address) ?? 0;
    return found instanceof Column ? found.at(this.place(scan)) : found;
  }

  wordMoved(area, address, scan) { return scan > this.first && this.word(area, address, scan) !== this.word(area, address, scan - 1); }

  /** The scan of the next change of a variable in a direction, or the same scan. */
  change(number, scan, direction) {
    const {column} = this.signals[number], place = scan - this.first;
    const found = direction > 0 ? column.next(place + 1) : column.last(place - 1);
    return found < 0 ? scan : found + this.first;
  }
}

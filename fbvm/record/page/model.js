"use strict";
// The run: what every variable and word was in every scan.  Knows nothing of the page.

/** Values that are written when they change: [scan, value, scan, value, ...]. */
class Track {
  constructor(changes) {
    this.scans = changes.filter((_, at) => at % 2 === 0);
    this.values = changes.filter((_, at) => at % 2 === 1);
  }

  /** The place of the last change at or before a scan, -1 if there is none. */
  place(scan) {
    let low = 0, high = this.scans.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.scans[middle] <= scan) low = middle + 1; else high = middle;
    }
    return low - 1;
  }

  at(scan) {
    const place = this.place(scan);
    return place < 0 ? undefined : this.values[place];
  }

  changedIn(scan) {
    const place = this.place(scan);
    return place > 0 && this.scans[place] === scan;
  }
}

/** The number that a text shows, for drawing it: 12, -1.5, A000h, 1m2s50ms; NaN for what is none. */
function numberOf(text) {
  if (/^[0-9A-F]{4}h$/.test(text)) return parseInt(text, 16);
  const units = {d: 864e5, h: 36e5, m: 6e4, s: 1e3, ms: 1, us: 1e-3, ns: 1e-6};
  if (/^-?(\d+(\.\d+)?(ms|us|ns|d|h|m|s))+$/.test(text)) {
    let sum = 0;
    for (const [, size, , unit] of text.matchAll(/(\d+(\.\d+)?)(ms|us|ns|d|h|m|s)/g)) sum += Number(size) * units[unit];
    return text.startsWith("-") ? -sum : sum;
  }
  return text === "" ? NaN : Number(text);
}

function showTime(ns) {
  const ms = ns / 1e6;
  if (ms < 1000) return `${+ms.toFixed(3)} ms`;
  return `${+(ms / 1000).toFixed(3)} s`;
}

class Run {
  constructor(data) {
    this.data = data;
    [this.first, this.count] = data.scans;
    this.last = this.first + this.count - 1;
    let now = 0;
    this.times = data.times.map(step => now += step);
    this.signals = data.signals.map(row => {
      const track = new Track(row.changes);
      const levels = row.bit ? [] : track.values.map(numberOf);
      const plain = levels.length > 0 && levels.every(Number.isFinite);
      return {name: row.name, bit: row.bit === 1, said: row.said, track, levels: plain ? levels : null,
              low: plain ? Math.min(...levels.slice(0, 1e5)) : 0, high: plain ? Math.max(...levels.slice(0, 1e5)) : 0};
    });
    this.words = {};
    for (const [area, rows] of Object.entries(data.words)) {
      this.words[area] = new Map(Object.entries(rows).map(([at, changes]) => [Number(at), new Track(changes)]));
    }
    this.frames = data.frames.map(([scan, ns, sender, receiver, said, hex]) => ({scan, ns, sender, receiver, said, hex}));
  }

  time(scan) { return this.times[Math.min(Math.max(scan - this.first, 0), this.count - 1)] ?? 0; }

  rows(scan) { return this.data.rows[scan] ?? []; }

  show(signal, text) { return text === undefined ? "" : signal.bit ? (text === "1" ? "TRUE" : "FALSE") : text; }

  /** What a variable was after so many rows of a scan; at its end if `row` is negative. */
  text(number, scan, row = -1) {
    const track = this.signals[number].track;
    if (row < 0) return track.at(scan);
    let text = track.at(scan - 1) ?? track.values[0];
    for (const [, , ...moved] of this.rows(scan).slice(0, row + 1)) {
      for (let at = 0; at < moved.length; at += 2) if (moved[at] === number) text = moved[at + 1];
    }
    return text;
  }

  word(area, address, scan) { return this.words[area]?.get(address)?.at(scan) ?? 0; }

  wordMoved(area, address, scan) { return this.words[area]?.get(address)?.changedIn(scan) ?? false; }

  /** The scan of the next change of a variable in a direction, or the same scan. */
  change(number, scan, direction) {
    const track = this.signals[number].track, place = track.place(direction > 0 ? scan : scan - 1);
    const to = direction > 0 ? track.scans[place + 1] : place > 0 ? track.scans[place] : undefined;
    return to ?? scan;
  }
}

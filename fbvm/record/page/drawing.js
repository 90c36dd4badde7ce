// How the values of one signal are drawn: scan by scan where there is room, else a column of the picture for several scans.

const ROW = 26;
const MOST_SCANS_A_DOT = .5;

class Drawing {
  /** `x` gives the place of a scan in the picture, `from` and `to` are those that are seen, of all that there are. */
  constructor(pen, colour, letter, run) {
    Object.assign(this, {pen, colour, letter, run});
  }

  /** Draws a signal between left and right; `start` and `span` are the scans in view. */
  row(signal, y, left, right, start, span) {
    const {pen, run} = this, scale = (right - left) / span;
    pen.fillStyle = this.colour.grid;
    pen.fillRect(left, y + ROW - 1, right - left, 1);
    if (!run.count) return;
    const from = Math.max(0, Math.floor(start - run.first)), to = Math.min(run.count, Math.ceil(start - run.first + span));
    const x = place => Math.min(right, Math.max(left, left + (place + run.first - start) * scale));
    if (span <= MOST_SCANS_A_DOT * (right - left)) this.exact(signal, y, from, to, x);
    else this.rough(signal, y, from, to, x);
  }

  exact(signal, y, from, to, x) {
    const {column} = signal;
    for (let at = from; at < to;) {
      const next = column.next(at + 1, to), end = next < 0 || next > to ? to : next;
      this.piece(signal, y, x(at), x(end), column.at(at), at > from);
      at = end;
    }
  }

  /** One column of dots after another; neighbours with the same single value are one piece. */
  rough(signal, y, from, to, x) {
    const step = (to - from) / Math.max(1, Math.round(x(to) - x(from))), {column} = signal, busy = [];
    let begun = -1, held = NaN;
    const end = at => {
      if (begun < 0) return;
      const left = x(begun), right = x(at);
      if (signal.isLevel && right - left < 1.5) busy.push(left, held, held);
      else this.piece(signal, y, left, right, column.at(begun), begun > from);
      begun = -1;
    };
    for (let at = from; at < to; at += step) {
      const first = Math.floor(at);
      column.extremes(first, Math.min(to, Math.max(first + 1, Math.floor(at + step))));
      const low = column.least, high = column.most;
      if (low === high) {
        if (begun >= 0 && low !== held) end(first);
        if (begun < 0) begun = first;
        held = low;
        continue;
      }
      end(first);
      busy.push(x(first), low, high);
    }
    end(to);
    this.busy(signal, y, busy);
  }

  /** Columns of dots in which a signal had several values: x, least, greatest value, x, ...  One colour after the other. */
  busy(signal, y, columns) {
    const {pen} = this, foot = y + ROW - 5;
    if (signal.isLevel) {
      pen.fillStyle = this.colour.fill;
      for (let at = 0; at < columns.length; at += 3) {
        const top = this.level(signal, columns[at + 2]);
        pen.fillRect(columns[at], foot - top, 1, top + 1);
      }
      pen.fillStyle = this.colour.word;
      for (let at = 0; at < columns.length; at += 3) {
        const top = this.level(signal, columns[at + 2]);
        pen.fillRect(columns[at], foot - top, 1, Math.max(1.5, top - this.level(signal, columns[at + 1])));
      }
    } else {
      pen.fillStyle = signal.bit ? this.colour.on : this.colour.word;
      pen.globalAlpha = .45;
      for (let at = 0; at < columns.length; at += 3) pen.fillRect(columns[at], y + 5, 1, ROW - 11);
      pen.globalAlpha = 1;
    }
  }

  level(signal, value) { return (ROW - 10) * (Number(value) - signal.low) / (signal.high - signal.low); }

  piece(signal, y, left, right, value, edge) {
    if (right <= left) return;
    if (signal.bit) {
      this.pen.fillStyle = value ? this.colour.on : this.colour.line;
      this.pen.fillRect(left, value ? y + 5 : y + ROW - 8, Math.max(1, right - left), value ? ROW - 11 : 2);
    } else this.value(signal, y, left, right, value, edge);
  }

  value(signal, y, left, right, value, edge) {
    const {pen} = this, wide = right - left;
    if (signal.isLevel) {
      const level = this.level(signal, value);
      if (Number.isFinite(level)) {
        pen.fillStyle = this.colour.fill;
        pen.fillRect(left, y + ROW - 5 - level, Math.max(1, wide), level + 1);
        pen.fillStyle = this.colour.word;
        pen.fillRect(left, y + ROW - 5 - level, Math.max(1, wide), 1.5);
      }
    } else {
      pen.strokeStyle = this.colour.line;
      pen.strokeRect(left + .5, y + 4.5, Math.max(1, wide), ROW - 9);
    }
    if (edge && (wide > 4 || !signal.isLevel)) {
      pen.fillStyle = this.colour.word;
      pen.fillRect(left, y + 4, 1, ROW - 8);
    }
    const room = Math.floor((wide - 5) / this.letter);
    if (room < 1) return;
    const text = signal.write(value);
    if (room < text.length && room < 4) return;
    const shown = room >= text.length ? text : `${text.slice(0, room - 1)}…`;
    pen.strokeStyle = this.colour.bg;
    pen.lineWidth = 3;
    pen.strokeText(shown, left + 4, y + ROW / 2);
    pen.lineWidth = 1;
    pen.fillStyle = this.colour.fg;
    pen.fillText(shown, left + 4, y + ROW / 2);
  }
}

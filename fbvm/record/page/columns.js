// The columns of the page: the value of a cell at the end of each scan, in blocks that are unpacked when somebody looks at them.
// A scan is meant by its place here: 0 is the first one.  `record/page/columns.py` writes what is read here.

const ARRAYS = {bit: Uint8Array, i8: Int8Array, u8: Uint8Array, i16: Int16Array, u16: Uint16Array, i32: Int32Array, u32: Uint32Array,
                i64: BigInt64Array, u64: BigUint64Array, f32: Float32Array, f64: Float64Array, text: Uint32Array};
const GROUP = 16;
const MOST_UNPACKED = 96 << 20;

/** The least and greatest values of groups of a block's scans: a chart needs no more of them. */
function groups(values) {
  const count = Math.ceil(values.length / GROUP), low = new Float64Array(count), high = new Float64Array(count);
  for (let group = 0; group < count; group++) {
    let least = Infinity, most = -Infinity;
    for (let at = group * GROUP, end = Math.min(at + GROUP, values.length); at < end; at++) {
      const value = Number(values[at]);
      if (value < least) least = value;
      if (value > most) most = value;
    }
    low[group] = least;
    high[group] = most;
  }
  return {low, high};
}

/** Sums up differences where they stand; `first` is the first value. */
function sum(bytes, size, first) {
  if (size === 8) {
    const parts = new Uint32Array(bytes.buffer), start = new Uint32Array(first.buffer.slice(first.byteOffset, first.byteOffset + 8));
    let [low, high] = start;
    for (let at = 0; at < parts.length; at += 2) {
      const next = low + parts[at];
      high = high + parts[at + 1] + (next > 0xFFFFFFFF ? 1 : 0) >>> 0;
      low = next >>> 0;
      parts[at] = low;
      parts[at + 1] = high;
    }
    return;
  }
  const whole = new {1: Uint8Array, 2: Uint16Array, 4: Uint32Array}[size](bytes.buffer);
  let value = 0;
  for (let at = 0; at < size; at++) value |= first[at] << 8 * at;
  for (let at = 0; at < whole.length; at++) whole[at] = value = value + whole[at];
}

/** All columns, and what of them is unpacked. */
class Columns {
  constructor(head, index, streams) {
    this.streams = streams;
    this.starts = [0];
    for (const count of head.blocks) this.starts.push(this.starts.at(-1) + count);
    this.blocks = head.blocks.length;
    this.count = this.starts.at(-1);
    this.even = head.blocks[0] ?? 1;
    const varying = head.columns.filter(column => column.value === undefined).length, rows = varying * this.blocks;
    const part = (from, size) => index.slice(from * rows, (from + size) * rows).buffer;
    this.lengths = new Uint32Array(part(0, 4));
    this.firsts = new Uint8Array(part(4, 8));
    this.low = new Float64Array(part(12, 8));
    this.high = new Float64Array(part(20, 8));
    this.offsets = new Float64Array(rows);
    for (let block = 0, offset = 0; block < this.blocks; block++) {
      for (let at = block; at < rows; at += this.blocks) {
        this.offsets[at] = offset;
        offset += this.lengths[at];
      }
    }
    this.unpacked = new Map();
    this.size = 0;
    this.left = Infinity;
    this.isRough = false;
    let row = 0;
    this.list = head.columns.map(column => new Column(this, column, column.value === undefined ? row++ * this.blocks : -1));
  }

  /** The block of a scan: all blocks but the last mostly have the same length. */
  block(scan) {
    let low = 0, high = this.blocks - 1;
    const guess = Math.floor(scan / this.even);
    if (guess <= high && this.starts[guess] <= scan && scan < this.starts[guess + 1]) return guess;
    while (low < high) {
      const middle = low + high + 1 >> 1;
      if (this.starts[middle] <= scan) low = middle; else high = middle - 1;
    }
    return low;
  }

  /** So long blocks are unpacked for a picture; what is drawn then is drawn roughly, and `isRough` says so. */
  hurry(milliseconds) {
    this.left = milliseconds;
    this.isRough = false;
  }
}

class Column {
  constructor(columns, head, row) {
    this.columns = columns;
    this.code = head.code;
    this.texts = head.texts;
    this.row = row;
    this.array = ARRAYS[head.code];
    this.bytes = this.array.BYTES_PER_ELEMENT;
    if (row < 0) this.only = this.one(Uint8Array.from(head.value.match(/../g) ?? [], pair => parseInt(pair, 16)));
  }

  one(bytes) { return new this.array(bytes.slice(0, this.bytes).buffer)[0]; }

  /** The values of a block; null if it has only one. */
  unpack(block) {
    const {columns, row} = this, at = row + block;
    if (row < 0 || !columns.lengths[at]) return null;
    let found = columns.unpacked.get(at);
    if (found) columns.unpacked.delete(at);
    else {
      const begun = performance.now(), count = columns.starts[block + 1] - columns.starts[block], offset = columns.offsets[at];
      const bytes = inflate(columns.streams.subarray(offset, offset + columns.lengths[at]), count * this.bytes);
      sum(bytes, this.bytes, columns.firsts.subarray(8 * at, 8 * at + 8));
      found = {values: new this.array(bytes.buffer), groups: null};
      columns.size += bytes.length;
      columns.left -= performance.now() - begun;
      for (const [other, old] of columns.unpacked) {
        if (columns.size < MOST_UNPACKED) break;
        columns.unpacked.delete(other);
        columns.size -= old.values.byteLength;
      }
    }
    columns.unpacked.set(at, found);
    return found;
  }

  first(block) {
    if (this.row < 0) return this.only;
    const at = 8 * (this.row + block);
    return this.one(this.columns.firsts.slice(at, at + 8));
  }

  at(scan) {
    if (this.row < 0) return this.only;
    const block = this.columns.block(scan), found = this.unpack(block);
    return found ? found.values[scan - this.columns.starts[block]] : this.first(block);
  }

  /** Finds the least and the greatest value from one scan to before another: `least` and `most`.
   *
   * Of a block in part it takes those of the whole block, if that has to be quick, or if there are as many scans as in a block;
   * of a group in part those of the whole group, if there are several groups: a dot of a chart shows no less. */
  extremes(from, to) {
    this.least = this.most = Number(this.only);
    if (this.row < 0) return;
    const {columns, row} = this, isMany = to - from >= columns.even, byGroups = to - from >= 2 * GROUP;
    let low = Infinity, high = -Infinity;
    for (let block = columns.block(from); block < columns.blocks && columns.starts[block] < to; block++) {
      const start = columns.starts[block], end = columns.starts[block + 1], at = row + block;
      if (isMany || from <= start && to >= end || !columns.lengths[at] || !this.isNear(at)) {
        if (columns.low[at] < low) low = columns.low[at];
        if (columns.high[at] > high) high = columns.high[at];
        continue;
      }
      const found = this.unpack(block), values = found.values, last = Math.min(to, end) - start;
      found.groups ??= groups(values);
      for (let place = Math.max(0, from - start); place < last;) {
        if (byGroups || place % GROUP === 0 && place + GROUP <= last) {
          const group = place / GROUP | 0;
          if (found.groups.low[group] < low) low = found.groups.low[group];
          if (found.groups.high[group] > high) high = found.groups.high[group];
          place = (group + 1) * GROUP;
        } else {
          const value = Number(values[place++]);
          if (value < low) low = value;
          if (value > high) high = value;
        }
      }
    }
    this.least = low;
    this.most = high;
  }

  /** True if a block is unpacked, or there is time for it. */
  isNear(at) {
    if (this.columns.unpacked.has(at) || this.columns.left > 0) return true;
    this.columns.isRough = true;
    return false;
  }

  /** The least and the greatest value of the whole run. */
  range() {
    if (this.row < 0) return [Number(this.only), Number(this.only)];
    const {low, high, blocks} = this.columns;
    let least = Infinity, most = -Infinity;
    for (let at = this.row; at < this.row + blocks; at++) {
      if (low[at] < least) least = low[at];
      if (high[at] > most) most = high[at];
    }
    return [least, most];
  }

  /** The next scan from one on, that included, with another value than the scan before it; -1 if there is none before `until`. */
  next(scan, until = this.columns.count) {
    if (this.row < 0) return -1;
    const {columns} = this;
    for (let at = Math.max(1, scan); at < until;) {
      const block = columns.block(at), start = columns.starts[block];
      if (at === start && !same(this.at(at), this.at(at - 1))) return at;
      const found = this.unpack(block);
      if (found) {
        for (let place = Math.max(1, at - start); place < found.values.length; place++) {
          if (!same(found.values[place], found.values[place - 1])) return start + place;
        }
      }
      at = columns.starts[block + 1];
    }
    return -1;
  }

  /** The last scan up to one, that included, with another value than the scan before it; -1 if there is none. */
  last(scan) {
    if (this.row < 0) return -1;
    const {columns} = this;
    for (let at = Math.min(scan, columns.count - 1); at > 0;) {
      const block = columns.block(at), start = columns.starts[block], found = this.unpack(block);
      if (found) {
        for (let place = at - start; place > 0; place--) {
          if (!same(found.values[place], found.values[place - 1])) return start + place;
        }
      }
      if (start && !same(this.at(start), this.at(start - 1))) return start;
      at = start - 1;
    }
    return -1;
  }
}

/** Equal values; a value that is no number is equal to itself. */
function same(one, other) { return one === other || one !== one && other !== other; }

"use strict";
// Unpacks raw deflate streams (RFC 1951), at once: a picture that is being drawn cannot wait for DecompressionStream.

const LENGTH_BASE = [3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 15, 17, 19, 23, 27, 31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258];
const LENGTH_BITS = [0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0];
const AWAY_BASE = [1, 2, 3, 4, 5, 7, 9, 13, 17, 25, 33, 49, 65, 97, 129, 193, 257, 385, 513, 769, 1025, 1537, 2049, 3073, 4097, 6145,
                   8193, 12289, 16385, 24577];
const AWAY_BITS = [0, 0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 8, 9, 9, 10, 10, 11, 11, 12, 12, 13, 13];
const CODE_ORDER = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];

/** The Huffman codes of these lengths (3.2.2): by the next bits, 16 * symbol + length. */
function codes(lengths) {
  const bits = Math.max(1, ...lengths), rows = new Uint16Array(1 << bits), count = new Uint16Array(17), next = new Uint16Array(17);
  for (const length of lengths) count[length]++;
  count[0] = 0;
  for (let at = 1; at <= 16; at++) next[at] = next[at - 1] + count[at - 1] << 1;
  lengths.forEach((length, symbol) => {
    if (!length) return;
    let code = next[length]++, turned = 0;
    for (let at = 0; at < length; at++, code >>= 1) turned = turned << 1 | code & 1;
    for (let at = turned; at < rows.length; at += 1 << length) rows[at] = symbol << 4 | length;
  });
  return {bits, mask: (1 << bits) - 1, rows};
}

const FIXED = [codes(Array.from({length: 288}, (_, at) => at < 144 ? 8 : at < 256 ? 9 : at < 280 ? 7 : 8)), codes(Array(30).fill(5))];

class Inflater {
  constructor(packed, size) {
    this.packed = packed;
    this.out = new Uint8Array(size || Math.max(1024, packed.length * 8));
    this.place = this.at = this.held = this.count = 0;
  }

  bits(count) {
    while (this.count < count) {
      this.held |= this.packed[this.place++] << this.count;
      this.count += 8;
    }
    const value = this.held & (1 << count) - 1;
    this.held >>>= count;
    this.count -= count;
    return value;
  }

  symbol(table) {
    while (this.count < table.bits) {
      this.held |= this.packed[this.place++] << this.count;
      this.count += 8;
    }
    const row = table.rows[this.held & table.mask];
    this.held >>>= row & 15;
    this.count -= row & 15;
    return row >> 4;
  }

  room(size) {
    if (this.at + size <= this.out.length) return;
    const larger = new Uint8Array(Math.max(this.at + size, this.out.length * 2));
    larger.set(this.out);
    this.out = larger;
  }

  /** The codes of literals and distances that stand at the head of a block (3.2.7). */
  tables() {
    const literals = this.bits(5) + 257, distances = this.bits(5) + 1, order = Array(19).fill(0), lengths = [];
    for (let at = 0, count = this.bits(4) + 4; at < count; at++) order[CODE_ORDER[at]] = this.bits(3);
    const table = codes(order);
    while (lengths.length < literals + distances) {
      const symbol = this.symbol(table);
      if (symbol < 16) lengths.push(symbol);
      else {
        const value = symbol === 16 ? lengths[lengths.length - 1] : 0;
        let times = symbol === 16 ? 3 + this.bits(2) : symbol === 17 ? 3 + this.bits(3) : 11 + this.bits(7);
        while (times--) lengths.push(value);
      }
    }
    return [codes(lengths.slice(0, literals)), codes(lengths.slice(literals))];
  }

  block([literals, distances]) {
    for (;;) {
      if (this.place > this.packed.length + 8) throw new Error("the data of this page are cut off");
      const symbol = this.symbol(literals);
      if (symbol === 256) return;
      if (symbol < 256) {
        this.room(1);
        this.out[this.at++] = symbol;
        continue;
      }
      const length = LENGTH_BASE[symbol - 257] + this.bits(LENGTH_BITS[symbol - 257]), away = this.symbol(distances);
      const from = this.at - AWAY_BASE[away] - this.bits(AWAY_BITS[away]);
      this.room(length);
      for (let at = 0; at < length; at++) this.out[this.at++] = this.out[from + at];
    }
  }

  stored() {
    this.place -= this.count >> 3;
    this.held = this.count = 0;
    const size = this.packed[this.place] | this.packed[this.place + 1] << 8;
    this.room(size);
    this.out.set(this.packed.subarray(this.place + 4, this.place + 4 + size), this.at);
    this.at += size;
    this.place += 4 + size;
  }

  all() {
    for (let last = 0; !last;) {
      last = this.bits(1);
      const kind = this.bits(2);
      if (kind === 0) this.stored();
      else this.block(kind === 1 ? FIXED : this.tables());
    }
    return this.out.subarray(0, this.at);
  }
}

/** What a raw deflate stream holds; `size` is about how many bytes, if known. */
function inflate(packed, size = 0) { return new Inflater(packed, size).all(); }

function inflateJson(packed) { return JSON.parse(new TextDecoder().decode(inflate(packed))); }

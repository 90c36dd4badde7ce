// The memory panel: 200 words of an area; what has changed is marked.

import { at, make, options } from "/dom.js";

export class MemoryPanel {
  constructor(page) {
    this.page = page;
    this.words = [];
    for (const id of ["area", "first"]) at(id).addEventListener("change", () => { this.words = []; page.look(); });
    at("form").addEventListener("change", () => this.draw());
  }

  begin(plc) {
    options(at("area"), Object.keys(plc.areas), at("area").value || "D");
    this.areas = plc.areas;
    this.words = [];
  }

  seen() {
    return { memory: at("area").value, first: Math.max(0, Math.min(Number(at("first").value) || 0, this.areas[at("area").value] - 1)) };
  }

  update(update) {
    if (!update.memory) return;
    this.before = this.words;
    this.words = update.memory.words;
    this.forced = new Set(update.memory.forced);
    this.from = update.memory.first;
    this.draw();
  }

  // Which statement gave the word its value: the answer stands in Watch.
  why(word) {
    this.page.open("watch");
    this.page.panels.watch.why(`${at("area").value}${word}`);
  }

  draw() {
    const form = at("form").value;
    const shown = (word) => form === "t" ? [word >> 8, word & 255].map((one) => one > 31 && one < 127 ? String.fromCharCode(one) : ".").join("")
      : word.toString(Number(form)).toUpperCase().padStart(form === "16" ? 4 : form === "2" ? 16 : 1, "0");
    const isNarrow = matchMedia("(max-width: 45rem)").matches;
    const wide = form === "2" ? (isNarrow ? 2 : 4) : isNarrow ? 5 : 10;
    const rows = [];
    for (let row = 0; row < this.words.length; row += wide) {
      rows.push(make("tr", {}, make("th", { scope: "row" }, `${at("area").value}${this.from + row}`),
        ...this.words.slice(row, row + wide).map((word, number) => make("td", {
          class: [word ? "" : "zero", this.forced.has(row + number) ? "forced" : "", this.before?.length && this.before[row + number] !== word ? "moved" : ""].join(" ").trim(),
          title: `${at("area").value}${this.from + row + number}: who wrote it?` }, make("button", { on: { click: () => this.why(this.from + row + number) } }, shown(word))))));
    }
    at("words").tBodies[0].replaceChildren(...rows);
  }
}

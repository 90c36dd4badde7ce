// The trend panel: what is watched over time, sampled as the page sees it, or every one of the last recorded scans.  Two cursors
// measure it; a part of it can be enlarged, and all of it saved.

import { at, inSvg, make, number, remember, remembered, save } from "/dom.js";

const MOST_SAMPLES = 3000;
const WIDTH = 600;
const HEIGHT = 60;
const LEAST_SPAN = 8;
const CURSORS = ["A", "B"];

export class TrendPanel {
  constructor(page) {
    this.page = page;
    this.clear();
    addEventListener("pagehide", () => this.keep());
    at("clear").addEventListener("click", () => { this.clear(); this.draw(); });
    at("exact").addEventListener("click", () => this.exact());
    at("csv").addEventListener("click", () => this.csv());
    at("svg").addEventListener("click", () => this.svg());
    at("hold").addEventListener("change", () => { if (!at("hold").checked) { this.window = null; this.draw(); } });
    at("closer").addEventListener("click", () => this.zoom(0.5));
    at("wider").addEventListener("click", () => this.zoom(2));
    at("whole").addEventListener("click", () => { this.window = null; this.draw(); });
    for (const name of CURSORS) at(`cursor${name}`).addEventListener("input", () => this.put(name, Number(at(`cursor${name}`).value)));
    at("uncursor").addEventListener("click", () => { this.cursors = {}; this.draw(); });
    at("curves").addEventListener("click", (event) => {
      const svg = event.target.closest("svg");
      if (!svg || !this.samples.length) return;
      const box = svg.getBoundingClientRect();
      const [first, last] = this.seen();
      this.put(event.shiftKey ? "B" : "A", Math.round(first + ((event.clientX - box.left) / box.width) * (last + 1 - first) - 0.5));
    });
  }

  clear() {
    this.samples = [];
    this.window = null; // first and last scan that are seen; null for all
    this.cursors = {}; // scans by the names of cursors
  }

  begin(plc) {
    this.clear();
    this.plc = plc.name;
    const kept = remembered("trend", null);
    remember("trend", null);
    if (kept?.plc === plc.name) {
      this.samples = kept.samples.map(([scan, ns, values]) => ({ scan, ns, values: new Map(values) }));
      this.window = kept.window;
      this.cursors = kept.cursors;
      at("hold").checked = kept.hold;
    }
    this.draw();
  }

  // For the page that comes behind a reload, or a lost connection; what is too much for the browser is not kept.
  keep() {
    const samples = this.samples.map(({ scan, ns, values }) => [scan, ns, [...values]]);
    remember("trend", { plc: this.plc, samples, window: this.window, cursors: this.cursors, hold: at("hold").checked });
  }

  update(update, state) {
    if (update.scan === undefined && !update.values || state.state === "past" || state.scan === undefined || at("hold").checked) return;
    const values = new Map(this.page.panels.watch.values);
    const last = this.samples.at(-1);
    if (last && last.scan === state.scan) last.values = values;
    else if (last && last.scan > state.scan) { this.clear(); this.samples = [{ scan: state.scan, ns: state.ns, values }]; }
    else this.samples.push({ scan: state.scan, ns: state.ns, values });
    this.samples.splice(0, this.samples.length - MOST_SAMPLES);
    if (this.page.shown.has("trend")) this.draw();
  }

  async exact() {
    const names = this.names().slice(0, 50);
    const found = names.length ? await this.page.ask("history", { plc: this.page.plc, names, scans: 500 }) : null;
    if (!found) return;
    this.window = null;
    this.samples = found.times.map((ns, number) => ({ scan: found.first + number, ns,
      values: new Map(Object.entries(found.values).map(([name, rows]) => [name, rows[number]])) }));
    at("hold").checked = true;
    this.draw();
  }

  names() {
    return this.page.panels?.watch.names() ?? [];
  }

  // The first and the last scan that are seen.
  seen() {
    const [first, last] = [this.samples[0].scan, this.samples.at(-1).scan];
    return this.window ? [Math.max(first, this.window[0]), Math.min(last, this.window[1])] : [first, last];
  }

  // Shows half or twice as many scans, around cursor A if it is seen, else at the end; what comes on then is not shown.
  zoom(factor) {
    if (!this.samples.length) return;
    const [first, last] = this.seen();
    const span = Math.max(LEAST_SPAN, Math.round((last + 1 - first) * factor));
    const middle = this.cursors.A >= first && this.cursors.A <= last ? this.cursors.A : last;
    const begin = Math.min(Math.max(this.samples[0].scan, Math.round(middle - span / 2)), Math.max(this.samples[0].scan, this.samples.at(-1).scan + 1 - span));
    this.window = [begin, begin + span - 1];
    at("hold").checked = true;
    this.draw();
  }

  put(name, scan) {
    const [first, last] = [this.samples[0]?.scan ?? 0, this.samples.at(-1)?.scan ?? 0];
    this.cursors[name] = Math.min(last, Math.max(first, scan));
    at("hold").checked = true;
    this.draw();
  }

  // The sample that a scan belongs to: the last one that is not behind it.
  sample(scan) {
    return scan === undefined ? undefined : this.samples.findLast((one) => one.scan <= scan);
  }

  draw() {
    at("curves").replaceChildren(...this.names().map((name) => this.curve(name)).filter(Boolean));
    if (!at("curves").childElementCount) at("curves").append(make("p", { class: "dim" }, "What is watched is drawn here."));
    this.measure();
  }

  // What stands between the cursors, and where they can be.
  measure() {
    const range = this.samples.length ? this.seen() : [0, 0];
    for (const name of CURSORS) {
      const scan = this.cursors[name];
      Object.assign(at(`cursor${name}`), { min: range[0], max: range[1], disabled: !this.samples.length });
      at(`cursor${name}`).value = scan ?? range[0];
      at(`cursor${name}`).setAttribute("aria-valuetext", scan === undefined ? "not set" : `scan ${scan}`);
    }
    const [a, b] = CURSORS.map((name) => this.sample(this.cursors[name]));
    const told = (name, one) => (one ? `${name}: scan ${one.scan}, ${(one.ns / 1e9).toFixed(3)} s` : "");
    const apart = a && b ? `B − A: ${b.scan - a.scan} scans, ${((b.ns - a.ns) / 1e6).toFixed(3)} ms` : "";
    at("measured").textContent = [told("A", a), told("B", b), apart].filter(Boolean).join("   ")
      || "Click a curve for cursor A, with Shift for cursor B.";
  }

  // The values at the cursors, and how far these are apart.
  between(name) {
    const [a, b] = CURSORS.map((one) => this.sample(this.cursors[one])?.values.get(name));
    const [from, to] = [number(a), number(b)];
    const isBit = a === "TRUE" || a === "FALSE";
    const apart = !isBit && from !== null && to !== null && a !== undefined && b !== undefined ? `, B − A ${Number((to - from).toPrecision(9))}` : "";
    return `${a === undefined ? "" : `  A ${a}`}${b === undefined ? "" : `  B ${b}`}${apart}`;
  }

  curve(name) {
    if (!this.samples.length) return null;
    const [first, last] = this.seen();
    const points = this.samples.filter((sample) => sample.scan <= last)
      .map((sample) => [Math.max(first, sample.scan), number(sample.values.get(name)), sample.scan]).filter(([, value]) => value !== null);
    const begin = points.findLastIndex(([, , scan]) => scan <= first);
    points.splice(0, Math.max(0, begin));
    if (!points.length) return null;
    const values = points.map(([, value]) => value);
    const now = this.samples.at(-1).values.get(name);
    const isBit = now === "TRUE" || now === "FALSE";
    const [low, high] = isBit ? [0, 1] : [values.reduce((x, y) => Math.min(x, y)), values.reduce((x, y) => Math.max(x, y))];
    const span = Math.max(1, last + 1 - first);
    const x = (scan) => ((scan - first) / span) * WIDTH;
    const y = (value) => HEIGHT - 5 - (high > low ? (value - low) / (high - low) : 0.5) * (HEIGHT - 10);
    let path = `M${x(points[0][0]).toFixed(1)} ${y(points[0][1]).toFixed(1)}`;
    for (const [scan, value] of points.slice(1)) path += `H${x(scan).toFixed(1)}V${y(value).toFixed(1)}`;
    path += `H${WIDTH}`;
    const range = isBit ? "" : `${low} … ${high}, `;
    const svg = inSvg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none", role: "img",
      "aria-label": `${name} from scan ${first} to ${last}: ${range}now ${now}${this.between(name)}` });
    svg.append(inSvg("path", { d: path }));
    for (const cursor of CURSORS) {
      const scan = this.cursors[cursor];
      if (scan === undefined || scan < first || scan > last) continue;
      const where = { x1: x(scan + 0.5), x2: x(scan + 0.5), y1: 0, y2: HEIGHT };
      svg.append(inSvg("line", { ...where, class: cursor }));
    }
    return make("figure", { class: `curve${isBit ? " bit" : ""}`, "data-name": name },
      make("figcaption", {}, make("span", { class: "mono" }, name), make("span", { class: "dim" }, `  ${range}now ${now}`),
        make("b", { class: "between" }, this.between(name))), svg);
  }

  csv() {
    const names = this.names();
    const cell = (text) => `"${String(text).replaceAll('"', '""').replace(/^([=+\-@\t])/, "'$1")}"`;
    const rows = this.samples.map((sample) => [sample.scan, sample.ns, ...names.map((name) => sample.values.get(name) ?? "")]);
    save("trend.csv", [["scan", "ns", ...names], ...rows].map((row) => row.map(cell).join(",")).join("\r\n"), "text/csv");
  }

  // The curves as they are seen, below each other, as one drawing.
  svg() {
    const curves = [...at("curves").querySelectorAll("figure")];
    const high = HEIGHT + 24;
    const all = inSvg("svg", { xmlns: "http://www.w3.org/2000/svg", viewBox: `0 0 ${WIDTH} ${high * curves.length + 20}`, "font-family": "sans-serif", "font-size": "11" });
    curves.forEach((figure, row) => {
      const label = inSvg("text", { x: 0, y: row * high + 14 });
      label.textContent = figure.querySelector("figcaption").textContent;
      const group = inSvg("g", { transform: `translate(0 ${row * high + 18})`, fill: "none", stroke: "#2f5fb3" });
      group.append(...[...figure.querySelector("svg").children].map((one) => one.cloneNode()));
      for (const line of group.querySelectorAll("line")) line.setAttribute("stroke", "#d9480f");
      all.append(label, group);
    });
    const label = inSvg("text", { x: 0, y: high * curves.length + 14 });
    label.textContent = at("measured").textContent;
    all.append(label);
    save("trend.svg", new XMLSerializer().serializeToString(all), "image/svg+xml");
  }
}

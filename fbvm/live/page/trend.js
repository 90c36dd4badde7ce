// The trend panel: what is watched over time, sampled as the page sees it, or every one of the last recorded scans.

import { at, make, number, save } from "/dom.js";

const MOST_SAMPLES = 600;
const WIDTH = 600;
const HEIGHT = 60;

export class TrendPanel {
  constructor(page) {
    this.page = page;
    this.samples = [];
    at("clear").addEventListener("click", () => { this.samples = []; this.draw(); });
    at("exact").addEventListener("click", () => this.exact());
    at("csv").addEventListener("click", () => this.save());
  }

  begin() {
    this.samples = [];
    this.draw();
  }

  update(update, state) {
    if (update.scan === undefined && !update.values || state.state === "past" || state.scan === undefined) return;
    const values = new Map(this.page.panels.watch.values);
    const last = this.samples.at(-1);
    if (last && last.scan === state.scan) last.values = values;
    else if (last && last.scan > state.scan) this.samples = [{ scan: state.scan, ns: state.ns, values }];
    else this.samples.push({ scan: state.scan, ns: state.ns, values });
    this.samples.splice(0, this.samples.length - MOST_SAMPLES);
    if (this.page.shown.has("trend")) this.draw();
  }

  async exact() {
    const names = this.page.panels.watch.names().slice(0, 50);
    const found = names.length ? await this.page.ask("history", { plc: this.page.plc, names, scans: 500 }) : null;
    if (!found) return;
    this.samples = found.times.map((ns, number) => ({ scan: found.first + number, ns,
      values: new Map(Object.entries(found.values).map(([name, rows]) => [name, rows[number]])) }));
    this.draw();
  }

  draw() {
    const names = this.page.panels?.watch.names() ?? [];
    at("curves").replaceChildren(...names.map((name) => this.curve(name)).filter(Boolean));
    if (!at("curves").childElementCount) at("curves").append(make("p", { class: "dim" }, "What is watched is drawn here."));
  }

  curve(name) {
    const points = this.samples.map((sample) => [sample.scan, number(sample.values.get(name))]).filter(([, value]) => value !== null);
    if (!points.length) return null;
    const values = points.map(([, value]) => value);
    const low = Math.min(...values);
    const high = Math.max(...values);
    const first = this.samples[0].scan;
    const span = Math.max(1, this.samples.at(-1).scan + 1 - first);
    const x = (scan) => ((scan - first) / span) * WIDTH;
    const y = (value) => HEIGHT - 5 - (high > low ? (value - low) / (high - low) : 0) * (HEIGHT - 10);
    let path = `M${x(points[0][0]).toFixed(1)} ${y(points[0][1]).toFixed(1)}`;
    for (const [scan, value] of points.slice(1)) path += `H${x(scan).toFixed(1)}V${y(value).toFixed(1)}`;
    path += `H${WIDTH}`;
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    const line = document.createElementNS("http://www.w3.org/2000/svg", "path");
    const now = this.samples.at(-1).values.get(name);
    svg.setAttribute("viewBox", `0 0 ${WIDTH} ${HEIGHT}`);
    svg.setAttribute("preserveAspectRatio", "none");
    svg.setAttribute("role", "img");
    svg.setAttribute("aria-label", `${name} from scan ${first} to ${first + span - 1}: ${low} to ${high}, now ${now}`);
    line.setAttribute("d", path);
    svg.append(line);
    return make("figure", { class: `curve${now === "TRUE" || now === "FALSE" ? " bit" : ""}` },
      make("figcaption", {}, make("span", { class: "mono" }, name), make("span", { class: "dim" }, `  ${low} … ${high}, now ${now}`)), svg);
  }

  save() {
    const names = this.page.panels.watch.names();
    const cell = (text) => `"${String(text).replaceAll('"', '""').replace(/^([=+\-@\t])/, "'$1")}"`;
    const rows = this.samples.map((sample) => [sample.scan, sample.ns, ...names.map((name) => sample.values.get(name) ?? "")]);
    save("trend.csv", [["scan", "ns", ...names], ...rows].map((row) => row.map(cell).join(",")).join("\r\n"), "text/csv");
  }
}

// The plant panel: the PLCs of the run beside each other with what is watched of each, and a picture of who talks to whom.

import { at, cut, inSvg, make, remembered } from "/dom.js";
import { NAMES } from "/scan.js";

const BOX = 150;
const GAP = 70;
const HIGH = 58;
const MOST_BESIDE = 8;
const MOST_SHOWN = 60; // characters of a value

export class PlantPanel {
  constructor(page) {
    this.page = page;
    this.plant = null;
  }

  begin() {
    if (this.plant) this.draw();
  }

  // Of each other PLC, what was watched there last.
  beside() {
    return this.others().flatMap((plc) => this.watched(plc).map((name) => `${plc}/${name}`));
  }

  others() {
    return (this.page.about?.plcs ?? []).map((plc) => plc.name).filter((name) => name !== this.page.plc);
  }

  watched(plc) {
    const said = this.page.about?.plcs.find((one) => one.name === plc)?.watch ?? [];
    return remembered(`watch.${plc}`, said).map(String).filter((name) => !name.includes("/")).slice(0, MOST_BESIDE);
  }

  update(update) {
    if (update.plant) this.plant = update.plant;
    if (this.plant && (update.plant || update.values)) this.draw();
  }

  draw() {
    const focused = document.activeElement?.closest("#plcs") ? document.activeElement.textContent : "";
    at("plcs").replaceChildren(...this.plant.plcs.map((plc) => this.card(plc)));
    if (focused) [...at("plcs").querySelectorAll("button")].find((one) => one.textContent === focused)?.focus();
    at("plan").replaceChildren(this.picture(), this.plant.links.length ? "" : make("p", { class: "dim" }, "Nobody has sent a frame yet."));
    at("doors").replaceChildren(...this.plant.doors.map(([unit, host]) => make("li", {}, `${unit} is reached from outside at ${host}`)));
  }

  card(plc) {
    const own = plc.name === this.page.plc;
    const watch = this.page.panels.watch;
    const rows = this.watched(plc.name).map((name) => make("tr", {}, make("td", { class: "mono" }, name),
      make("td", { class: "value" }, cut(watch.values.get(own ? name : `${plc.name}/${name}`) ?? "", MOST_SHOWN))));
    const button = make("button", { "aria-pressed": String(own), title: "Look at this PLC", on: { click: () => this.look(plc.name) } }, plc.name);
    return make("div", { class: "card" }, make("h3", {}, button, " ", make("span", { class: "state", "data-state": plc.state }, NAMES[plc.state] ?? plc.state)),
      make("p", { class: "dim" }, `${plc.scan < 0 ? "before the first scan" : `scan ${plc.scan}`}, mode ${plc.mode}`), plc.trap ? make("p", { class: "mistake" }, plc.trap) : "",
      make("table", { "aria-label": `What is watched of ${plc.name}` }, make("tbody", {}, ...rows)),
      rows.length ? "" : make("p", { class: "dim" }, "nothing is watched of it"));
  }

  look(name) {
    at("plc").value = name;
    this.page.choose(name);
  }

  // PLCs above, those whom they talk to and that are no PLC of the run below, a line for each pair that has talked.
  picture() {
    const { plcs, links, faults } = this.plant;
    const homes = new Map(plcs.flatMap((plc, number) => plc.units.map((unit) => [unit.address, number])));
    const peers = [...new Set(links.flatMap(([one, other]) => [one, other]))].filter((host) => !homes.has(host)).sort();
    const wide = Math.max(plcs.length, peers.length, 1) * (BOX + 20) + 10;
    const top = 12;
    const below = top + HIGH + GAP;
    const place = (count, number) => (wide - count * (BOX + 20)) / 2 + 10 + number * (BOX + 20);
    const svg = inSvg("svg", { viewBox: `0 0 ${wide} ${peers.length ? below + HIGH + 10 : top + HIGH + (links.length ? 34 : 10)}`, width: wide, role: "img",
      "aria-label": `${plcs.length} PLCs, ${peers.length} peers. ${links.map(([one, other, frames]) => `${one} and ${other}: ${frames} frames`).join(". ")}` });
    const middle = (host) => (homes.has(host) ? [place(plcs.length, homes.get(host)) + BOX / 2, top + HIGH] : [place(peers.length, peers.indexOf(host)) + BOX / 2, below]);
    links.forEach(([one, other, frames, info], number) => {
      const [[x1, y1], [x2, y2]] = [middle(one), middle(other)];
      const isBad = faults.includes("0.0.0.0") || faults.includes(one) || faults.includes(other);
      const bend = y1 === y2 ? (y1 === below ? below - 30 : top + HIGH + 40) : (y1 + y2) / 2;
      const line = inSvg("path", { d: `M${x1} ${y1}C${x1} ${bend} ${x2} ${bend} ${x2} ${y2}`, class: isBad ? "bad" : "" });
      line.append(inSvg("title", {}));
      line.firstChild.textContent = `${one}, ${other}: ${info}`;
      const at2 = 0.35 + 0.3 * (number % 2);
      const label = inSvg("text", { x: x1 + (x2 - x1) * at2, y: y1 === y2 ? bend - 6 : y1 + (y2 - y1) * at2, "text-anchor": "middle", class: "faint" });
      label.textContent = `${frames} frames${isBad ? ", fault" : ""}`;
      svg.append(line, label);
    });
    plcs.forEach((plc, number) => svg.append(...box(place(plcs.length, number), top, plc.name,
      plc.units.map((unit) => `${unit.address}${unit.plugged ? "" : ", cable pulled"}`).slice(0, 2), plc.units.some((unit) => !unit.plugged) ? "bad" : "")));
    peers.forEach((host, number) => svg.append(...box(place(peers.length, number), below, host,
      [faults.includes(host) ? "peer, fault on" : "peer"], faults.includes(host) ? "bad" : "")));
    return svg;
  }
}

function box(x, y, name, lines, kind) {
  const frame = inSvg("rect", { x, y, width: BOX, height: HIGH, rx: 6, class: kind });
  return [frame, ...[name, ...lines].map((line, number) => {
    const text = inSvg("text", { x: x + BOX / 2, y: y + 18 + 16 * number, "text-anchor": "middle", class: number ? "faint" : "" });
    text.textContent = line.length > 21 ? `${line.slice(0, 20)}…` : line;
    return text;
  })];
}

// The units panel: the front of each unit with its lamps and dials, its sockets, its words with their meanings, and the cable.

import { at, make } from "/dom.js";

const SOCKET = { name: "socket", state: "state", local: "local port", peer: "peer", received: "bytes received", requested: "bytes requested", result: "latest result" };

export class UnitsPanel {
  constructor(page) {
    this.page = page;
    this.units = [];
    at("zeros").addEventListener("change", () => this.draw());
  }

  begin(plc) {
    this.units = [];
    at("backplane").replaceChildren(make("p", { class: "dim" }, plc.units.length ? "reading …" : "This PLC has no unit."));
  }

  update(update) {
    if (!update.units) return;
    this.before = new Map(this.units.flatMap((unit) => unit.words.map(([address, , text]) => [address, text])));
    this.units = update.units;
    this.draw();
  }

  draw() {
    if (!this.units.length) return;
    const focused = document.activeElement?.closest("#backplane")?.id && document.activeElement.getAttribute("aria-label");
    at("backplane").replaceChildren(...this.units.map((unit) => this.unit(unit)));
    if (focused) [...at("backplane").querySelectorAll("button")].find((one) => one.getAttribute("aria-label") === focused)?.focus();
  }

  unit(unit) {
    const { front } = unit;
    return make("div", { class: "unit" }, make("h3", {}, `${unit.name}, ${unit.address}, ${unit.plugged ? "cable plugged" : "cable pulled"}`), make("div", { class: "front", role: "group", "aria-label": `Front of ${unit.name}` },
      ...(front ? this.front(front) : []), make("div", { class: "tools" }, ...this.buttons(unit))),
    front?.sockets.length ? this.sockets(unit.name, front.sockets) : front ? make("p", { class: "dim" }, "no socket is in use") : "",
    this.words(unit));
  }

  front({ settings, lamps }) {
    return [make("ul", { class: "lamps", "aria-label": "Lamps" }, ...lamps.map((lamp) => make("li", { class: lamp.is_on ? "lit" : "", title: lamp.said },
      make("span", { "aria-hidden": "true" }, lamp.is_on ? "●" : "○"), ` ${lamp.name} `, make("span", { class: "dim" }, lamp.said)))),
    make("dl", {}, ...settings.flatMap(([name, value]) => [make("dt", {}, name), make("dd", { class: "mono" }, value)]))];
  }

  buttons(unit) {
    const { page } = this;
    const { about } = page;
    const fixed = Boolean(about?.read_only || about?.writable);
    const button = (text, disabled, click) => make("button", { disabled, "aria-label": `${text} of ${unit.name}`, on: { click } }, text);
    const made = [button(unit.plugged ? "pull the cable" : "plug the cable", fixed,
      () => page.ask("cable", { plc: page.plc, unit: unit.name, plugged: !unit.plugged }))];
    const restart = unit.front?.restart;
    if (restart) made.push(button(`restart (${restart[0]})`, Boolean(about?.read_only), () => page.ask("write", { plc: page.plc, name: restart[0], value: restart[1] })));
    return made;
  }

  sockets(name, rows) {
    return make("div", { class: "wide", tabindex: "0", role: "region", "aria-label": `Sockets of ${name}` }, make("table", {},
      make("thead", {}, make("tr", {}, ...Object.values(SOCKET).map((head) => make("th", { scope: "col" }, head)))),
      make("tbody", {}, ...rows.map((row) => make("tr", {}, ...Object.keys(SOCKET).map((key) => make("td", { class: key === "result" && row[key] ? "mistake" : "mono" }, String(row[key]))))))));
  }

  words(unit) {
    const all = at("zeros").checked;
    const words = unit.words.filter(([, , text]) => all || (text !== "0" && text !== "FALSE"));
    if (!words.length) return "";
    return make("table", { "aria-label": `Words of ${unit.name}` }, make("tbody", {}, ...words.map(([address, said, text, meaning]) =>
      make("tr", { class: this.before.has(address) && this.before.get(address) !== text ? "moved" : "" },
        make("td", { class: "mono" }, address),
        make("td", { class: `value${text === "TRUE" ? " on" : ""}${address in (this.page.state.forces ?? {}) ? " forced" : ""}` }, text === "TRUE" ? "ON" : text === "FALSE" ? "OFF" : text),
        make("td", {}, said, meaning ? make("b", {}, `: ${meaning}`) : "")))));
  }
}

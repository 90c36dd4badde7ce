// The units panel: words and flags by their names with their meanings, and the cable.

import { at, make } from "/dom.js";

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
    const all = at("zeros").checked;
    if (!this.units.length) return;
    at("backplane").replaceChildren(...this.units.map((unit) => {
      const words = unit.words.filter(([, , text]) => all || (text !== "0" && text !== "FALSE"));
      const cable = make("button", { disabled: Boolean(this.page.about?.read_only || this.page.about?.writable), "aria-pressed": String(!unit.plugged),
        on: { click: () => this.page.ask("cable", { plc: this.page.plc, unit: unit.name, plugged: !unit.plugged }) } },
      unit.plugged ? "pull the cable" : "plug the cable");
      const bit = unit.words.find(([, said]) => said.endsWith("Restart Bit"));
      const restart = bit ? [make("button", { disabled: Boolean(this.page.about?.read_only), on: { click: () => this.page.ask("write", { plc: this.page.plc, name: bit[0], value: "TRUE" }) } },
        `restart the unit (${bit[0]})`)] : [];
      return make("div", {}, make("h3", {}, `${unit.name}, ${unit.address}, ${unit.plugged ? "cable plugged" : "cable pulled"} `, cable),
        ...restart,
        make("table", { "aria-label": `Words of ${unit.name}` }, make("tbody", {}, ...words.map(([address, said, text, meaning]) =>
          make("tr", { class: this.before.has(address) && this.before.get(address) !== text ? "moved" : "" },
            make("td", { class: "mono" }, address),
            make("td", { class: `value${text === "TRUE" ? " on" : ""}` }, text === "TRUE" ? "ON" : text === "FALSE" ? "OFF" : text),
            make("td", {}, said, meaning ? make("b", {}, `: ${meaning}`) : ""))))));
    }));
  }
}

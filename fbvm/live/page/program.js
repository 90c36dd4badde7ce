// The program panel: the source of an instance with values beside its lines, its rungs and charts with power.

import { at, drawing, make, options, remember, remembered } from "/dom.js";

export class ProgramPanel {
  constructor(page) {
    this.page = page;
    this.instance = "";
    this.lines = [];
    this.chips = new Map();
    this.rows = new Map();
    at("instance").addEventListener("change", async () => {
      await this.choose(at("instance").value);
      await page.look();
    });
  }

  async begin(plc) {
    const paths = plc.instances.map((instance) => instance.path);
    const wanted = remembered(`instance.${plc.name}`, paths[0] ?? "");
    options(at("instance"), paths, wanted);
    await this.choose(paths.includes(wanted) ? wanted : paths[0] ?? "");
  }

  async choose(instance) {
    this.instance = instance;
    remember(`instance.${this.page.plc}`, instance);
    at("rungs").replaceChildren();
    const found = instance ? await this.page.ask("source", { plc: this.page.plc, instance }) : null;
    this.lines = found?.lines ?? [];
    this.chips.clear();
    this.rows.clear();
    const body = at("source").tBodies[0];
    body.replaceChildren(...this.lines.map((line, number) => this.line(line, found.first + number)));
    at("source").hidden = false;
    if (found && !found.lines.length) body.append(make("tr", {}, make("td", {}, `The source of ${found.pou} is not at hand.`)));
  }

  line(line, number) {
    const chips = line.names.map((name) => {
      const chip = make("button", { class: "chip", title: `${name}: click to watch it`, on: { click: () => this.page.panels.watch.add(name) } });
      const short = name.split(".").pop();
      const value = make("b");
      chip.append(`${short} `, value);
      const known = this.chips.get(name) ?? [];
      this.chips.set(name, [...known, [chip, value]]);
      return chip;
    });
    const row = make("tr", {}, make("td", { class: "line" }, String(number)), make("td", {}, line.text), make("td", { class: "values" }, ...chips));
    this.rows.set(number, row);
    return row;
  }

  names() {
    return this.chips.keys();
  }

  update(update, state) {
    for (const [name, text] of Object.entries(update.values ?? {})) {
      for (const [, value] of this.chips.get(name) ?? []) value.textContent = text;
    }
    if (update.forces) {
      for (const [name, pairs] of this.chips) for (const [chip] of pairs) chip.classList.toggle("forced", name in state.forces);
    }
    if (!update.inside) return;
    const executed = new Set(update.inside.executed);
    for (const [number, row] of this.rows) row.classList.toggle("executed", executed.has(number));
    at("rungs").replaceChildren(...update.inside.pictures.map(([head, svg]) =>
      make("figure", {}, make("figcaption", {}, head), svg ? drawing(svg, `${head}, scan ${update.inside.scan}`) : "")));
  }
}

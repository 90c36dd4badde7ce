// The program panel: the source of an instance with values beside its lines, its rungs and charts with power.

import { at, drawing, inSvg, make, options, remember, remembered } from "/dom.js";

const DRAWN = /[\u2500-\u257f]/; // a rung or a chart that is drawn in the source: its lines stay whole

export class ProgramPanel {
  constructor(page) {
    this.page = page;
    this.instance = "";
    this.lines = [];
    this.chips = new Map();
    this.rows = new Map();
    this.values = new Map();
    this.pictures = { pictures: [], scan: 0 };
    at("breaking").addEventListener("submit", (event) => {
      event.preventDefault();
      this.stop("");
    });
    at("rungs").addEventListener("click", (event) => {
      const name = event.target.closest("text")?.dataset.name;
      if (name) page.panels.watch.add(name);
    });
    at("instance").addEventListener("change", async () => {
      await this.choose(at("instance").value);
      await page.look();
    });
  }

  stop(where) {
    const kind = where ? "line" : at("breakKind").value;
    const when = where ? "" : at("breakWhen").value.trim();
    return this.page.ask("break", { plc: this.page.plc, kind, where: where || at("breakWhere").value.trim(), ...(when ? { when } : {}) });
  }

  // Breakpoints as a list and beside the lines, and where the scan stands.
  breakpoints(state) {
    const { page } = this;
    at("breaks").replaceChildren(...(state.breaks ?? []).map((text, number) => make("li", {}, `● ${text} `,
      make("button", { "aria-label": `Remove the breakpoint ${text}`, on: { click: () => page.ask("unbreak", { plc: page.plc, number }) } }, "remove"))));
    const { halt } = state;
    at("halt").hidden = !halt;
    if (halt) {
      at("halt").textContent = halt.line ? `Scan ${halt.scan} stands before ${halt.file.split(/[\\/]/).pop()}:${halt.line} in ${halt.instance || halt.pou}${halt.why ? `: ${halt.why}` : ""}`
        : `Scan ${halt.scan} stands at the end of ${halt.pou}${halt.why ? `: ${halt.why}` : ""}`;
      const known = [...at("instance").options].find((option) => option.value.toUpperCase() === halt.instance.toUpperCase());
      if (known && known.value !== this.instance) {
        at("instance").value = known.value;
        this.choose(known.value).then(() => { this.breakpoints(state); page.look(); });
        return;
      }
    }
    for (const [number, row] of this.rows) {
      const isHere = Boolean(halt) && halt.line === number && halt.file === this.path;
      if (isHere && !row.classList.contains("halted")) row.scrollIntoView({ block: "nearest" });
      row.classList.toggle("halted", isHere);
      row.classList.toggle("breakpoint", (state.breaks ?? []).some((text) => text.startsWith("line ") && text.split(" ")[1].endsWith(`${this.file}:${number}`)));
    }
  }

  async begin(plc) {
    const { about } = this.page;
    at("breaking").hidden = about.read_only || about.writable !== null;
    const paths = plc.instances.map((instance) => instance.path);
    const wanted = remembered(`instance.${plc.name}`, paths[0] ?? "");
    options(at("instance"), paths, wanted);
    await this.choose(paths.includes(wanted) ? wanted : paths[0] ?? "");
  }

  async choose(instance) {
    this.instance = instance;
    remember(`instance.${this.page.plc}`, instance);
    this.pictures = { pictures: [], scan: 0 };
    this.draw();
    const found = instance ? await this.page.ask("source", { plc: this.page.plc, instance }) : null;
    this.lines = found?.lines ?? [];
    this.path = found?.file ?? "";
    this.file = (found?.file ?? "").split(/[\\/]/).pop();
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
      const short = this.short(name, line.names);
      const value = make("b");
      chip.append(`${short} `, value);
      const known = this.chips.get(name) ?? [];
      this.chips.set(name, [...known, [chip, value]]);
      return chip;
    });
    const row = make("tr", {}, make("td", { class: "line", title: "A breakpoint", on: { click: () => this.stop(`${this.path}:${number}`) } }, String(number)), make("td", { class: DRAWN.test(line.text) ? "drawn" : "" }, line.text), make("td", { class: "values" }, ...chips));
    this.rows.set(number, row);
    return row;
  }

  // The last part of a name; if others on the line end the same, the name as it is within the instance.
  short(name, beside) {
    const last = (one) => one.split(".").pop();
    const own = `${this.instance}.`.toUpperCase();
    if (beside.every((one) => one === name || last(one).toUpperCase() !== last(name).toUpperCase())) return last(name);
    return name.toUpperCase().startsWith(own) ? name.slice(own.length) : name;
  }

  // Marks the lines of the running program that are wrong in the changed one, where they are the same.
  mark(mistakes) {
    for (const one of document.querySelectorAll("#source .mistake")) one.remove();
    for (const one of mistakes) {
      const same = [...this.rows].filter(([, row]) => row.children[1].textContent.trim() === one.text.trim());
      const row = (this.rows.get(one.line)?.children[1].textContent.trim() === one.text.trim() ? this.rows.get(one.line) : same[0]?.[1]) ?? this.rows.get(one.line);
      if (one.file === this.file) row?.children[2].append(make("div", { class: "mistake" }, `✗ ${one.text.trim()}: ${one.message}`));
    }
  }

  names() {
    return this.chips.keys();
  }

  update(update, state) {
    for (const [name, text] of Object.entries(update.values ?? {})) {
      this.values.set(name, text);
      for (const [, value] of this.chips.get(name) ?? []) value.textContent = text;
    }
    if (update.forces) {
      for (const [name, pairs] of this.chips) for (const [chip] of pairs) chip.classList.toggle("forced", name in state.forces);
      this.draw();
    }
    if (update.breaks || update.halt !== undefined) this.breakpoints(state);
    if (!update.inside) return;
    const executed = new Set(update.inside.executed);
    for (const [number, row] of this.rows) row.classList.toggle("executed", executed.has(number));
    this.pictures = update.inside;
    this.draw();
  }

  // Rungs and charts; a name in them can be clicked, and says its value and whether it is forced.
  draw() {
    const { forces = {} } = this.page.state;
    at("rungs").replaceChildren(...this.pictures.pictures.map(([head, svg]) => {
      const made = svg ? drawing(svg, `${head}, scan ${this.pictures.scan}`) : "";
      const forced = new Set();
      for (const text of svg ? made.querySelectorAll("text") : []) {
        const name = this.named(text.textContent.split(" = ")[0]);
        if (!name) continue;
        text.dataset.name = name;
        text.append(inSvg("title", {}));
        text.lastChild.textContent = `${name} = ${this.values.get(name) ?? ""}: click to watch it`;
        if (!(name in forces)) continue;
        text.classList.add("held");
        forced.add(`${name} forced to ${forces[name]}`);
      }
      return make("figure", {}, make("figcaption", {}, head, forced.size ? make("b", { class: "mistake" }, ` ${[...forced].join(", ")}`) : ""), made);
    }));
  }

  // The full name of a variable that a drawing calls so; undefined if the source has none.
  named(text) {
    const wanted = [`${this.instance}.${text}`, text].map((one) => one.trim().toUpperCase());
    return [...this.chips.keys()].find((name) => wanted.includes(name.toUpperCase()));
  }
}

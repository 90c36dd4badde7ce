// The watch panel: search over everything, values, writing once, forces, trees, radix, and the cause of a value.

import { at, inRadix, make, remember, remembered } from "/dom.js";

export class WatchPanel {
  constructor(page) {
    this.page = page;
    this.list = [];
    this.rows = new Map();
    this.about = new Map();
    this.values = new Map();
    at("radix").addEventListener("change", () => this.show());
    at("free").addEventListener("click", () => page.ask("release", { plc: page.plc }));
    at("find").addEventListener("input", () => this.search());
    at("find").addEventListener("keydown", (event) => {
      if (event.key === "Enter") at("found").querySelector("button")?.click();
      else if (event.key === "ArrowDown") at("found").querySelector("button")?.focus();
      else if (event.key === "Escape") this.close();
    });
    at("found").addEventListener("keydown", (event) => {
      const item = document.activeElement.closest("li");
      if (event.key === "ArrowDown") item?.nextElementSibling?.firstElementChild.focus();
      else if (event.key === "ArrowUp") (item?.previousElementSibling?.firstElementChild ?? at("find")).focus();
      else if (event.key === "Escape") this.close();
      else return;
      event.preventDefault();
    });
  }

  begin(plc) {
    this.list = remembered(`watch.${plc.name}`, []).map(String);
    this.build();
    if (at("find").value.trim()) this.search(); // typed before there was a connection, or for another PLC
  }

  names() {
    return this.list;
  }

  async search() {
    const text = at("find").value;
    if (!text.trim()) return this.close();
    const made = await this.page.ask("search", { plc: this.page.plc, text });
    if (!made || at("find").value !== text) return undefined;
    at("found").hidden = false;
    at("found").replaceChildren(...made.found.map((found) => make("li", { role: "option" },
      make("button", { on: { click: () => { this.close(); this.add(found.name); } } },
        found.name, make("span", { class: "dim" }, `  ${found.type}  ${found.said}`)))));
    if (!made.found.length) at("found").append(make("li", { class: "dim" }, "nothing is called so"));
    return undefined;
  }

  close() {
    at("found").hidden = true;
    at("find").value = "";
  }

  async add(...names) {
    this.list = [...new Set([...this.list, ...names])];
    await this.changed();
  }

  async changed() {
    remember(`watch.${this.page.plc}`, this.list);
    this.build();
    await this.page.look();
  }

  told(found) {
    for (const [name, about] of Object.entries(found.rows)) this.about.set(name, about);
    for (const name of this.list) {
      if (found.unknown[name]) this.values.set(name, `? ${found.unknown[name]}`);
    }
    this.build();
  }

  build() {
    this.rows.clear();
    at("hint").hidden = this.list.length > 0;
    at("watched").tBodies[0].replaceChildren(...this.list.map((name) => this.row(name)));
    this.show();
  }

  row(name) {
    const { page } = this;
    const about = this.about.get(name) ?? {};
    const ask = (what, fields) => page.ask(what, { plc: page.plc, name, ...fields });
    const value = make("td", { class: "value", tabindex: "0" });
    const input = make("input", { "aria-label": `New value of ${name}`, list: "", on: { keydown: (event) => {
      if (event.key === "Enter") ask(event.shiftKey ? "force" : "write", { value: input.value });
    } } });
    const button = (text, label, click) => make("button", { "aria-label": `${label} ${name}`, title: label, on: { click } }, text);
    const tools = [button("write", "Write once", () => ask("write", { value: input.value })),
      button("force", "Hold at this value", () => ask("force", { value: input.value })),
      button("release", "End the force of", () => ask("release", {}))];
    if (about.type === "BOOL") tools.unshift(button("flip", "Write the other value into", () => ask("write", { value: this.values.get(name) === "TRUE" ? "FALSE" : "TRUE" })));
    if (about.tree) tools.push(button("parts", "Watch the parts of", () => this.parts(name)));
    else tools.push(button("why", "Which statement gave its value to", () => this.why(name)));
    tools.push(button("×", "Watch no longer", () => { this.list = this.list.filter((one) => one !== name); this.changed(); }));
    if (page.about?.read_only) for (const one of [input, ...tools.slice(0, about.type === "BOOL" ? 4 : 3)]) one.disabled = true;
    this.rows.set(name, value);
    return make("tr", { "data-name": name }, make("td", { class: "mono", title: about.said ?? "" }, name, about.said ? make("div", { class: "dim" }, about.said) : ""),
      value, make("td", { class: "dim" }, about.type ?? ""), make("td", {}, input), make("td", {}, ...tools));
  }

  async parts(name) {
    const found = await this.page.ask("parts", { plc: this.page.plc, name });
    if (found) await this.add(...found.parts.map((part) => part.name));
  }

  async why(name) {
    const found = await this.page.ask("why", { plc: this.page.plc, name });
    at("cause").hidden = !found;
    if (found) {
      at("cause").textContent = found.text;
      at("cause").focus();
    }
  }

  show() {
    const radix = Number(at("radix").value);
    const forces = this.page.state.forces ?? {};
    for (const [name, cell] of this.rows) {
      const text = this.values.get(name) ?? "";
      const shown = inRadix(text, radix, this.about.get(name)?.bytes);
      const isForced = (this.about.get(name)?.name ?? name) in forces;
      if (cell.textContent !== shown) cell.textContent = shown;
      cell.classList.toggle("on", text === "TRUE");
      cell.classList.toggle("forced", isForced);
      cell.setAttribute("aria-label", `${name} is ${shown}${isForced ? ", forced" : ""}`);
    }
  }

  update(update) {
    for (const [name, text] of Object.entries(update.values ?? {})) this.values.set(name, text);
    if (update.values || update.forces) this.show();
  }
}

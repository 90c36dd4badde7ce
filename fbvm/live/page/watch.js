// The watch panel: search over everything, values, writing once, forces, trees, groups, radix, and the cause of a value.

import { at, cut, inRadix, make, options, remember, remembered } from "/dom.js";

const NO_GROUP = "";
const MOST_ROWS = 1000;
const MOST_SHOWN = 60; // characters of what can be opened
const MOST_OF_TYPE = 24;

export class WatchPanel {
  constructor(page) {
    this.page = page;
    this.list = [];
    this.open = new Set(); // names whose parts are shown
    this.parts = new Map(); // the names of the parts, by name
    this.rows = new Map();
    this.about = new Map();
    this.values = new Map();
    this.groups = {};
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
    at("group").addEventListener("change", () => this.choose(at("group").value));
    at("grouping").addEventListener("submit", (event) => {
      event.preventDefault();
      this.keep(at("groupName").value, this.list);
    });
    at("uncause").addEventListener("click", () => { at("reason").hidden = true; });
    at("ungroup").addEventListener("click", () => this.keep(at("group").value, []));
  }

  async begin(plc) {
    const { about } = this.page;
    this.list = remembered(`watch.${plc.name}`, plc.watch).map(String);
    this.open = new Set(remembered(`open.${plc.name}`, []).map(String));
    this.parts.clear();
    at("reason").hidden = true; // of another PLC, or of a program before
    at("grouping").hidden = !about.groups;
    for (const id of ["keepGroup", "ungroup", "groupName"]) at(id).disabled = about.read_only || about.writable !== null;
    await Promise.all([...this.open].map((name) => this.fetch(name)));
    this.build();
    if (at("find").value.trim()) this.search(); // typed before there was a connection, or for another PLC
  }

  // The names of all rows: those that are watched, and the parts of those that are open.
  names() {
    const found = [];
    const add = (name) => {
      found.push(name);
      if (this.open.has(name)) (this.parts.get(name) ?? []).forEach(add);
    };
    this.list.forEach(add);
    return found.slice(0, MOST_ROWS);
  }

  // The PLC and the name behind it: of another PLC it stands in front, as in tank/Main.Level.
  owner(name) {
    const cut = name.lastIndexOf("/");
    return { plc: cut < 0 ? this.page.plc : name.slice(0, cut), name: name.slice(cut + 1) };
  }

  async search() {
    const text = at("find").value;
    if (!text.trim()) return this.close();
    const { plc, name } = this.owner(text);
    const made = await this.page.ask("search", { plc, text: name });
    if (!made || at("find").value !== text) return undefined;
    const head = plc === this.page.plc ? "" : `${plc}/`;
    at("found").hidden = false;
    at("found").replaceChildren(...made.found.map((found) => make("li", {},
      make("button", { on: { click: () => { this.close(); this.add(head + found.name); } } },
        head + found.name, make("span", { class: "dim" }, `  ${found.type}  ${found.said}`)))));
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
    remember(`open.${this.page.plc}`, [...this.open]);
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
    const focused = document.activeElement?.closest("#watched tr")?.dataset.name;
    const label = document.activeElement?.getAttribute("aria-label");
    const typed = new Map([...at("watched").querySelectorAll("tr input")].map((one) => [one.closest("tr").dataset.name, one.value]));
    this.rows.clear();
    at("hint").hidden = this.list.length > 0;
    const made = [];
    const add = (name, level, short) => {
      if (made.length >= MOST_ROWS) return;
      made.push(this.row(name, level, short, typed.get(name) ?? ""));
      if (this.open.has(name)) for (const part of this.parts.get(name) ?? []) add(part, level + 1, part.slice(name.length).replace(/^\./, ""));
    };
    for (const name of this.list) add(name, 0, name);
    at("watched").tBodies[0].replaceChildren(...made);
    if (focused) [...at("watched").querySelectorAll("button, input, .value")].find((one) => one.getAttribute("aria-label") === label)?.focus();
    this.show();
  }

  row(name, level, short, typed) {
    const { page } = this;
    const about = this.about.get(name) ?? {};
    const owner = this.owner(name);
    const ask = (what, fields) => page.ask(what, { ...owner, ...fields });
    const value = make("td", { class: "value", tabindex: "0" });
    const input = make("input", { "aria-label": `New value of ${name}`, value: typed, on: { keydown: (event) => {
      if (event.key === "Enter") ask(event.shiftKey ? "force" : "write", { value: input.value });
    } } });
    const button = (text, label, click) => make("button", { "aria-label": `${text}: ${label} ${name}`, title: label, on: { click } }, text);
    const tools = [button("write", "Write once", () => ask("write", { value: input.value })),
      button("force", "Hold at this value", () => ask("force", { value: input.value })),
      button("release", "End the force of", () => ask("release", {}))];
    if (about.type === "BOOL") tools.unshift(button("flip", "Write the other value into", () => ask("write", { value: this.values.get(name) === "TRUE" ? "FALSE" : "TRUE" })));
    const changing = [input, ...tools];
    if (!about.tree) tools.push(button("why", "Which statement gave its value to", () => this.why(name)));
    if (!level) tools.push(button("×", "Watch no longer", () => { this.list = this.list.filter((one) => one !== name); this.changed(); }));
    if (page.about?.read_only) for (const one of changing) one.disabled = true;
    const isOpen = this.open.has(name);
    const opener = about.tree ? [make("button", { class: "opener", "aria-expanded": String(isOpen), "aria-label": `${isOpen ? "Hide" : "Show"} the parts of ${name}`,
      on: { click: () => this.toggle(name) } }, isOpen ? "▾" : "▸")] : [];
    this.rows.set(name, value);
    return make("tr", { "data-name": name, class: `level${Math.min(level, 6)}` },
      make("td", { class: "mono", }, ...opener, short, about.said ? make("div", { class: "dim" }, about.said) : ""),
      value, make("td", { class: "dim", title: about.type ?? "" }, cut(about.type ?? "", MOST_OF_TYPE)), make("td", {}, input), make("td", { class: "does" }, ...tools));
  }

  // Opens an array, a structure or an instance into its parts, or closes it.
  async toggle(name) {
    if (!this.open.delete(name)) {
      this.open.add(name);
      await this.fetch(name);
    }
    await this.changed();
  }

  async fetch(name) {
    const { plc, name: path } = this.owner(name);
    const found = await this.page.ask("parts", { plc, name: path });
    if (!found) return;
    const head = name.slice(0, name.length - path.length);
    this.parts.set(name, found.parts.map((part) => head + part.name));
    for (const part of found.parts) this.about.set(head + part.name, part);
  }

  async why(name) {
    const found = await this.page.ask("why", this.owner(name));
    at("reason").hidden = !found;
    if (found) {
      at("cause").textContent = found.text;
      at("cause").focus();
    }
  }

  // A group takes the place of what was watched.
  choose(group) {
    const own = `${this.page.plc}/`;
    at("groupName").value = group;
    at("ungroup").hidden = group === NO_GROUP;
    if (group === NO_GROUP) return;
    this.list = (this.groups[group] ?? []).map((name) => (name.startsWith(own) ? name.slice(own.length) : name));
    this.changed();
  }

  async keep(group, names) {
    const kept = names.map((name) => { const { plc, name: path } = this.owner(name); return `${plc}/${path}`; });
    const done = await this.page.ask("group", { name: group, names: kept });
    if (!done) return;
    this.wanted = names.length ? group.trim() : NO_GROUP;
    at("groupName").value = this.wanted;
  }

  show() {
    const radix = Number(at("radix").value);
    const forces = this.page.state.forces ?? {};
    for (const [name, cell] of this.rows) {
      const text = this.values.get(name) ?? "";
      const whole = inRadix(text, radix, this.about.get(name)?.bytes);
      const shown = this.about.get(name)?.tree ? cut(whole, MOST_SHOWN) : whole;
      const isForced = !name.includes("/") && (this.about.get(name)?.name ?? name) in forces;
      if (cell.textContent !== shown) cell.textContent = shown;
      cell.classList.toggle("on", text === "TRUE");
      cell.classList.toggle("forced", isForced);
      cell.setAttribute("aria-label", `${name} is ${shown}${isForced ? ", forced" : ""}`);
    }
  }

  update(update) {
    for (const [name, text] of Object.entries(update.values ?? {})) this.values.set(name, text);
    if (update.values || update.forces) this.show();
    if (update.groups) {
      this.groups = update.groups;
      const chosen = this.wanted ?? at("group").value;
      this.wanted = undefined;
      options(at("group"), [NO_GROUP, ...Object.keys(this.groups)], chosen);
      at("group").options[0].textContent = "none";
      at("ungroup").hidden = at("group").value === NO_GROUP;
    }
  }
}

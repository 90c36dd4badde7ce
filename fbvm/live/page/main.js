// The page of a running PLC: what it looks at, and what an update brings.

import { ChangeBar } from "/change.js";
import { at, make, options, remember, remembered } from "/dom.js";
import { LessonPanel } from "/lesson.js";
import { MemoryPanel } from "/memory.js";
import { NetworkPanel } from "/network.js";
import { PicturePanel } from "/picture.js";
import { PlantPanel } from "/plant.js";
import { ProgramPanel } from "/program.js";
import { ScanTools } from "/scan.js";
import { Connection } from "/socket.js";
import { TimesPanel } from "/times.js";
import { TrendPanel } from "/trend.js";
import { UnitsPanel } from "/units.js";
import { WatchPanel } from "/watch.js";

const PANELS = { lesson: "Lesson", program: "Program", watch: "Watch", trend: "Trend", units: "Units", network: "Network", memory: "Memory",
  plant: "Plant", picture: "Picture", times: "Scan times", acts: "What was done" };
const isWide = () => matchMedia("(min-width: 70rem)").matches;

class Page {
  constructor() {
    const shown = remembered("shown", null);
    this.shown = new Set(shown ?? (isWide() ? ["program", "watch", "trend", "acts"] : ["program"]));
    this.isNew = shown === null;
    this.plc = remembered("plc", "");
    this.about = null;
    this.state = {};
    this.panels = { program: new ProgramPanel(this), watch: new WatchPanel(this), trend: new TrendPanel(this),
      units: new UnitsPanel(this), network: new NetworkPanel(this), memory: new MemoryPanel(this), picture: new PicturePanel(this),
      plant: new PlantPanel(this), times: new TimesPanel(), lesson: new LessonPanel(this) };
    this.scan = new ScanTools(this);
    this.change = new ChangeBar(this);
    at("tabs").append(...Object.entries(PANELS).map(([id, name]) =>
      make("button", { "data-panel": id, on: { click: () => this.toggle(id) } }, name)));
    at("plc").addEventListener("change", () => this.choose(at("plc").value));
    addEventListener("keydown", (event) => this.key(event));
    this.show();
    this.connection = new Connection(() => this.begin(), (update) => this.update(update), (tries, has) => this.lost(tries, has));
  }

  async begin() {
    try {
      this.about = await this.connection.ask("hello", { version: 1 });
    } catch (error) {
      this.fail(error.message);
      return;
    }
    this.fail("");
    const names = this.about.plcs.map((plc) => plc.name);
    if (!names.includes(this.plc)) this.plc = names[0];
    options(at("plc"), names, this.plc);
    document.title = `fbvm live: ${names.join(", ")}`;
    at("log").replaceChildren();
    document.querySelector("[data-panel=picture]").hidden = !this.about.pictures;
    document.querySelector("[data-panel=lesson]").hidden = !this.about.lesson;
    if (this.about.plcs.length > 1 && this.isNew && isWide()) this.open("plant");
    if (this.about.lesson && this.isNew) this.open("lesson");
    if (this.about.pictures && this.isNew) this.open("picture");
    this.isNew = false;
    this.scan.begin();
    this.change.begin();
    const past = remembered("past", null); // before a reload, or before the connection was lost
    await this.choose(this.plc);
    if (past?.plc !== this.plc) return;
    if (past.future !== undefined) at("future").value = String(past.future);
    await this.connection.ask("view", past).catch(() => {}); // the scan may have left the recording
  }

  async choose(name) {
    this.plc = name;
    remember("plc", name);
    this.state = {};
    for (const panel of Object.values(this.panels)) await panel.begin(this.about.plcs.find((plc) => plc.name === name));
    await this.look();
  }

  // Tells fbvm what the page sees: nothing else is sent.
  async look() {
    if (!this.about) return;
    const seen = { plc: this.plc, names: [...this.names()], units: this.shown.has("units"), network: this.shown.has("network"),
      pictures: this.shown.has("picture"), times: this.shown.has("times"),
      plant: this.shown.has("plant") };
    if (this.shown.has("program")) Object.assign(seen, { scan: true, instance: this.panels.program.instance });
    if (this.shown.has("memory")) Object.assign(seen, this.panels.memory.seen());
    const found = await this.ask("look", seen);
    if (found) this.panels.watch.told(found);
  }

  names() {
    const names = new Set(this.panels.watch.names());
    if (this.shown.has("program")) for (const name of this.panels.program.names()) names.add(name);
    if (this.shown.has("plant")) for (const name of this.panels.plant.beside()) names.add(name);
    return [...names].slice(0, 1000);
  }

  // Asks and shows a refusal; returns undefined then.
  async ask(what, fields = {}) {
    try {
      const done = await this.connection.ask(what, fields);
      this.fail("");
      return done;
    } catch (error) {
      this.fail(error.message);
      return undefined;
    }
  }

  fail(text) {
    at("failure").hidden = !text;
    at("failure").textContent = text;
  }

  lost(tries, hasToken) {
    if (this.about) this.panels.trend.keep();
    this.about = null;
    at("state").textContent = "no connection";
    at("state").dataset.state = "lost";
    if (!hasToken) this.fail("The token is missing: open the whole address that fbvm has printed.");
    else if (tries > 1) this.fail("fbvm does not answer; the page comes back by itself when it runs again with the same address.");
  }

  update(update) {
    if (update.restarted) {
      remember("past", null);
      this.begin();
      return;
    }
    this.change.update(update);
    Object.assign(this.state, update);
    if (update.state || update.scan !== undefined) this.keepPast();
    this.scan.update(update, this.state);
    for (const panel of Object.values(this.panels)) panel.update(update, this.state);
    for (const [plc, scan, text] of update.acts ?? []) at("log").prepend(make("li", {}, `${plc}, before scan ${scan}: ${text}`));
  }

  keepPast() {
    const future = Number(at("future").value);
    const { state, scan } = this.state;
    remember("past", state === "past" ? { plc: this.plc, scan, ...(future >= 0 ? { future } : {}) } : null);
  }

  open(id) {
    if (!this.shown.has(id)) this.toggle(id);
  }

  toggle(id) {
    if (isWide()) this.shown.has(id) ? this.shown.delete(id) : this.shown.add(id);
    else this.shown = new Set([id]);
    this.show();
    this.look();
  }

  show() {
    remember("shown", [...this.shown]);
    for (const id of Object.keys(PANELS)) {
      at(id).classList.toggle("shown", this.shown.has(id));
      document.querySelector(`[data-panel=${id}]`).setAttribute("aria-pressed", this.shown.has(id));
    }
  }

  key(event) {
    if (event.target.closest("input, select, textarea, dialog") || event.ctrlKey || event.metaKey || event.altKey) {
      if (event.key === "Escape") event.target.blur?.();
      return;
    }
    const number = Number(event.key);
    const tabs = [...document.querySelectorAll("#tabs button:not([hidden])")];
    if (number >= 1 && number <= tabs.length) this.toggle(tabs[number - 1].dataset.panel);
    else if (event.key === "/") {
      if (!this.shown.has("watch")) this.toggle("watch");
      at("find").focus();
    } else if (!this.scan.key(event)) return;
    event.preventDefault();
  }
}

new Page();

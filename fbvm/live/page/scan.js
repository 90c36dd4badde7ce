// The tools of the scan: run, pause, steps, speed, mode, starts, and the way back over the recording.

import { at, options, save } from "/dom.js";

export const NAMES = { run: "running", pause: "paused", past: "in the past", trap: "stopped by a trap", halt: "inside a scan", ended: "at its end" };

export class ScanTools {
  constructor(page) {
    this.page = page;
    const on = (id, call) => at(id).addEventListener("click", call);
    on("run", () => page.ask("run"));
    on("pause", () => page.ask("pause"));
    on("step", () => page.ask("step", { scans: 1 }));
    on("statement", () => page.ask("statement", { plc: page.plc }));
    on("ten", () => page.ask("step", { scans: 10 }));
    on("warm", () => page.ask("start", { plc: page.plc, kind: "warm" }));
    on("cold", () => page.ask("start", { plc: page.plc, kind: "cold" }));
    on("held", () => { page.open("watch"); page.panels.watch.add(...Object.keys(page.state.forces)); });
    on("help", () => at("keys").showModal());
    on("back", () => this.travel(-1));
    on("forth", () => this.travel(1));
    on("now", () => page.ask("view", { plc: page.plc }));
    on("branch", () => page.ask("branch", { plc: page.plc }));
    at("future").addEventListener("change", () => {
      const future = Number(at("future").value);
      if (future < 0) page.ask("view", { plc: page.plc });
      else page.ask("view", { plc: page.plc, scan: 0, future }).then((found) => found ?? at("future").replaceChildren());
    });
    on("test", () => this.test());
    at("speed").addEventListener("change", () => page.ask("speed", { factor: Number(at("speed").value) }));
    at("mode").addEventListener("change", () => page.ask("mode", { plc: page.plc, mode: at("mode").value }));
    at("slider").addEventListener("change", () => this.view(Number(at("slider").value)));
  }

  begin() {
    const about = this.page.about;
    const fixed = about.read_only || about.writable !== null;
    options(at("mode"), about.modes);
    at("pace").hidden = about.real;
    for (const id of ["run", "pause", "step", "ten", "speed"]) at(id).disabled = about.read_only;
    for (const id of ["mode", "warm", "cold", "statement"]) at(id).disabled = fixed;
    at("statement").hidden = about.real;
    at("branch").hidden = !about.branches || fixed;
    at("others").hidden = !about.futures.length;
    at("future").replaceChildren(new Option("this one", "-1"), ...about.futures.map((name, number) => new Option(name, String(number))));
    at("test").hidden = !about.tests;
    at("test").disabled = false;
  }

  update(update, state) {
    if (update.state) {
      at("state").textContent = NAMES[update.state] ?? update.state;
      at("state").dataset.state = update.state;
    }
    if (update.forces) this.forces(Object.entries(update.forces));
    if (update.trap) this.page.fail(update.trap);
    if (update.mode) at("mode").value = update.mode;
    if (update.speed !== undefined) at("speed").value = String(update.speed);
    if (update.scan !== undefined || update.ns !== undefined) {
      const seconds = (state.ns / 1e9).toFixed(3);
      at("where").textContent = state.scan < 0 ? "before the first scan" : `scan ${state.scan}, ${seconds} s`;
    }
    if (update.taken) at("where").title = update.taken;
    if (update.held || update.scan !== undefined) {
      const [first, last] = state.held;
      Object.assign(at("slider"), { min: first, max: Math.max(first, last), disabled: last < first });
      at("slider").value = state.scan;
      at("slider").setAttribute("aria-valuetext", `scan ${state.scan} of ${first} to ${last}`);
      at("now").disabled = state.state !== "past";
    }
    if (update.state) at("now").disabled = at("branch").disabled = update.state !== "past";
    if (update.state && update.state !== "past") at("future").value = "-1";
  }

  // What is forced stands in the head, whatever panels are open.
  forces(rows) {
    at("held").hidden = !rows.length;
    at("held").textContent = `${rows.length} forced`;
    at("held").title = `${rows.map(([name, value]) => `${name} = ${value}`).join("\n")}\nClick to watch`;
  }

  view(scan) {
    const future = Number(at("future").value);
    return this.page.ask("view", { plc: this.page.plc, scan, ...(future >= 0 ? { future } : {}) });
  }

  async travel(scans) {
    const { state, scan, held } = this.page.state;
    if (state === "run" && !this.page.about.read_only) await this.page.ask("pause");
    const wanted = Math.min(held[1], Math.max(held[0], scan + scans));
    if (scans > 0 && state === "past" && scan === held[1]) await this.page.ask("view", { plc: this.page.plc });
    else await this.view(wanted);
  }

  async test() {
    const made = await this.page.ask("test", { plc: this.page.plc });
    if (made) save("test_by_hand.py", made.text, "text/x-python");
  }

  key(event) {
    const many = event.shiftKey ? 10 : 1;
    const calls = {
      r: () => at("run").click(), p: () => at("pause").click(), s: () => at("step").click(), n: () => at("statement").click(), S: () => at("ten").click(),
      ArrowLeft: () => this.travel(-many), ArrowRight: () => this.travel(many), End: () => at("now").click(),
      "?": () => at("keys").showModal(),
    };
    calls[event.key]?.();
    return event.key in calls;
  }
}

// The network panel: frames with their scans, and faults that are switched on and off.

import { at, make, options, save } from "/dom.js";

const MOST_FRAMES = 500;

export class NetworkPanel {
  constructor(page) {
    this.page = page;
    this.frames = [];
    at("only").addEventListener("input", () => this.draw());
    at("pcapng").addEventListener("click", async () => {
      const made = await page.ask("capture", { plc: page.plc });
      if (made) save(`${page.plc}.pcapng`, Uint8Array.from(atob(made.pcapng), (one) => one.charCodeAt(0)), "application/octet-stream");
    });
    at("break").addEventListener("click", () => this.switchOn());
    at("kind").addEventListener("change", () => this.measure());
    for (const id of ["peer", "much"]) at(id).addEventListener("keydown", (event) => { if (event.key === "Enter") this.switchOn(); });
  }

  // How much of the fault that is chosen, where it has a measure: a time, or percent.
  measure() {
    const kind = this.page.about.measures[at("kind").value];
    at("measure").hidden = !kind;
    at("unit").textContent = kind ?? "";
    at("much").value = kind === "percent" ? "10" : "100ms";
  }

  switchOn() {
    const [kind, peer, much] = ["kind", "peer", "much"].map((id) => at(id).value.trim());
    const measure = this.page.about.measures[kind];
    this.page.ask("fault", { kind, ...(peer ? { peer } : {}), ...(measure && much ? { [measure]: measure === "percent" ? Number(much) : much } : {}) });
  }

  begin() {
    this.frames = [];
    const { about } = this.page;
    options(at("kind"), Object.keys(about.faults));
    for (const option of at("kind").options) option.title = about.faults[option.value];
    this.measure();
    at("break").disabled = about.read_only || about.writable !== null;
    this.draw();
  }

  update(update) {
    if (update.faults) {
      at("faults").replaceChildren(...update.faults.map((fault, number) => make("li", {}, `${fault.kind} at ${fault.peer}: ${fault.meaning} `,
        make("button", { on: { click: () => this.page.ask("mend", { number }) }, "aria-label": `End the fault ${fault.kind}` }, "end"))));
    }
    if (!update.frames) return;
    const known = new Set(this.frames.map((frame) => frame.number));
    this.frames = [...this.frames, ...update.frames.filter((frame) => !known.has(frame.number))].slice(-MOST_FRAMES);
    this.draw();
  }

  draw() {
    const wanted = at("only").value.toLowerCase();
    const rows = this.frames.filter((frame) => `${frame.from} ${frame.to} ${frame.info}`.toLowerCase().includes(wanted)).slice(-200).reverse();
    at("frames").replaceChildren(...rows.map((frame) => make("li", {},
      make("button", { class: "chip", title: "Look at this scan", on: { click: () => this.page.scan.view(frame.scan) } }, `scan ${frame.scan}`),
      make("span", { class: frame.out ? "out" : "in" }, `${frame.out ? "→" : "←"} ${frame.from} to ${frame.to}`), `  ${frame.info}`,
      frame.data ? make("code", {}, frame.data.replace(/(..)/g, "$1 ")) : "")));
    if (!rows.length) at("frames").append(make("li", { class: "dim" }, this.frames.length ? "No frame fits the filter." : "No frame has passed yet."));
  }
}

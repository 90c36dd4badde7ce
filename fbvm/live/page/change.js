// The bar of a program that has changed on disk: what is wrong with it, beside its lines, or the restart with it.

import { at, make } from "/dom.js";

export class ChangeBar {
  constructor(page) {
    this.page = page;
    at("restart").addEventListener("click", () => page.ask("restart"));
  }

  begin() {
    const { about } = this.page;
    at("change").hidden = true;
    at("restart").disabled = about.read_only || about.writable !== null;
  }

  update(update) {
    if (update.change === undefined) return;
    const { change } = update;
    at("change").hidden = !change;
    if (!change) return;
    const files = change.files.join(", ");
    const count = change.mistakes.length;
    at("changed").textContent = change.ready ? `${files} has changed; the program before goes on.`
      : count ? `${files} has changed and has ${count} error${count > 1 ? "s" : ""}; the program before goes on.` : `${files} has changed and is checked …`;
    at("restart").hidden = !change.ready;
    at("mistakes").tBodies[0].replaceChildren(...change.mistakes.map((one) => make("tr", {},
      make("th", { scope: "row", class: "mono" }, `${one.file}:${one.line}`), make("td", { class: "mono" }, one.text.trim()),
      make("td", { class: "mistake" }, `${one.code} ${one.message}`))));
    this.page.panels.program.mark(change.mistakes);
  }
}

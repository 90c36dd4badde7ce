// The panels: what happened inside the scan, the memory at its end, what passed the network.

const POWER = -1;
const PHASES = {"-1": "inputs", "-2": "program over", "-3": "I/O refresh"};

/** An element with a class and children; text is text, never markup. */
function element(tag, kind = "", ...children) {
  const made = document.createElement(tag);
  if (kind) made.className = kind;
  made.append(...children);
  return made;
}

/** Scrolls a row into view, up or down only. */
function reveal(row) {
  const hold = row.closest(".hold"), inner = row.getBoundingClientRect(), outer = hold.getBoundingClientRect();
  if (inner.top < outer.top + 30) hold.scrollTop -= outer.top + 30 - inner.top;
  else if (inner.bottom > outer.bottom) hold.scrollTop += inner.bottom - outer.bottom + 8;
}

class ScanPanel {
  constructor(run, state, move) {
    this.run = run;
    this.state = state;
    this.move = move;
    this.table = document.getElementById("rows");
    this.drawn = "";
  }

  draw() {
    const {scan, pinned, every, power} = this.state, key = JSON.stringify([scan, pinned, every, power]);
    if (key !== this.drawn) this.fill();
    this.drawn = key;
    for (const row of this.table.tBodies[0].rows) {
      const now = Number(row.dataset.row) === this.state.row;
      if (now && !row.classList.contains("now")) reveal(row);
      row.classList.toggle("now", now);
    }
  }

  /** The rungs and charts of the scan as drawings; what has power is heavy and coloured. */
  rungs() {
    const shown = this.state.power ? this.run.ladder(this.state.scan) : [];
    return shown.map(([instance, number]) => {
      const picture = element("pre");
      const path = this.run.data.instances[instance], [head, ...lines] = this.run.picture(number).split("\n");
      picture.append(element("b", "", head), element("span", "dim", path ? `  in ${path}\n` : "\n"));
      for (const line of lines) picture.append(new DOMParser().parseFromString(line, "image/svg+xml").documentElement);
      return picture;
    });
  }

  fill() {
    document.getElementById("ladder").replaceChildren(...this.rungs());
    const {run, state} = this, rows = run.rows(state.scan), known = new Map();
    const before = number => known.get(number) ?? run.text(number, state.scan - 1);
    const heads = ["", ...state.pinned.map(number => run.signals[number].name), "what it changed"];
    this.table.tHead.replaceChildren(element("tr", "", ...heads.map(text => element("th", "", text))));
    const made = [];
    rows.forEach(([where, instance, ...moved], at) => {
      const changes = [];
      if (moved[0] === POWER) {
        if (state.every) made.push(this.element(at, where, moved[1] === "1"));
        return;
      }
      for (let place = 0; place < moved.length; place += 2) {
        const signal = run.signals[moved[place]];
        changes.push([moved[place], signal, run.show(signal, before(moved[place])), run.show(signal, moved[place + 1])]);
        known.set(moved[place], moved[place + 1]);
      }
      if (where >= 0 && !changes.length && !state.every) return;
      made.push(this.row(at, where, instance, changes, before));
    });
    if (!made.length) made.push(element("tr", "phase", this.nothing(rows)));
    this.table.tBodies[0].replaceChildren(...made);
  }

  /** An element of a rung, and whether it conducts; a coil, whether power arrives. */
  element(at, where, on) {
    const [file, line, text] = this.run.data.sites[where], row = element("tr", "power");
    row.dataset.row = at;
    row.addEventListener("click", () => this.move({row: at}));
    const cell = element("td", "", element("span", "dim mono", `${file.split("/").pop()}:${line} `), element("code", "", text));
    row.append(cell, ...this.state.pinned.map(() => element("td")), element("td", on ? "flows" : "dim", on ? "━━ ON" : "╌╌ off"));
    return row;
  }

  /** Why nothing is shown of the scan, and buttons to the nearest scans of which it is. */
  nothing(rows) {
    const {run, state} = this, cell = element("td");
    if (rows.length) cell.append("no statement changed anything in this scan");
    else if (run.data.depth === "scans") cell.append("recorded at scan ends only; --depth statements shows the inside");
    else {
      const before = run.windows.findLast(window => window.last < state.scan), behind = run.windows.find(window => window.first > state.scan);
      cell.append("what happened inside this scan is not on the page; it has the inside of ");
      for (const [window, to, text] of [[before, before?.last, "◀ "], [behind, behind?.first, "▶ "]]) {
        if (!window) continue;
        const button = element("button", "window", `${text}scan${window.first < window.last ? `s ${window.first} to` : ""} ${window.last}`);
        button.addEventListener("click", event => {
          event.stopPropagation();
          this.move({scan: to});
        });
        cell.append(button, " ");
      }
      if (!run.windows.length) cell.append("no scan");
    }
    return cell;
  }

  row(at, where, instance, changes, value) {
    const row = element("tr", where < 0 ? "phase" : "");
    row.dataset.row = at;
    row.addEventListener("click", () => this.move({row: at}));
    const place = element("td");
    if (where < 0) place.append(PHASES[where]);
    else {
      const [file, line, text] = this.run.data.sites[where], path = this.run.data.instances[instance];
      place.append(element("span", "dim mono", `${file.split("/").pop()}:${line} `), element("code", "", text));
      if (path) place.append(element("span", "dim", ` in ${path}`));
    }
    const cells = this.state.pinned.map(number => {
      const moved = changes.some(([other]) => other === number), signal = this.run.signals[number];
      return element("td", "mono", element("span", moved ? "moved" : "dim", this.run.show(signal, value(number))));
    });
    const list = element("td", "changes");
    for (const [, signal, old, now] of changes) {
      const one = element("div", "", element("b", "", signal.name), " ");
      if (old !== now) one.append(element("span", "old", `${old} → `));
      one.append(element("span", "moved mono", now));
      list.append(one);
    }
    row.append(place, ...cells, list);
    return row;
  }
}

class MemoryPanel {
  constructor(run, state, move) {
    this.run = run;
    this.state = state;
    this.move = move;
    this.bits = this.unit();
    const areas = [...(this.bits.size ? ["unit"] : []), ...Object.keys(run.words)];
    const alive = [...this.bits.values()].some(row => run.words[row.area]?.has(row.word));
    state.area = alive ? "unit" : areas.find(area => area !== "unit" && area !== "A") ?? areas[0] ?? "";
    this.buttons = areas.map(area => {
      const button = element("button", "", area === "unit" ? "Ethernet unit" : area);
      button.addEventListener("click", () => move({area}));
      button.dataset.area = area;
      return button;
    });
    document.getElementById("areas").append(...this.buttons);
  }

  /** The words that a unit describes: by area and address their bits' names, and a name of their own. */
  unit() {
    const found = new Map();
    for (const [address, said] of Object.entries(this.run.data.described)) {
      const match = address.match(/^(CIO|[A-Z]\w*?) ?(\d+)(?:\.(\d+))?$/);
      if (!match) continue;
      const key = `${match[1]} ${match[2]}`, row = found.get(key) ?? {area: match[1], word: Number(match[2]), bits: {}, said: ""};
      if (match[3]) row.bits[Number(match[3])] = said; else row.said = said;
      found.set(key, row);
    }
    return found;
  }

  draw() {
    for (const button of this.buttons) button.setAttribute("aria-pressed", button.dataset.area === this.state.area);
    const words = document.getElementById("words");
    words.replaceChildren(...(this.state.area === "unit" ? this.described() : [this.grid()]));
  }

  show(value) {
    return this.state.hex ? value.toString(16).toUpperCase().padStart(4, "0") : String(value);
  }

  described() {
    const made = [];
    for (const row of this.bits.values()) {
      const live = this.run.words[row.area]?.has(row.word);
      if (!live && !this.state.all) continue;
      made.push(this.word(row));
    }
    return made.length ? made : [element("p", "dim", "no word of the unit was ever other than 0")];
  }

  word({area, word, bits, said}) {
    const scan = this.state.scan, value = this.run.word(area, word, scan), before = this.run.word(area, word, scan - 1);
    const name = area === "CIO" ? `CIO ${word}` : `${area}${word}`, meaning = this.run.data.meanings[name]?.[value];
    const moved = this.run.wordMoved(area, word, scan);
    const head = element("h3", "", element("span", "mono", name), ` = `, element("span", moved ? "moved mono" : "mono", this.show(value)));
    head.append(` ${said}`, meaning ? element("span", "dim", ` (${meaning})`) : "");
    const made = element("div", "word", head);
    made.dataset.word = name;
    if (!Object.keys(bits).length) return made;
    const cells = element("div", "bits"), list = element("ul", "said");
    for (let bit = 15; bit >= 0; bit--) {
      const on = value >> bit & 1, turned = scan > this.run.first && (value ^ before) >> bit & 1;
      const cell = element("span", `${on ? "on" : ""} ${turned ? "moved" : ""}`, String(bit));
      cell.title = bits[bit] ?? "";
      cells.append(cell);
    }
    for (const [bit, text] of Object.entries(bits)) {
      const on = value >> bit & 1, address = `${name}.${bit.padStart(2, "0")}`, variable = this.run.data.names[address];
      const item = element("li", on ? "on" : "dim", `.${bit.padStart(2, "0")} ${on ? "ON " : "OFF"} ${text}`);
      if (variable) item.append(element("span", "dim", ` ${variable}`));
      if (on || this.state.all || (value ^ before) >> bit & 1) list.append(item);
    }
    made.append(cells, list);
    return made;
  }

  /** Ten words a line, only lines with words that were ever written. */
  grid() {
    const area = this.state.area, words = this.run.words[area] ?? new Map(), lines = [...new Set([...words.keys()].map(at => Math.floor(at / 10)))];
    const head = element("tr", "", element("th"), ...Array.from({length: 10}, (_, at) => element("th", "", `+${at}`)));
    const made = element("table", "grid", element("thead", "", head)), body = element("tbody");
    for (const line of lines.sort((one, other) => one - other)) {
      const row = element("tr", "", element("th", "", `${area}${area === "CIO" ? " " : ""}${line * 10}`));
      for (let at = line * 10; at < line * 10 + 10; at++) {
        const value = this.run.word(area, at, this.state.scan), cell = element("td", value ? "" : "zero", this.show(value));
        const address = `${area}${area === "CIO" ? " " : ""}${at}`;
        if (this.run.wordMoved(area, at, this.state.scan)) cell.classList.add("moved");
        cell.title = [address, String(value), this.run.data.names[address], this.run.data.described[address]].filter(Boolean).join("  ");
        row.append(cell);
      }
      body.append(row);
    }
    made.append(body);
    return made;
  }
}

class FramesPanel {
  constructor(run, state, move) {
    this.run = run;
    this.state = state;
    this.move = move;
    this.list = document.getElementById("passed");
    this.drawn = null;
  }

  /** The parts of the packets around the cursor: the one of its scan, or before it, and its neighbours. */
  parts() {
    const all = this.run.data.frames, near = Math.max(0, all.findLastIndex(([first]) => first <= this.state.scan));
    return [Math.max(0, near - 1), Math.min(all.length, near + 2)];
  }

  fill(from, to) {
    const rows = [], packets = count => element("li", "dim", `${count} packet${count === 1 ? "" : "s"}`);
    const count = (first, last) => this.run.data.frames.slice(first, last).reduce((sum, [, , size]) => sum + size, 0);
    if (from) rows.push(packets(`${count(0, from)} earlier`));
    for (let part = from; part < to; part++) rows.push(...this.run.frames(part).map(frame => this.row(frame)));
    if (to < this.run.packets.length) rows.push(packets(`${count(to)} later`));
    this.list.replaceChildren(...(rows.length ? rows : [element("li", "dim", "nothing passed the network, or the trace does not hold it")]));
  }

  row(frame) {
    const button = element("button"), row = element("li", "", button);
    button.append(element("span", frame.out ? "out" : "in", frame.out ? "↑ " : "↓ "),
                  element("span", "dim", `scan ${frame.scan}, ${showTime(this.run.time(frame.scan))}  `),
                  `${frame.sender} → ${frame.receiver}  `, element("b", "", frame.said));
    button.addEventListener("click", () => this.move({scan: frame.scan, row: -1}));
    if (frame.hex) row.append(element("code", "", frame.hex.toUpperCase().replace(/(..)(?=.)/g, "$1 ")));
    row.dataset.scan = frame.scan;
    return row;
  }

  draw() {
    const [from, to] = this.parts();
    if (this.drawn !== `${from} ${to}`) this.fill(from, to);
    this.drawn = `${from} ${to}`;
    let found = null;
    for (const row of this.list.children) {
      const now = Number(row.dataset.scan) === this.state.scan;
      row.classList.toggle("now", now);
      if (now) found ??= row;
    }
    if (found) reveal(found);
  }
}

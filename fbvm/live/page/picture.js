// The picture panel: a drawing of the user's machine, whose elements show values and write them.  fbvm has made the drawing safe.

import { at, drawing, inSvg, make, number, options, remember, remembered } from "/dom.js";

const OTHER_MS = 300; // so long the button of another PLC is held at least: its scans are not seen here

export class PicturePanel {
  constructor(page) {
    this.page = page;
    this.pictures = [];
    this.values = {};
    this.changes = [];
    this.pressed = []; // what is let go as soon as a scan has seen it: number of the scan, and how
    this.held = new Set(); // how the buttons that are held are let go
    at("drawing").addEventListener("change", () => {
      remember("picture", at("drawing").value);
      this.build();
    });
  }

  begin() {}

  update(update, state) {
    if (update.scan !== undefined) this.let(state);
    if (update.forces) for (const row of at("bound").querySelectorAll("tr")) row.children[2].classList.toggle("forced", row.dataset.plc === this.page.plc && row.dataset.name in state.forces);
    if (update.picture) this.values = update.picture;
    // All is sent again whenever the page looks at something else; a drawing that stays keeps its focus and what is held.
    const isOther = update.pictures && JSON.stringify(update.pictures) !== JSON.stringify(this.pictures);
    if (isOther) {
      this.pictures = update.pictures;
      options(at("drawing"), this.pictures.map((one) => one.title), remembered("picture", ""));
      at("chooser").hidden = this.pictures.length < 2;
      this.build();
    } else if (update.picture) {
      this.show();
    }
  }

  build() {
    for (const end of [...this.held]) end();
    const picture = this.pictures[Math.max(0, at("drawing").selectedIndex)];
    if (!picture) return;
    at("wrong").textContent = picture.problems.join("\n");
    const svg = picture.svg ? drawing(picture.svg, picture.title) : "";
    if (svg) svg.setAttribute("role", "group");
    at("machine").replaceChildren(svg);
    this.changes = [];
    at("bound").tBodies[0].replaceChildren(...(svg ? picture.bindings.map((binding) => this.bind(svg, binding)) : []));
    this.show();
  }

  // Prepares an element for what it shows; returns the row of the table in which it is read.
  bind(svg, binding) {
    const element = svg.querySelector(`#m-${CSS.escape(binding.element)}`);
    const cell = make("td", { class: "value" });
    const what = [(text) => { cell.textContent = text; }];
    if (binding.text !== undefined) what.push((text) => { (element.querySelector("tspan") ?? element).textContent = binding.text.replace("{}", text.replace(/^'(.*)'$/, "$1")); });
    if (binding.color) what.push((text) => { element.style.fill = binding.color[text] ?? binding.color.else ?? ""; });
    if (binding.visible !== undefined) what.push((text) => { element.style.visibility = text === binding.visible ? "visible" : "hidden"; });
    if (binding.fill) what.push(filled(svg, element, binding.fill));
    if (binding.rotate) what.push(turned(element, binding.rotate));
    if (binding.move) what.push(moved(element, binding.move));
    this.changes.push([binding.key, what]);
    const wanted = binding.click;
    if (wanted !== undefined && !this.page.about?.read_only) this.clicked(element, binding);
    if (binding.plc === this.page.plc && binding.name in (this.page.state.forces ?? {})) cell.classList.add("forced");
    return make("tr", { "data-plc": binding.plc, "data-name": binding.name }, make("th", { scope: "row" }, binding.element), make("td", { class: "mono" }, `${binding.plc}: ${binding.name}`), cell,
      make("td", { class: "dim" }, wanted === undefined ? "" : wanted === "toggle" ? "click: the other value" : wanted === "press" ? "TRUE while held" : `click: ${wanted}`));
  }

  clicked(element, { plc, name, key, click, element: id }) {
    const write = (value, more = {}) => this.page.ask("write", { plc, name, value, ...more });
    element.setAttribute("role", "button");
    element.setAttribute("tabindex", "0");
    element.setAttribute("aria-label", `${id}: writes ${name}`);
    const down = click === "press" ? () => write("TRUE", { held: true }) : () => write(click === "toggle" ? (this.values[key] === "TRUE" ? "FALSE" : "TRUE") : click);
    const up = click === "press" ? () => this.release(plc, pressed, () => write("FALSE")) : () => {};
    let pressed = null;
    const begin = (event) => {
      event.preventDefault();
      if (!this.held.has(end)) pressed = down();
      this.held.add(end);
    };
    const end = () => {
      if (this.held.delete(end)) up();
    };
    element.addEventListener("pointerdown", (event) => {
      if (event.isTrusted) element.setPointerCapture(event.pointerId);
      begin(event);
    });
    for (const kind of ["pointerup", "pointercancel", "blur"]) element.addEventListener(kind, end);
    element.addEventListener("keydown", (event) => { if (event.key === "Enter" || event.key === " ") begin(event); });
    element.addEventListener("keyup", (event) => { if (event.key === "Enter" || event.key === " ") end(); });
  }

  // Calls `up` when a scan has seen what was pressed, however short that was.
  async release(plc, pressed, up) {
    const found = await pressed;
    if (plc !== this.page.plc) setTimeout(up, OTHER_MS);
    else this.pressed.push([found?.scan ?? 0, up]);
    this.let(this.page.state);
  }

  let({ scan }) {
    const seen = this.pressed.filter(([first]) => scan >= first);
    this.pressed = this.pressed.filter(([first]) => scan < first);
    for (const [, up] of seen) up();
  }

  show() {
    for (const [key, what] of this.changes) for (const change of what) if (this.values[key] !== undefined) change(this.values[key]);
  }
}

// How far a value is between two others, 0 to 1.
function part(text, [low, high]) {
  return ((number(text) ?? low) - low) / (high - low);
}

// Cuts an element from above, so that it is seen as far as it is filled.
function filled(svg, element, range) {
  const box = element.getBBox();
  const clip = inSvg("clipPath", { id: `fill-of-${element.id}` });
  const rect = inSvg("rect", { x: box.x, width: box.width });
  clip.append(rect);
  svg.append(clip);
  element.setAttribute("clip-path", `url(#${clip.id})`);
  return (text) => {
    const height = Math.min(1, Math.max(0, part(text, range))) * box.height;
    rect.setAttribute("y", box.y + box.height - height);
    rect.setAttribute("height", height);
  };
}

function turned(element, range) {
  const box = element.getBBox();
  const before = element.getAttribute("transform") ?? "";
  return (text) => {
    element.setAttribute("transform", `${before} rotate(${(part(text, range) % 1) * 360} ${box.x + box.width / 2} ${box.y + box.height / 2})`);
  };
}

function moved(element, { from, by: [right, down] }) {
  const before = element.getAttribute("transform") ?? "";
  return (text) => {
    element.setAttribute("transform", `translate(${part(text, from) * right} ${part(text, from) * down}) ${before}`);
  };
}

// Elements of the page.  Texts of users only ever become text nodes; drawings are parsed as XML and hold no script.

export const at = (id) => document.getElementById(id);

export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "on") for (const [event, call] of Object.entries(value)) element.addEventListener(event, call);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

export function inSvg(tag, attributes) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

export function options(select, names, chosen) {
  select.replaceChildren(...names.map((name) => make("option", { value: name }, name)));
  if (names.includes(chosen)) select.value = chosen;
}

const DRAWN = new Set(["svg", "path", "text", "style", "rect", "line", "g", "defs", "symbol", "use", "title", "desc", "circle", "ellipse", "polyline",
  "polygon", "tspan", "linearGradient", "radialGradient", "stop", "clipPath", "marker", "pattern"]);

export function drawing(text, label) {
  const found = new DOMParser().parseFromString(text, "image/svg+xml").documentElement;
  if (found.nodeName !== "svg" || [...found.querySelectorAll("*")].some((one) => !DRAWN.has(one.nodeName))) return make("p", {}, label);
  const svg = document.importNode(found, true);
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", label);
  return svg;
}

export const cut = (text, most) => (text.length > most ? `${text.slice(0, most)}…` : text);

// An integer in another radix; every other value as it is.
export function inRadix(text, radix, bytes) {
  if (radix === 10 || !/^-?\d+$/.test(text)) return text;
  const number = BigInt.asUintN(8 * (bytes || 8), BigInt(text));
  return `${radix}#${number.toString(radix).toUpperCase().padStart(radix === 16 ? 2 * (bytes || 0) : 8 * (bytes || 0), "0")}`;
}

export function save(name, text, kind = "text/plain") {
  const link = make("a", { href: URL.createObjectURL(new Blob([text], { type: kind })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

export function remember(key, value) {
  try {
    sessionStorage.setItem(`fbvm.${key}`, JSON.stringify(value));
  } catch {
    // a frame of an editor may have no storage: then nothing is remembered
  }
}

export function remembered(key, otherwise) {
  try {
    return JSON.parse(sessionStorage.getItem(`fbvm.${key}`)) ?? otherwise;
  } catch {
    return otherwise;
  }
}

// The number that a literal means; TRUE is 1, a time is in seconds; null for what is none.
export function number(text) {
  if (text === "TRUE" || text === "FALSE") return text === "TRUE" ? 1 : 0;
  const found = /^-?\d+(\.\d+)?(e[-+]?\d+)?$/i.test(text ?? "") ? Number(text) : null;
  if (found !== null) return found;
  const time = /^T#(-?)(?:(\d+)d)?(?:(\d+)h)?(?:(\d+)m(?!s))?(?:([\d.]+)s)?(?:([\d.]+)ms)?/.exec(text ?? "");
  if (!time) return null;
  const [, sign, d = 0, h = 0, m = 0, s = 0, ms = 0] = time;
  return (sign ? -1 : 1) * (((Number(d) * 24 + Number(h)) * 60 + Number(m)) * 60 + Number(s) + Number(ms) / 1000);
}

// The panel of scan times: how many scans took how long, by the host's clock.

import { at, inSvg, make } from "/dom.js";

const WIDTH = 600;
const HEIGHT = 160;

export class TimesPanel {
  begin() {
    at("histogram").replaceChildren(make("p", { class: "dim" }, "No scan was measured yet."));
  }

  update(update) {
    if (update.taken) at("taken").textContent = update.taken;
    if (!update.times?.length) return;
    const rows = grouped(update.times);
    const most = Math.max(...rows.map(([, count]) => count));
    const all = rows.reduce((sum, [, count]) => sum + count, 0);
    const svg = inSvg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT + 40}`, role: "img",
      "aria-label": `Of ${all} scans: ${rows.map(([time, count]) => `${count} from ${said(time)}`).join(", ")}` });
    const wide = WIDTH / rows.length;
    rows.forEach(([time, count], number) => {
      const height = count ? Math.max(2, (Math.log10(count + 1) / Math.log10(most + 1)) * HEIGHT) : 0;
      svg.append(inSvg("rect", { x: number * wide + 2, width: Math.max(1, wide - 4), y: HEIGHT - height + 16, height }));
      const label = inSvg("text", { x: (number + 0.5) * wide, y: HEIGHT + 34, "text-anchor": "middle" });
      label.textContent = said(time);
      const amount = inSvg("text", { x: (number + 0.5) * wide, y: HEIGHT - height + 12, "text-anchor": "middle" });
      amount.textContent = count ? String(count) : "";
      svg.append(label, amount);
    });
    at("histogram").replaceChildren(make("figure", { class: "histogram" }, svg, make("figcaption", { class: "dim" }, "Scans by their time, from the time below each bar on; heights are logarithmic")));
  }
}

// Bars from 1, 2 and 5 times a power of ten.
function grouped(bins) {
  const bounds = [];
  for (let power = 1; power < 1e13; power *= 10) bounds.push(power, 2 * power, 5 * power);
  const counts = new Map();
  for (const [time, count] of bins) {
    const bound = bounds.findLast((one) => one <= Math.max(1, time));
    counts.set(bound, (counts.get(bound) ?? 0) + count);
  }
  const used = [...counts.keys()].sort((one, other) => one - other);
  return bounds.filter((one) => one >= used[0] && one <= used.at(-1)).map((one) => [one, counts.get(one) ?? 0]);
}

function said(ns) {
  return ns >= 1e9 ? `${ns / 1e9} s` : ns >= 1e6 ? `${ns / 1e6} ms` : ns >= 1e3 ? `${ns / 1e3} µs` : `${ns} ns`;
}

// Puts the page together: one state, moved by keys, buttons and fingers; everything is drawn from it.

/** The head of the data, and the parts behind it. */
function unpack() {
  const text = atob(document.getElementById("data").textContent), bytes = new Uint8Array(text.length);
  for (let at = 0; at < text.length; at++) bytes[at] = text.charCodeAt(at);
  const size = new DataView(bytes.buffer).getUint32(0, true);
  return [inflateJson(bytes.subarray(4, 4 + size)), bytes.subarray(4 + size)];
}

function start(data, bytes) {
  const run = new Run(data, bytes), span = Math.max(5, Math.min(run.count, 400));
  const pinned = data.pinned.map(name => run.signals.findIndex(signal => signal.name === name)).filter(number => number >= 0);
  const state = {scan: run.first, row: -1, start: run.first, span, chosen: pinned[0] ?? 0, filter: "", moving: false, pinned,
                 every: false, power: true, hex: true, all: false, area: "", panel: "scan"};
  const chart = new Chart(run, state, move);
  const panels = {scan: new ScanPanel(run, state, move), memory: new MemoryPanel(run, state, move),
                  frames: new FramesPanel(run, state, move)};
  const where = document.getElementById("where");
  let waiting = 0, writing = 0, choose = true, shown = null, naming = 0, named = location.hash, took = 0;

  /** Changes the state and has everything drawn anew with the next picture. */
  function move(change) {
    const before = {...state};
    Object.assign(state, change);
    state.scan = Math.min(Math.max(state.scan, run.first), Math.max(run.first, run.last));
    if (state.scan !== before.scan && !("row" in change)) state.row = -1;
    if ("scan" in change) {
      if (state.scan < state.start) state.start = state.scan - state.span * .1;
      if (state.scan >= state.start + state.span) state.start = state.scan + 1 - state.span * .9;
    }
    state.start = Math.min(Math.max(state.start, run.first), Math.max(run.first, run.last + 1 - state.span));
    choose ||= state.filter !== before.filter || state.moving !== before.moving
      || state.moving && (state.start !== before.start || state.span !== before.span);
    waiting ||= requestAnimationFrame(draw);
  }

  function draw() {
    const begun = performance.now();
    cancelAnimationFrame(waiting);
    waiting = 0;
    if (choose) chart.choose();
    const moved = choose || shown !== `${state.scan} ${state.row} ${state.chosen}`, later = chart.values(moved), isRough = chart.draw();
    choose = false;
    shown = `${state.scan} ${state.row} ${state.chosen}`;
    const rows = run.rows(state.scan).length, inside = state.row >= 0 ? `, step ${state.row + 1} of ${rows}` : "";
    where.textContent = run.count ? `scan ${state.scan}, ${showTime(run.time(state.scan))}${inside}` : "no scans";
    for (const tab of document.querySelectorAll("#tabs button")) {
      tab.setAttribute("aria-selected", tab.dataset.panel === state.panel);
      document.getElementById(tab.dataset.panel).classList.toggle("shown", tab.dataset.panel === state.panel);
    }
    for (const [name, panel] of Object.entries(panels)) {
      if (document.getElementById(name).offsetParent) panel.draw();
    }
    clearTimeout(naming);
    naming = setTimeout(name, 200);
    if (isRough) move({});
    else if (later) writing ||= requestAnimationFrame(write);
    took = performance.now() - begun;
  }

  /** Writes the scan into the address, unless somebody has just written another one there. */
  function name() {
    if (location.hash !== named) return;
    named = `#${state.scan}`;
    history.replaceState(null, "", named);
  }

  /** Goes to the scan that the address names. */
  function follow() {
    const wanted = parseInt(location.hash.slice(1), 10);
    named = location.hash;
    if (Number.isFinite(wanted)) move({scan: wanted});
  }

  /** Goes on with the rows beside the chart for which there was no time; the chart itself stays. */
  function write() {
    writing = chart.values(false) ? requestAnimationFrame(write) : 0;
  }

  /** A step inside the scan; behind the last one comes the next scan. */
  function step(direction) {
    const rows = run.rows(state.scan);
    const wanted = at => state.every || rows[at][0] < 0 || rows[at].length > 2 && rows[at][2] !== POWER;
    let row = state.row < 0 && direction < 0 ? rows.length : state.row;
    do row += direction; while (row >= 0 && row < rows.length && !wanted(row));
    if (row >= 0 && row < rows.length) move({row});
    else if (direction > 0 && state.scan < run.last) move({scan: state.scan + 1, row: run.rows(state.scan + 1).length ? 0 : -1});
    else if (direction < 0 && state.scan > run.first) move({scan: state.scan - 1, row: run.rows(state.scan - 1).length - 1});
  }

  const help = document.getElementById("help"), filter = document.getElementById("filter");
  const moves = {
    first: () => move({scan: run.first}), last: () => move({scan: run.last}),
    back: () => move({scan: state.scan - 1}), on: () => move({scan: state.scan + 1}),
    row: () => step(1), rowback: () => step(-1),
    in: () => chart.zoom(.5), out: () => chart.zoom(2),
    fit: () => move({start: run.first, span: Math.max(5, run.count)}),
    help: () => help.open ? help.close() : help.showModal(),
  };
  const keys = {
    ArrowLeft: event => move({scan: state.scan - (event.shiftKey ? 10 : 1)}),
    ArrowRight: event => move({scan: state.scan + (event.shiftKey ? 10 : 1)}),
    ArrowUp: moves.rowback, ArrowDown: moves.row, Home: moves.first, End: moves.last,
    n: () => move({scan: run.change(state.chosen, state.scan, 1)}), p: () => move({scan: run.change(state.chosen, state.scan, -1)}),
    "+": moves.in, "=": moves.in, "-": moves.out, 0: moves.fit, "?": moves.help,
    "/": () => filter.focus(),
    1: () => move({panel: "scan"}), 2: () => move({panel: "memory"}), 3: () => move({panel: "frames"}),
  };
  document.addEventListener("keydown", event => {
    if (event.target === filter && event.key === "Escape") filter.blur();
    if (event.target.matches("input") && event.target.type !== "checkbox" || event.ctrlKey || event.metaKey || event.altKey || help.open) return;
    const act = keys[event.key];
    if (act) {
      event.preventDefault();
      act(event);
    }
  });
  for (const button of document.querySelectorAll("[data-move]")) button.addEventListener("click", moves[button.dataset.move]);
  for (const tab of document.querySelectorAll("#tabs button")) tab.addEventListener("click", () => move({panel: tab.dataset.panel}));
  filter.addEventListener("input", () => move({filter: filter.value}));
  for (const name of ["moving", "every", "power", "hex", "all"]) {
    const box = document.getElementById(name);
    box.addEventListener("change", () => move({[name]: box.checked}));
  }
  document.getElementById("flow").hidden = !data.pictures;
  addEventListener("hashchange", follow);
  move({scan: data.pinned.length ? run.last : run.first});
  follow();
  draw();
  // for those who measure or test the page
  window.fbvm = {move, count: run.count, drawn: () => took, written: () => !waiting && chart.isWritten, opened: performance.now()};
}

try {
  start(...unpack());
} catch (error) {
  document.getElementById("where").textContent = `this page cannot be shown: ${error.message ?? error}`;
}

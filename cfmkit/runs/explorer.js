"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const by = (id) => document.getElementById(id);
  const keys = [...document.querySelectorAll(".key")].map((row) => ({
    row, path: row.dataset.path, unit: row.dataset.unit, value: row.dataset.value, home: row.parentElement,
    range: row.querySelector('[type="range"]'), text: row.querySelector('[type="text"]'),
    label: row.querySelector("label"), short: row.querySelector("label").textContent, wrong: row.querySelector(".wrong"),
    now: null,
  }));
  const COLOURS = ["#0072B2", "#D55E00", "#1A1A1A", "#9933FF", "#C28570", "#663300"];
  const SVG = "http://www.w3.org/2000/svg";
  const STOPPED = { problem: ["the explorer has been stopped; start cfmkit explore again"] };
  const LEADING = 5, RANKING_MS = 8000;
  const FRAME = { left: 62, right: 622, top: 16, bottom: 352 };
  let busy = false, waiting = false, resting = 0, whole = false, shown = null, here = null, scale = null;

  const changes = () => keys.filter((key) => key.now !== null).map((key) => `${key.path}=${key.now}`);

  async function ask(path, more = {}) {
    const answer = await fetch(path, {
      method: "POST", body: JSON.stringify({ changes: changes(), ...more }),
      headers: { "Content-Type": "application/json", "X-Token": data.token },
    });
    return answer.json();
  }

  async function update() {
    by("reset").disabled = !changes().length;
    if (busy) { waiting = true; return; }
    busy = true;
    try {
      do { waiting = false; show(await ask("answer")); } while (waiting);
    } catch { show(STOPPED); }
    busy = false;
    clearTimeout(resting);
    resting = setTimeout(draw, 350);
  }

  async function draw() {
    // the markup is the server's own drawing, in which every text is escaped; the policy of the page admits styles of a
    // script, not of markup
    try {
      by("mechanism").innerHTML = ((await ask("drawing")).svg || "").replaceAll(' style="', ' data-style="');
      for (const part of by("mechanism").querySelectorAll("[data-style]")) part.style.cssText = part.dataset.style;
    } catch { by("mechanism").textContent = ""; }
  }

  function put(parent, tag, text, attributes = {}) {
    const made = parent.namespaceURI === SVG ? document.createElementNS(SVG, tag) : document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    if (text !== null) made.textContent = text;
    parent.append(made);
    return made;
  }

  // --- what is wrong stands below its field; the rest beside the verdict
  function mark(places) {
    const left = [];
    for (const key of keys) { key.wrong.hidden = true; key.text.removeAttribute("aria-invalid"); }
    for (const { path, message } of places) {
      const near = (key) => key.path === path || path.startsWith(`${key.path}.`) || key.path.startsWith(`${path}.`);
      const changed = keys.filter((key) => key.now !== null && near(key));
      if (!changed.length) left.push(path ? `${path}: ${message}` : message);
      for (const key of changed) {
        key.text.setAttribute("aria-invalid", "true");
        key.wrong.textContent = message; key.wrong.hidden = false;
      }
    }
    return left;
  }

  function show(found) {
    const wrong = found.problem, left = mark(found.places || []);
    document.body.classList.toggle("stale", Boolean(wrong) || !found.curve);
    by("verdict").className = `verdict ${wrong ? "bad" : found.tone}`;
    by("verdict").children[0].textContent = wrong ? "not valid" : found.verdict;
    const texts = wrong && found.places ? left : wrong || [found.summary, found.message].filter(Boolean);
    by("verdict").children[1].textContent = texts.join("; ") || (wrong ? "see the marked field" : "");
    if (wrong) return;
    by("seconds").textContent = `, computed in ${(1000 * found.seconds).toFixed(0)} ms`;
    by("badges").replaceChildren();
    for (const one of found.rows.filter((row) => row.ok !== null)) {
      put(by("badges"), "li", `${one.label} ${one.value}${one.ok ? "" : ", missed"}`, { class: one.ok ? "good" : "bad", title: one.about });
    }
    by("rows").replaceChildren();
    for (const one of found.rows) {
      const row = put(by("rows"), "tr", null, { title: one.about });
      put(row, "th", one.label, { scope: "row" }); put(row, "td", one.value, { class: "value" });
      put(row, "td", one.bound); put(row, "td", one.ok === null ? "" : one.ok ? "ok" : "MISSED", { class: one.ok ? "good" : "bad" });
    }
    by("notes").replaceChildren();
    for (const [word, text] of found.notes) { put(by("notes"), "dt", word); put(by("notes"), "dd", text); }
    by("warnings").replaceChildren();
    for (const one of found.warnings) put(by("warnings"), "li", `${one.name.replaceAll("_", " ")}: ${one.short}`, { title: one.text });
    if (found.curve) { shown = found.curve; plot(); }
  }

  // --- the curve, zoomed to its window with the bands of the requirements
  function ticks(low, high) {
    const rough = (high - low) / 6, ten = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((one) => one * ten).find((one) => one >= rough);
    const found = [];
    for (let at = Math.ceil(low / step) * step; at <= high + step * 1e-9; at += step) found.push(at);
    return found.map((at) => Number(at.toPrecision(6)));
  }

  const lines = (curve) => Object.values(curve.branches);

  function limits(curve, all) {
    const zoomed = !whole && curve.window, points = all.flatMap((one) => lines(one).flatMap(([xs, ys]) => xs.map((x, at) => [x, ys[at]])))
      .filter(([x, y]) => x !== null && y !== null);
    if (!points.length) return null;
    const xs = points.map(([x]) => x), [from, to] = zoomed ? curve.window : [Math.min(...xs), Math.max(...xs)];
    const room = zoomed ? 0.06 * (to - from) : 0;
    const inside = points.filter(([x]) => x >= from && x <= to).map(([, y]) => y).sort((a, b) => a - b);
    const values = inside.length ? inside : points.map(([, y]) => y).sort((a, b) => a - b);
    // a force without bound would flatten everything else
    const cut = (share) => values[Math.min(values.length - 1, Math.floor(share * values.length))];
    const bounds = curve.bands.flatMap((band) => [band.low, band.high]).filter((value) => value !== null);
    const ends = zoomed ? [...bounds, cut(0.002), cut(0.998)] : [0, cut(0.01), cut(0.99)];
    const [lowest, highest] = [Math.min(...ends), Math.max(...ends)];
    const slack = 0.1 * (highest - lowest || Math.abs(highest) || 1);
    return { left: from - room, right: to + room, low: zoomed || lowest < 0 ? lowest - slack : 0, high: highest + slack };
  }

  function plot() {
    const svg = by("curve"), curve = shown, first = changes().length ? data.first.curve : null;
    const found = limits(curve, [curve, ...(first ? [first] : [])]);
    by("zoom").hidden = !curve.window;
    svg.replaceChildren();
    if (!found) return;
    const { left, right, low, high } = found, F = FRAME;
    const x = (value) => F.left + (F.right - F.left) * (value - left) / (right - left || 1);
    const y = (value) => F.bottom - (F.bottom - F.top) * (value - low) / (high - low);
    scale = { x, y, value: (at) => left + (right - left) * (at - F.left) / (F.right - F.left) };
    for (const at of ticks(low, high)) {
      put(svg, "line", null, { x1: F.left, x2: F.right, y1: y(at), y2: y(at) });
      put(svg, "text", at, { x: 56, y: y(at) + 4, "text-anchor": "end" });
    }
    for (const at of ticks(left, right)) put(svg, "text", at, { x: x(at), y: 370, "text-anchor": "middle" });
    put(svg, "line", null, { x1: F.left, x2: F.left, y1: F.top, y2: F.bottom, class: "axis" });
    put(svg, "line", null, { x1: F.left, x2: F.right, y1: F.bottom, y2: F.bottom, class: "axis" });
    put(svg, "text", curve.x, { x: 342, y: 392, "text-anchor": "middle" });
    put(svg, "text", curve.y, { x: 14, y: 184, "text-anchor": "middle", transform: "rotate(-90 14 184)" });
    put(put(svg, "clipPath", null, { id: "inside" }), "rect", null, { x: F.left, y: 10, width: 562, height: 344 });
    const inside = { "clip-path": "url(#inside)" };
    for (const band of curve.bands) {
      const up = y(band.high ?? high), down = y(band.low ?? low);
      const area = { x: x(band.from), y: up, width: x(band.to) - x(band.from), height: Math.max(down - up, 0) };
      put(put(svg, "rect", null, { ...area, class: `band ${band.ok ? "" : "bad"}`, ...inside }), "title", band.text);
    }
    const line = ([across, up]) => across.map((value, at) => value === null || up[at] === null ? "" :
      `${at && across[at - 1] !== null && up[at - 1] !== null ? "L" : "M"}${x(value).toFixed(1)} ${y(up[at]).toFixed(1)}`).join("");
    for (const one of first ? lines(first) : []) put(svg, "path", null, { d: line(one), class: "before", ...inside });
    Object.entries(curve.branches).forEach(([name, one], number, every) => {
      const colour = COLOURS[number % COLOURS.length];
      put(svg, "path", null, { d: line(one), stroke: colour, class: "now", ...inside });
      if (every.length > 1) put(svg, "text", name, { x: 72 + 90 * number, y: 26 }).style.fill = colour;
    });
    read(here);
  }

  // the motion and the effort of every branch at a place, linear between the points of the path
  function read(place) {
    by("curve").querySelectorAll(".here").forEach((one) => one.remove());
    here = place;
    if (place === null || !shown) { by("reading").textContent = ""; return; }
    const unit = (name) => name.slice(name.indexOf("[") + 1, -1), digits = (value) => Number(value.toPrecision(4));
    const told = Object.entries(shown.branches).flatMap(([name, [xs, ys]]) => {
      const at = xs.findIndex((one, k) => k && one !== null && xs[k - 1] !== null && (xs[k - 1] - place) * (one - place) <= 0);
      if (at < 1 || ys[at] === null || ys[at - 1] === null) return [];
      const share = xs[at] === xs[at - 1] ? 0 : (place - xs[at - 1]) / (xs[at] - xs[at - 1]);
      const value = ys[at - 1] + share * (ys[at] - ys[at - 1]);
      put(by("curve"), "circle", null, { cx: scale.x(place), cy: scale.y(value), r: 3.5, class: "here", "clip-path": "url(#inside)" });
      return [`${Object.keys(shown.branches).length > 1 ? name + " " : ""}${digits(value)} ${unit(shown.y)}`];
    });
    put(by("curve"), "line", null, { x1: scale.x(place), x2: scale.x(place), y1: FRAME.top, y2: FRAME.bottom, class: "here" });
    by("reading").textContent = `${digits(place)} ${unit(shown.x)}: ${told.join(", ") || "no value"}`;
  }

  by("curve").addEventListener("pointermove", (event) => {
    const box = by("curve").getScreenCTM();
    const at = (event.clientX - box.e) / box.a;
    if (scale && at >= FRAME.left && at <= FRAME.right) read(scale.value(at));
  });
  by("curve").addEventListener("pointerleave", () => read(null));
  by("curve").addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step || !scale) return;
    event.preventDefault();
    const now = here === null ? (FRAME.left + FRAME.right) / 2 : scale.x(here) + 10 * step;
    read(scale.value(Math.min(Math.max(now, FRAME.left), FRAME.right)));
  });
  by("zoom").addEventListener("click", () => {
    whole = !whole;
    by("zoom").setAttribute("aria-pressed", String(whole));
    if (shown) plot();
  });

  // --- values: sliders, fields with units and decimal commas, undo
  function understood(text) {
    const plain = text.trim().replace(/^\u2212/, "-").replace(/^([-+]?\d*),(\d+)(?!.*,)/, "$1.$2");
    const [, number, unit] = /^([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)$/.exec(plain) || [null, plain, ""];
    return { number, unit };
  }

  function set(key, typed) {
    const { number, unit } = understood(typed), own = !unit || unit === key.unit;
    key.now = own && Number(number) === Number(key.value) ? null : [number, unit || key.unit].filter(Boolean).join(" ");
    key.text.value = own ? number : `${number} ${unit}`;
    if (own && Number.isFinite(Number(number))) key.range.value = number;
    key.row.classList.toggle("changed", key.now !== null);
  }

  const undone = [];
  const state = () => keys.map((key) => [key.text.value, key.range.value, key.now]);
  let last = state();
  function commit() {
    undone.push(last);
    last = state();
    by("undo").disabled = false;
  }

  function undo() {
    const before = undone.pop();
    if (!before) return;
    keys.forEach((key, k) => {
      [key.text.value, key.range.value, key.now] = before[k];
      key.row.classList.toggle("changed", key.now !== null);
    });
    last = before;
    by("undo").disabled = !undone.length;
    update();
  }

  for (const key of keys) {
    key.range.addEventListener("input", () => { set(key, key.range.value); update(); });
    key.range.addEventListener("change", commit);
    key.text.addEventListener("change", () => { set(key, key.text.value); commit(); update(); });
  }
  by("undo").addEventListener("click", undo);
  document.addEventListener("keydown", (event) => {
    const typing = event.target.matches('input[type="text"], input[type="search"]');
    if (event.key === "z" && (event.ctrlKey || event.metaKey) && !typing) { event.preventDefault(); undo(); }
  });
  by("controls").addEventListener("submit", (event) => event.preventDefault());
  by("reset").addEventListener("click", () => {
    for (const key of keys) {
      key.range.value = key.value; key.text.value = key.text.defaultValue; key.now = null;
      key.row.classList.remove("changed");
    }
    commit();
    update();
  });

  // --- the values of the largest influence first, the others folded
  function lead(chosen) {
    for (const key of keys) {
      key.label.textContent = key.short;
      const later = keys.find((other) => keys.indexOf(other) > keys.indexOf(key) && other.home === key.home && other.row.parentElement === key.home);
      if (key.row.parentElement !== key.home) key.home.insertBefore(key.row, later ? later.row : null);
    }
    for (const key of chosen) {
      key.label.textContent = key.path.replace(/^mechanism\./, "").replaceAll(/[._]/g, " ");
      by("leading").append(key.row);
    }
    by("leading").hidden = false;
    tidy();
  }

  async function rank() {
    const candidates = keys.filter((key) => key.path.startsWith("mechanism."));
    if (candidates.length <= LEADING) return;
    lead(candidates.slice(0, LEADING));
    by("others").open = false;
    const end = performance.now() + RANKING_MS, found = [];
    for (const key of candidates) {
      if (performance.now() > end || undone.length) break;
      try { found.push([key, (await ask("influence", { changes: [], name: key.path })).influence || 0]); } catch { return; }
    }
    found.sort((one, other) => other[1] - one[1]);
    // nothing moves below a hand that is at work
    if (!undone.length && !by("controls").contains(document.activeElement)) lead(found.slice(0, LEADING).map(([key]) => key));
    document.body.dataset.ranked = String(found.length);
  }

  function tidy() {
    for (const group of document.querySelectorAll("fieldset")) group.hidden = !group.querySelector(".key:not([hidden])");
  }

  by("find").addEventListener("input", () => {
    const words = by("find").value.toLowerCase().split(/\s+/).filter(Boolean);
    for (const key of keys) {
      const text = `${key.path.replaceAll("_", " ")} ${key.path} ${key.row.title}`.toLowerCase();
      key.row.hidden = !words.every((word) => text.includes(word));
    }
    by("others").open = words.length > 0 || !by("leading").querySelector(".key");
    tidy();
  });

  // --- what is taken away
  async function copy(kind) {
    const found = await ask(kind).catch(() => STOPPED);
    const text = found[kind] || found.problem.join("\n");
    by("yaml").textContent = text; by("yaml").hidden = false;
    try { await navigator.clipboard.writeText(text); by("said").textContent = "copied"; }
    catch { by("said").textContent = "select and copy the text below"; }
  }
  by("command").addEventListener("click", () => copy("command"));
  by("copy").addEventListener("click", () => copy("yaml"));
  by("save").addEventListener("click", async () => {
    const found = await ask("save", { name: by("name").value.trim() }).catch(() => STOPPED);
    by("said").textContent = found.saved ? `saved as ${found.saved}` : found.problem.join("; ");
  });
  by("reset").disabled = true;
  show(data.first);
  draw();
  rank();
})();

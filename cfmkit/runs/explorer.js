"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const by = (id) => document.getElementById(id);
  const keys = [...document.querySelectorAll(".key")].map((row) => ({
    row, path: row.dataset.path, unit: row.dataset.unit, value: row.dataset.value,
    range: row.querySelector('[type="range"]'), text: row.querySelector('[type="text"]'), now: null,
  }));
  const COLOURS = ["#0072B2", "#D55E00", "#1A1A1A", "#9933FF", "#C28570", "#663300"];
  const SVG = "http://www.w3.org/2000/svg";
  const STOPPED = { problem: ["the explorer has been stopped; start cfmkit explore again"] };
  let busy = false, waiting = false, resting = 0;

  const changes = () => keys.filter((key) => key.now !== null)
    .map((key) => `${key.path}=${key.now}${key.unit ? " " + key.unit : ""}`);

  async function ask(path, more = {}) {
    const answer = await fetch(path, {
      method: "POST", body: JSON.stringify({ changes: changes(), ...more }),
      headers: { "Content-Type": "application/json", "X-Token": data.token },
    });
    return answer.json();
  }

  async function update() {
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

  function show(found) {
    const wrong = found.problem;
    document.body.classList.toggle("stale", Boolean(wrong) || !found.curve);
    by("verdict").className = `verdict ${wrong ? "bad" : found.tone}`;
    by("verdict").children[0].textContent = wrong ? "not valid" : found.verdict;
    by("verdict").children[1].textContent = wrong ? wrong.join("; ") : found.message;
    if (wrong) return;
    by("seconds").textContent = `, computed in ${(1000 * found.seconds).toFixed(0)} ms`;
    by("badges").replaceChildren();
    for (const one of found.requirements) put(by("badges"), "li", one.sentence, { class: one.ok ? "good" : "bad" });
    by("metrics").replaceChildren();
    for (const [name, value, about] of found.metrics) {
      const box = put(by("metrics"), "div", null, { title: about });
      put(box, "dt", name); put(box, "dd", value);
    }
    by("warnings").replaceChildren();
    for (const one of found.warnings) put(by("warnings"), "li", `${one.name.replaceAll("_", " ")}: ${one.message}`);
    if (found.curve) plot(found.curve);
  }

  function ticks(low, high) {
    const rough = (high - low) / 6, ten = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((one) => one * ten).find((one) => one >= rough);
    const found = [];
    for (let at = Math.ceil(low / step) * step; at <= high + step * 1e-9; at += step) found.push(at);
    return found.map((at) => Number(at.toPrecision(6)));
  }

  function plot(curve) {
    const svg = by("curve"), first = data.first.curve, all = [curve, ...(first ? [first] : [])];
    const values = (side) => all.flatMap((one) => Object.values(one.branches).flatMap((lines) => lines[side]))
      .filter((value) => value !== null);
    const xs = values(0), sorted = values(1).sort((a, b) => a - b);
    if (!xs.length) return;
    // a force without bound would flatten everything else
    const cut = (share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
    const [left, right] = [Math.min(...xs), Math.max(...xs)];
    const [lowest, highest] = [Math.min(0, cut(0.01)), Math.max(0, cut(0.99))];
    const room = 0.08 * (highest - lowest || 1), low = lowest < 0 ? lowest - room : 0, high = highest + room;
    const x = (value) => 62 + 560 * (value - left) / (right - left || 1);
    const y = (value) => 352 - 336 * (value - low) / (high - low);
    svg.replaceChildren();
    for (const at of ticks(low, high)) {
      put(svg, "line", null, { x1: 62, x2: 622, y1: y(at), y2: y(at) });
      put(svg, "text", at, { x: 56, y: y(at) + 4, "text-anchor": "end" });
    }
    for (const at of ticks(left, right)) put(svg, "text", at, { x: x(at), y: 370, "text-anchor": "middle" });
    put(svg, "line", null, { x1: 62, x2: 62, y1: 16, y2: 352, class: "axis" });
    put(svg, "line", null, { x1: 62, x2: 622, y1: 352, y2: 352, class: "axis" });
    put(svg, "text", curve.x, { x: 342, y: 392, "text-anchor": "middle" });
    put(svg, "text", curve.y, { x: 14, y: 184, "text-anchor": "middle", transform: "rotate(-90 14 184)" });
    const clip = put(put(svg, "clipPath", null, { id: "inside" }), "rect", null, { x: 62, y: 10, width: 562, height: 344 });
    const line = ([across, up]) => across.map((value, at) => value === null || up[at] === null ? "" :
      `${at && across[at - 1] !== null && up[at - 1] !== null ? "L" : "M"}${x(value).toFixed(1)} ${y(up[at]).toFixed(1)}`).join("");
    const inside = { "clip-path": "url(#inside)" };
    if (first && changes().length) {
      for (const lines of Object.values(first.branches)) put(svg, "path", null, { d: line(lines), class: "before", ...inside });
    }
    Object.entries(curve.branches).forEach(([name, lines], number, every) => {
      const colour = COLOURS[number % COLOURS.length];
      put(svg, "path", null, { d: line(lines), stroke: colour, class: "now", ...inside });
      if (every.length > 1) put(svg, "text", name, { x: 72 + 90 * number, y: 26 }).style.fill = colour;
    });
    void clip;
  }

  function set(key, value) {
    key.now = Number(value) === Number(key.value) ? null : value;
    key.row.classList.toggle("changed", key.now !== null);
  }

  for (const key of keys) {
    key.range.addEventListener("input", () => {
      key.text.value = key.range.value;
      set(key, key.range.value);
      update();
    });
    key.text.addEventListener("change", () => {
      set(key, key.text.value.trim());
      if (Number.isFinite(Number(key.text.value))) key.range.value = key.text.value;
      update();
    });
  }
  by("controls").addEventListener("submit", (event) => event.preventDefault());
  by("find").addEventListener("input", () => {
    const words = by("find").value.toLowerCase().split(/\s+/);
    for (const key of keys) {
      const text = `${key.path.replaceAll("_", " ")} ${key.path} ${key.row.title}`.toLowerCase();
      key.row.hidden = !words.every((word) => text.includes(word));
    }
    for (const group of document.querySelectorAll("fieldset")) group.hidden = !group.querySelector(".key:not([hidden])");
  });
  by("reset").addEventListener("click", () => {
    for (const key of keys) {
      key.range.value = key.value; key.text.value = key.text.defaultValue; set(key, key.value);
    }
    update();
  });
  by("copy").addEventListener("click", async () => {
    const found = await ask("yaml").catch(() => STOPPED);
    const text = found.yaml || found.problem.join("\n");
    by("yaml").textContent = text; by("yaml").hidden = false;
    try { await navigator.clipboard.writeText(text); by("said").textContent = "copied"; }
    catch { by("said").textContent = "select and copy the text below"; }
  });
  by("save").addEventListener("click", async () => {
    const found = await ask("save", { name: by("name").value.trim() }).catch(() => STOPPED);
    by("said").textContent = found.saved ? `saved as ${found.saved}` : found.problem.join("; ");
  });
  show(data.first);
  draw();
})();

"use strict";
(() => {
  const data = JSON.parse(document.getElementById("study-data").textContent);
  const { head, columns, varied, curves, command } = data;
  const total = columns.length ? columns[0].length : 0;
  const PAGE = 50; // rows at a time: a table of thousands is slow to scroll and nobody reads it
  const body = document.querySelector("#table tbody");
  const heads = [...document.querySelectorAll("#table th")];
  const filter = document.getElementById("filter");
  const count = document.getElementById("count");
  const point = document.getElementById("point");
  const chosen = new Map();
  let order = { column: -1, up: true }, first = 0, found = [], shown = -1;

  const text = (value) => (value === null ? "" : String(typeof value === "number" ? Number(value.toPrecision(6)) : value));
  const create = (name, properties = {}, ...inner) => {
    const made = Object.assign(document.createElement(name), properties);
    made.append(...inner);
    return made;
  };

  // as a button: Enter and the space bar do what a click does
  const act = (made, does) => {
    made.tabIndex = 0;
    made.addEventListener("click", does);
    made.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      does();
    });
  };
  const matches = (row) => {
    for (const [column, value] of chosen) if (columns[column][row] !== value) return false;
    const wanted = filter.value.trim().toLowerCase();
    return !wanted || columns.some((column) => text(column[row]).toLowerCase().includes(wanted));
  };
  const compare = (one, other) => {
    const [a, b] = [one, other].map((row) => columns[order.column][row]);
    const down = order.up ? 1 : -1;
    if (a === b) return one - other;
    if (a === null) return 1;
    if (b === null) return -1;
    return (typeof a === "number" && typeof b === "number" ? a - b : text(a).localeCompare(text(b))) * down;
  };
  const update = () => {
    found = [];
    for (let row = 0; row < total; row += 1) if (matches(row)) found.push(row);
    if (order.column >= 0) found.sort(compare);
    first = 0;
    draw();
  };
  const draw = () => {
    body.replaceChildren(...found.slice(first, first + PAGE).map((row) => {
      const line = create("tr", { className: "pick" }, ...columns.map((column) => create("td", { textContent: text(column[row]) })));
      line.classList.toggle("chosen", row === shown);
      act(line, () => { open(row); point.scrollIntoView({ block: "nearest" }); });
      return line;
    }));
    const last = Math.min(first + PAGE, found.length);
    count.textContent = `${found.length ? first + 1 : 0} to ${last} of ${found.length}, ${total} points in all`;
    document.getElementById("less").disabled = first === 0;
    document.getElementById("more").disabled = last >= found.length;
  };

  const SVG = "http://www.w3.org/2000/svg";
  const shape = (name, attributes, content = "") => {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.textContent = content;
    return made;
  };
  const ticks = (low, high) => {
    const raw = (high - low) / 5 || 1, decade = 10 ** Math.floor(Math.log10(raw));
    const step = decade * [1, 2, 5, 10].find((one) => one * decade >= raw);
    const marks = [];
    for (let at = Math.ceil(low / step) * step; at <= high + 1e-9 * step; at += step) marks.push(Number(at.toPrecision(10)));
    return marks;
  };
  const chart = (branches) => {
    const [W, H, L, B, R, T] = [640, 340, 64, 44, 12, 32]; // names of the branches stand above the diagram
    const all = Object.values(branches), xs = all.flatMap((one) => one[0]), ys = all.flatMap((one) => one[1]);
    const span = (values) => [Math.min(...values), Math.max(...values)];
    const [x0, x1] = span(xs), [low, high] = span([0, ...ys]);
    const x = (value) => L + ((value - x0) / (x1 - x0 || 1)) * (W - L - R);
    const y = (value) => H - B - ((value - low) / (high - low || 1)) * (H - B - T);
    const made = shape("svg", { viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": `${curves.y} over ${curves.x}` });
    for (const mark of ticks(x0, x1)) {
      made.append(shape("line", { x1: x(mark), x2: x(mark), y1: T, y2: H - B, stroke: "#ddd" }));
      made.append(shape("text", { x: x(mark), y: H - B + 16, "text-anchor": "middle", "font-size": 12, fill: "#262626" }, String(mark)));
    }
    for (const mark of ticks(low, high)) {
      made.append(shape("line", { x1: L, x2: W - R, y1: y(mark), y2: y(mark), stroke: "#ddd" }));
      made.append(shape("text", { x: L - 6, y: y(mark) + 4, "text-anchor": "end", "font-size": 12, fill: "#262626" }, String(mark)));
    }
    made.append(shape("text", { x: (L + W) / 2, y: H - 6, "text-anchor": "middle", "font-size": 13, fill: "#262626" }, curves.x));
    made.append(shape("text", { x: 14, y: H / 2, "text-anchor": "middle", "font-size": 13, fill: "#262626", transform: `rotate(-90 14 ${H / 2})` }, curves.y));
    const looks = [["#0072B2", ""], ["#D55E00", "7 3"], ["#1A1A1A", "2 2"], ["#9933FF", "9 3 2 3"]];
    Object.entries(branches).forEach(([name, [px, py]], number) => {
      const [color, dash] = looks[number % looks.length];
      const points = px.map((value, at) => `${x(value).toFixed(1)},${y(py[at]).toFixed(1)}`).join(" ");
      made.append(shape("polyline", { points, fill: "none", stroke: color, "stroke-width": 2, "stroke-dasharray": dash }));
      if (name) made.append(shape("text", { x: L + 10 + 110 * number, y: T - 12, "font-size": 13, fill: color }, name));
    });
    return made;
  };
  const open = (row) => {
    const told = varied.map((column) => {
      const [, path, unit] = /^(.*?)(?: \[(.*)\])?$/.exec(head[column]);
      const value = columns[column][row], behind = unit && unit !== "1" ? ` ${unit}` : "";
      return { path, shown: `${text(value)}${behind}`, exact: `${value === null ? "" : value}${behind}` };
    });
    const title = create("h3", { textContent: `point ${row + 1}: ${told.map((one) => `${one.path} ${one.shown}`).join(", ")}` });
    const branches = curves.points && curves.points[row];
    const figure = branches
      ? create("figure", {}, chart(branches))
      : create("pre", {}, create("code", { textContent: [command, ...told.map((one) => `--set '${one.path}=${one.exact}'`)].join(" ") }));
    point.replaceChildren(title, figure);
    shown = row;
    [...body.children].forEach((line, at) => line.classList.toggle("chosen", found[first + at] === row));
  };

  heads.forEach((cell, column) => {
    const sort = () => {
      order = { column, up: order.column === column ? !order.up : true };
      heads.forEach((one, at) => one.setAttribute("aria-sort", at === column ? (order.up ? "ascending" : "descending") : "none"));
      update();
    };
    act(cell, sort);
  });
  const sliders = document.getElementById("sliders");
  for (const column of varied) {
    const values = [...new Set(columns[column])].sort((a, b) => (typeof a === "number" && typeof b === "number" ? a - b : text(a).localeCompare(text(b))));
    const output = create("output", { textContent: "all" });
    const input = create("input", { type: "range", min: -1, max: values.length - 1, step: 1, value: -1 });
    input.setAttribute("aria-label", head[column]);
    input.addEventListener("input", () => {
      const at = Number(input.value);
      if (at < 0) chosen.delete(column); else chosen.set(column, values[at]);
      output.textContent = at < 0 ? "all" : text(values[at]);
      input.setAttribute("aria-valuetext", output.textContent);
      update();
      if (found.length === 1) open(found[0]);
    });
    sliders.append(create("label", {}, create("span", { textContent: head[column] }), input, output));
  }
  filter.addEventListener("input", update);
  document.getElementById("more").addEventListener("click", () => { if (first + PAGE < found.length) { first += PAGE; draw(); } });
  document.getElementById("less").addEventListener("click", () => { first = Math.max(0, first - PAGE); draw(); });
  document.documentElement.classList.add("moved");
  update();
})();

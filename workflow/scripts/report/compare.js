// The plot of weighted F1 whose experiments can be switched on and off (see section_headline.py).
(() => {
  const { form, data: { curves: data, rejecting, axis } } = shared.start("compare");
  const plot = shared.byId("compare-plot"), legend = shared.byId("compare-legend");
  const HEIGHT = 420, LEFT = 52, RIGHT = 12, TOP = 12, BOTTOM = 46;

  const unique = (values) => [...new Set(values)];
  const inputs = (name) => [...form.querySelectorAll(`input[name="${name}"]`)];
  const checked = (name) => inputs(name).filter((input) => input.checked).map((input) => input.value);

  function choices(name, type, values, on) {
    for (const value of values) {
      const label = document.createElement("label"), input = document.createElement("input");
      Object.assign(input, { type, name, value, checked: on(value) });
      label.append(input, " ", value);
      form.querySelector(`[data-choices="${name}"]`).append(label);
    }
  }

  // An SVG element with these attributes within another.
  function add(parent, name, attributes, text) {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    parent?.append(made);
    return made;
  }

  function visible() {
    const [set] = checked("set"), experiments = checked("experiment"), models = checked("model");
    const switched = (curve) => experiments.includes(curve.experiment) && models.includes(curve.model);
    const every = form.elements.every.checked;
    return data.filter((curve) => curve.set === set && (curve.best || curve.shown || every) && switched(curve));
  }

  function draw() {
    const curves = visible(), width = Math.max(plot.clientWidth, 280), right = width - RIGHT, bottom = HEIGHT - BOTTOM;
    const points = (curves.length ? curves : data).flatMap((curve) => curve.points);
    let [first, last] = [Math.min(...points.map((p) => p[0])), Math.max(...points.map((p) => p[0]))];
    if (first === last) [first, last] = [first - 1, last + 1];
    const [set] = checked("set"), rejected = rejecting[set] || [];
    const low = Math.floor(10 * Math.min(...points.map((p) => p[2] ?? p[1]), ...rejected)) / 10;
    const x = (snr) => LEFT + ((snr - first) / (last - first)) * (right - LEFT);
    const y = (value) => TOP + ((1 - value) / (1 - low || 1)) * (bottom - TOP);
    const svg = add(null, "svg", { viewBox: `0 0 ${width} ${HEIGHT}`, width, height: HEIGHT, "aria-hidden": "true" });
    const line = (x1, x2, y1, y2, style) => add(svg, "line", { x1, x2, y1, y2, class: style });
    const label = (x, y, anchor, text, rest) => add(svg, "text", { x, y, "text-anchor": anchor, ...rest }, text);
    for (const tick of shared.ticks(first, last, width / 90)) {
      line(x(tick), x(tick), TOP, bottom, "grid");
      label(x(tick), bottom + 18, "middle", shared.written(tick));
    }
    for (const tick of shared.ticks(low, 1, 6)) {
      line(LEFT, right, y(tick), y(tick), "grid");
      label(LEFT - 8, y(tick) + 5, "end", tick.toFixed(1));
    }
    const middle = (bottom + TOP) / 2;
    label((LEFT + right) / 2, HEIGHT - 6, "middle", axis);
    label(14, middle, "middle", "weighted F1", { transform: `rotate(-90 14 ${middle})` });
    for (const value of rejected) {
      line(LEFT, right, y(value), y(value), "rejecting");
      label(right, y(value) - 5, "end", `everything rejected: ${value.toFixed(3)}`);
    }
    legend.replaceChildren();
    for (const curve of curves) {
      const group = add(svg, "g", { class: "curve", "data-words": curve.words });
      const path = (column) => curve.points.map((p) => `${x(p[0]).toFixed(1)},${y(p[column]).toFixed(1)}`);
      if (curve.points.every((p) => p[2] !== null)) { // one fold has no interval
        const band = [...path(3), ...path(2).reverse()].join(" ");
        add(group, "polygon", { points: band, fill: curve.color, class: "band" });
      }
      const dashes = curve.dashed ? { "stroke-dasharray": "6 4" } : {};
      add(group, "polyline", { points: path(1).join(" "), stroke: curve.color, fill: "none", ...dashes });
      for (const [snr, value, least, most] of curve.points) {
        const dot = add(group, "circle", { cx: x(snr), cy: y(value), r: 3.5, fill: curve.color });
        const interval = least === null ? "" : ` [${least.toFixed(3)}, ${most.toFixed(3)}]`;
        add(dot, "title", {}, `${curve.words}: ${value.toFixed(3)}${interval} at ${snr} dB`);
      }
      const item = document.createElement("li"), swatch = document.createElement("span"), pair = [item, group];
      swatch.className = curve.dashed ? "swatch dashed" : "swatch";
      swatch.style.color = curve.color;
      item.append(swatch, curve.words);
      const strong = (event) => pair.forEach((part) => part.classList.toggle("strong", event.type === "pointerenter"));
      for (const part of pair) for (const type of ["pointerenter", "pointerleave"]) part.addEventListener(type, strong);
      legend.append(item);
    }
    const nothing = "Nothing to show: none of the experiments switched on has one of the models switched on.";
    if (!curves.length) legend.append(Object.assign(document.createElement("li"), { textContent: nothing }));
    plot.replaceChildren(svg);
    const top = curves.map((curve) => `${curve.words} ${curve.points.at(-1)[1].toFixed(3)}`).join("; ") || "nothing";
    plot.setAttribute("aria-label", `Weighted F1 against test SNR, ${set}. At the highest SNR: ${top}.`);
  }

  const sets = unique(data.map((curve) => curve.set)), start = data.filter((curve) => curve.shown && curve.set === sets[0]);
  choices("set", "radio", sets, (value) => value === sets[0]);
  for (const name of ["experiment", "model"]) {
    const first = start.map((curve) => curve[name]);
    choices(name, "checkbox", unique(data.map((curve) => curve[name])).sort(), (value) => first.includes(value));
  }
  form.addEventListener("change", draw);
  form.addEventListener("click", (event) => {
    const all = event.target.dataset.all;
    if (!all) return;
    const on = checked(all).length < inputs(all).length;
    for (const input of inputs(all)) input.checked = on;
    draw();
  });
  addEventListener("resize", draw);
  draw();
})();

// The plot of weighted F1 whose experiments can be switched on and off (see section_headline.py).
page.live.compare = ({ curves: data, rejecting, axis }) => {
  const form = page.byId("compare-form"), plot = page.byId("compare-plot"), legend = page.byId("compare-legend");
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

  // Markers of radius 1 about 0: curves of one colour have one each.
  const MARKERS = [
    "M-1 0A1 1 0 1 1 1 0A1 1 0 1 1-1 0Z", "M-.9-.9H.9V.9H-.9Z", "M0-1.2 1.1.8H-1.1Z", "M0-1.3 1.1 0 0 1.3-1.1 0Z",
    "M0 1.2 1.1-.8H-1.1Z", "M-.35-1.2H.35V-.35H1.2V.35H.35V1.2H-.35V.35H-1.2V-.35H-.35Z",
  ];

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
    for (const tick of ticks(first, last, width / 90)) {
      line(x(tick), x(tick), TOP, bottom, "grid");
      label(x(tick), bottom + 18, "middle", written(tick));
    }
    for (const tick of ticks(low, 1, 6)) {
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
    const alike = {};
    for (const curve of curves) {
      const marker = MARKERS[(alike[curve.model] = (alike[curve.model] ?? -1) + 1) % MARKERS.length], color = page.ink(curve.color);
      const group = add(svg, "g", { class: "curve", "data-words": curve.words });
      const path = (column) => curve.points.map((p) => `${x(p[0]).toFixed(1)},${y(p[column]).toFixed(1)}`);
      if (curve.points.every((p) => p[2] !== null)) { // one fold has no interval
        const band = [...path(3), ...path(2).reverse()].join(" ");
        add(group, "polygon", { points: band, fill: color, class: "band" });
      }
      const dashes = curve.dashes ? { "stroke-dasharray": curve.dashes } : {};
      add(group, "polyline", { points: path(1).join(" "), stroke: color, fill: "none", ...dashes });
      for (const [snr, value, least, most] of curve.points) {
        const dot = add(group, "path", { d: marker, transform: `translate(${x(snr)} ${y(value)}) scale(4)`, fill: color });
        const interval = least === null ? "" : ` [${least.toFixed(3)}, ${most.toFixed(3)}]`;
        add(dot, "title", {}, `${curve.words}: ${value.toFixed(3)}${interval} at ${snr} dB`);
      }
      const item = document.createElement("li"), pair = [item, group];
      const swatch = add(null, "svg", { viewBox: "-16 -6 32 12", width: 32, height: 12, "aria-hidden": "true" });
      add(swatch, "path", { d: "M-16 0H16", stroke: color, "stroke-width": 2, ...dashes });
      add(swatch, "path", { d: marker, transform: "scale(4)", fill: color });
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
  draw();
  return draw;
};

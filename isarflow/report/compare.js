// The plot of weighted F1 whose experiments can be switched on and off (see section_headline.py).
page.live.compare = ({ curves: data, rejecting, axis }) => {
  const [form, plot, legend] = ["form", "plot", "legend"].map((name) => page.byId(`compare-${name}`));
  const HEIGHT = 420, LEFT = 58, RIGHT = 12, TOP = 12, BOTTOM = 46;
  // Markers of radius 1 about 0: curves of one colour have one each.
  const MARKERS = [
    "M-1 0A1 1 0 1 1 1 0A1 1 0 1 1-1 0Z", "M-.9-.9H.9V.9H-.9Z", "M0-1.2 1.1.8H-1.1Z", "M0-1.3 1.1 0 0 1.3-1.1 0Z",
    "M0 1.2 1.1-.8H-1.1Z", "M-.35-1.2H.35V-.35H1.2V.35H.35V1.2H-.35V.35H-1.2V-.35H-.35Z",
  ];

  const unique = (name) => [...new Set(data.map((curve) => curve[name]))];
  const inputs = (name) => [...form.querySelectorAll(`input[name="${name}"]`)];
  const checked = (name) => inputs(name).filter((input) => input.checked).map((input) => input.value);

  function choices(name, type, values, on) {
    for (const value of values) {
      const label = add(form.querySelector(`[data-choices="${name}"]`), "label");
      add(label, "input", { type, name, value }).checked = on.includes(value);
      label.append(" ", value);
    }
  }

  function draw() {
    const [set] = checked("set"), experiments = checked("experiment"), models = checked("model");
    const curves = data.filter((curve) => curve.set === set && experiments.includes(curve.experiment) &&
      models.includes(curve.model) && (curve.main || curve.shown || form.elements.every.checked));
    const rejected = rejecting[set] || [], width = plot.clientWidth, right = width - RIGHT;
    const points = (curves.length ? curves : data).flatMap((curve) => curve.points), snrs = points.map(([snr]) => snr);
    const [first, last] = [Math.min(...snrs), Math.max(...snrs)], apart = first === last ? 1 : 0;
    const low = Math.floor(10 * Math.min(...points.map(([, value, least]) => least ?? value), ...rejected)) / 10;
    plot.replaceChildren();
    const svg = add(plot, "svg", { viewBox: `0 0 ${width} ${HEIGHT}`, class: "axes" });
    const box = [LEFT, TOP, right - LEFT, HEIGHT - TOP - BOTTOM], across = [first - apart, last + apart];
    const { x, y } = drawAxes(svg, box, across, [Math.min(low, 0.9), 1], [axis, "weighted F1"]);
    for (const value of rejected) {
      add(svg, "path", { d: `M${LEFT} ${y(value)}H${right}`, class: "rejecting" });
      const place = { x: right - 4, y: y(value) - 5, "text-anchor": "end" };
      add(svg, "text", place, `everything rejected: ${value.toFixed(3)}`);
    }
    legend.replaceChildren();
    if (!curves.length) add(legend, "li", {}, "Nothing to show: no experiment switched on has a model switched on.");
    const alike = {};
    for (const curve of curves) {
      alike[curve.model] = (alike[curve.model] ?? -1) + 1;
      drawCurve(curve, MARKERS[alike[curve.model] % MARKERS.length], svg, x, y);
    }
    const top = curves.map((curve) => `${curve.words} ${curve.points.at(-1)[1].toFixed(3)}`).join("; ") || "nothing";
    plot.setAttribute("aria-label", `Weighted F1 against test SNR, ${set}. At the highest SNR: ${top}.`);
  }

  // A curve and its line of the legend; pointing at either singles both out. x, y: places of values.
  function drawCurve({ color, dashes, words, points }, outline, svg, x, y) {
    const marker = { d: outline, fill: page.ink(color) }, path = (k) => points.map((one) => `${x(one[0])},${y(one[k])}`);
    const line = { stroke: page.ink(color), "stroke-dasharray": dashes || "none" };
    const group = add(svg, "g", { class: "curve" }), item = add(legend, "li");
    if (points.every(([, , least]) => least !== null)) { // one fold has no interval
      add(group, "polygon", { points: [...path(3), ...path(2).reverse()].join(" "), fill: marker.fill, class: "band" });
    }
    add(group, "polyline", { points: path(1).join(" "), ...line });
    for (const [snr, value, least, most] of points) {
      const dot = add(group, "path", { ...marker, transform: `translate(${x(snr)} ${y(value)}) scale(4)` });
      const interval = least === null ? "" : ` [${least.toFixed(3)}, ${most.toFixed(3)}]`;
      add(dot, "title", {}, `${words}: ${value.toFixed(3)}${interval} at ${snr} dB`);
    }
    const swatch = add(item, "svg", { viewBox: "-16 -6 32 12", width: 32, height: 12, "aria-hidden": "true" });
    add(swatch, "path", { d: "M-16 0H16", "stroke-width": 2, ...line });
    add(swatch, "path", { ...marker, transform: "scale(4)" });
    item.append(words);
    for (const part of [item, group]) for (const type of ["pointerenter", "pointerleave"]) {
      const strong = (one) => one.classList.toggle("strong", type === "pointerenter");
      part.addEventListener(type, () => [item, group].forEach(strong));
    }
  }

  const [set] = unique("set"), start = data.filter((curve) => curve.shown && curve.set === set);
  choices("set", "radio", unique("set"), [set]);
  for (const name of ["experiment", "model"]) {
    choices(name, "checkbox", unique(name).sort(), start.map((curve) => curve[name]));
  }
  form.addEventListener("change", draw);
  form.addEventListener("click", ({ target: { dataset } }) => {
    if (!dataset.all) return;
    const on = inputs(dataset.all).some((input) => !input.checked);
    inputs(dataset.all).forEach((input) => (input.checked = on));
    draw();
  });
  draw();
  return draw;
};

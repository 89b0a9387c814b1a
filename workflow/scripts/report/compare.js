// The plot of weighted F1 whose experiments can be switched on and off. Its data stand in the page as JSON.
(() => {
  const { curves: data, rejecting } = JSON.parse(document.getElementById("compare-data").textContent);
  const form = document.getElementById("compare-form");
  const plot = document.getElementById("compare-plot");
  const legend = document.getElementById("compare-legend");
  const SVG = "http://www.w3.org/2000/svg";
  const HEIGHT = 420, LEFT = 52, RIGHT = 12, TOP = 12, BOTTOM = 46;

  const unique = (values) => [...new Set(values)];
  const checked = (name) => [...form.querySelectorAll(`input[name="${name}"]:checked`)].map((input) => input.value);

  function choices(name, type, values, on) {
    const box = form.querySelector(`[data-choices="${name}"]`);
    for (const value of values) {
      const label = document.createElement("label"), input = document.createElement("input");
      Object.assign(input, { type, name, value, checked: on(value) });
      label.append(input, " ", value);
      box.append(label);
    }
  }

  function element(name, attributes, text) {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    return made;
  }

  // Steps of 1, 2 or 5 times a power of ten, about `count` of them.
  function ticks(low, high, count) {
    const rough = (high - low || 1) / count, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9; k++) found.push(+(k * step).toFixed(6));
    return found;
  }

  function visible() {
    const set = checked("set")[0], experiments = checked("experiment"), models = checked("model");
    return data.filter(
      (one) =>
        one.set === set &&
        (one.best || one.shown || form.elements.every.checked) &&
        experiments.includes(one.experiment) &&
        models.includes(one.model),
    );
  }

  function draw() {
    const curves = visible(), width = Math.max(plot.clientWidth, 280);
    const points = (curves.length ? curves : data).flatMap((one) => one.points);
    let [first, last] = [Math.min(...points.map((p) => p[0])), Math.max(...points.map((p) => p[0]))];
    if (first === last) [first, last] = [first - 1, last + 1];
    const rejected = rejecting[checked("set")[0]] || [];
    const low = Math.floor(10 * Math.min(...points.map((p) => p[2]), ...rejected)) / 10;
    const x = (snr) => LEFT + ((snr - first) / (last - first)) * (width - LEFT - RIGHT);
    const y = (value) => TOP + ((1 - value) / (1 - low || 1)) * (HEIGHT - TOP - BOTTOM);
    const svg = element("svg", { viewBox: `0 0 ${width} ${HEIGHT}`, width, height: HEIGHT, "aria-hidden": "true" });
    for (const tick of ticks(first, last, width / 90)) {
      svg.append(element("line", { x1: x(tick), x2: x(tick), y1: TOP, y2: HEIGHT - BOTTOM, class: "grid" }));
      const text = `${tick}`.replace("-", "−");
      svg.append(element("text", { x: x(tick), y: HEIGHT - BOTTOM + 18, "text-anchor": "middle" }, text));
    }
    for (const tick of ticks(low, 1, 6)) {
      svg.append(element("line", { x1: LEFT, x2: width - RIGHT, y1: y(tick), y2: y(tick), class: "grid" }));
      svg.append(element("text", { x: LEFT - 8, y: y(tick) + 5, "text-anchor": "end" }, tick.toFixed(1)));
    }
    const middle = (HEIGHT - BOTTOM + TOP) / 2;
    svg.append(element("text", { x: (LEFT + width - RIGHT) / 2, y: HEIGHT - 6, "text-anchor": "middle" }, "test SNR [dB]"));
    const turned = { x: 14, y: middle, "text-anchor": "middle", transform: `rotate(-90 14 ${middle})` };
    svg.append(element("text", turned, "weighted F1"));
    for (const value of rejected) {
      svg.append(element("line", { x1: LEFT, x2: width - RIGHT, y1: y(value), y2: y(value), class: "rejecting" }));
      const text = `everything rejected: ${value.toFixed(3)}`;
      svg.append(element("text", { x: width - RIGHT, y: y(value) - 5, "text-anchor": "end" }, text));
    }
    legend.replaceChildren();
    for (const one of curves) {
      const group = element("g", { class: "curve", "data-words": one.words });
      const line = one.points.map((p) => `${x(p[0]).toFixed(1)},${y(p[1]).toFixed(1)}`);
      const band = [
        ...one.points.map((p) => `${x(p[0]).toFixed(1)},${y(p[3]).toFixed(1)}`),
        ...one.points.map((p) => `${x(p[0]).toFixed(1)},${y(p[2]).toFixed(1)}`).reverse(),
      ];
      group.append(element("polygon", { points: band.join(" "), fill: one.color, class: "band" }));
      const look = { points: line.join(" "), stroke: one.color, fill: "none" };
      group.append(element("polyline", one.dashed ? { ...look, "stroke-dasharray": "6 4" } : look));
      for (const p of one.points) {
        const dot = element("circle", { cx: x(p[0]), cy: y(p[1]), r: 3.5, fill: one.color });
        const text = `${one.words}: ${p[1].toFixed(3)} [${p[2].toFixed(3)}, ${p[3].toFixed(3)}] at ${p[0]} dB`;
        dot.append(element("title", {}, text));
        group.append(dot);
      }
      svg.append(group);
      const item = document.createElement("li"), swatch = document.createElement("span");
      swatch.className = one.dashed ? "swatch dashed" : "swatch";
      swatch.style.color = one.color;
      item.append(swatch, one.words);
      for (const target of [item, group]) {
        target.addEventListener("pointerenter", () => [item, group].forEach((part) => part.classList.add("strong")));
        target.addEventListener("pointerleave", () => [item, group].forEach((part) => part.classList.remove("strong")));
      }
      legend.append(item);
    }
    if (!curves.length) legend.append(Object.assign(document.createElement("li"), { textContent: "Nothing to show: none of the experiments switched on has one of the models switched on." }));
    plot.replaceChildren(svg);
    const top = curves.map((one) => `${one.words} ${one.points.at(-1)[1].toFixed(3)}`).join("; ");
    plot.setAttribute("aria-label", `Weighted F1 against test SNR, ${checked("set")[0]}. At the highest SNR: ${top || "nothing"}.`);
  }

  form.querySelector(".unscripted").remove();
  const sets = unique(data.map((one) => one.set));
  const shown = data.filter((one) => one.shown);
  const start = sets[0];
  choices("set", "radio", sets, (value) => value === start);
  for (const name of ["experiment", "model"]) {
    const first = unique(shown.filter((one) => one.set === start).map((one) => one[name]));
    choices(name, "checkbox", unique(data.map((one) => one[name])).sort(), (value) => first.includes(value));
  }
  form.addEventListener("change", draw);
  form.addEventListener("click", (event) => {
    const all = event.target.dataset.all;
    if (!all) return;
    const boxes = [...form.querySelectorAll(`input[name="${all}"]`)], on = !boxes.every((input) => input.checked);
    for (const input of boxes) input.checked = on;
    draw();
  });
  addEventListener("resize", draw);
  draw();
})();

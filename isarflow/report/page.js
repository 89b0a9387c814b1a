// What the whole page does: unpack its files, draw figures when they are seen, fold, explain words, turn dark, print.
const page = (() => {
  const byId = (name) => document.getElementById(name), root = document.documentElement, live = {};
  // One content may have several paths.
  const files = new Map([...document.querySelectorAll("script[data-file]")].flatMap((one) =>
    one.dataset.file.split(" ").map((path) => [path, one])));

  // The content of a file that the page holds, unpacked and put together again (see page.py).
  async function text(path) {
    const packed = await fetch(`data:application/gzip;base64,${files.get(path).textContent}`);
    const held = await new Response(packed.body.pipeThrough(new DecompressionStream("gzip"))).text();
    if (!held.startsWith("\x1e")) return held;
    const columns = held.slice(1).split("\x1e").map((column) => column.split("\n"));
    return columns[0].map((_, row) => `${columns.map((column) => column[row]).join(",")}\n`).join("");
  }

  // Ink, paper, grid and the darkest colours of curves, light and dark.
  const TURNED = {
    "#000000": "#d5dbe3", "#222222": "#f0f3f6", "#ffffff": "#14181f", "#d9d9d9": "#39414d", "#767676": "#9aa4b1",
    "#a6193c": "#e0567a", "#5b4bb5": "#9d8ff0", "#0072b2": "#4a9fd8", "#00707a": "#2aa5b0", "#7a6a00": "#b5a12a",
    "#3a93c9": "#a5d8f3",
  };
  const dark = (color) => TURNED[color.toLowerCase()] || color, ink = (color) => `light-dark(${color}, ${dark(color)})`;

  // Draw a figure in the page's look; gives when it is drawn.
  const images = [...document.querySelectorAll("img[data-file]")];
  function show(image) {
    if (image.dataset.look !== root.dataset.look) image.drawn = text(image.dataset.file).then((svg) => {
      // Text has no colour of its own: it takes the root's.
      const inked = svg.replace("<svg ", '<svg fill="#000000" '), old = image.src;
      const turned = root.dataset.look === "dark" ? inked.replace(/#[0-9a-f]{6}(?=[;"])/gi, dark) : inked;
      image.src = URL.createObjectURL(new Blob([turned], { type: "image/svg+xml" }));
      return image.decode().catch(() => {}).then(() => URL.revokeObjectURL(old));
    });
    image.dataset.look = root.dataset.look;
    return image.drawn;
  }

  // A live part of the page: `live[name](data)` draws it and gives what draws it anew at another width.
  async function start({ dataset }) {
    const redraw = live[dataset.live](JSON.parse(await text(`${dataset.live}.json`)));
    let width = innerWidth;
    addEventListener("resize", () => {
      if (innerWidth !== width) redraw();
      width = innerWidth;
    });
    dataset.ready = "yes";
  }

  // Words of the glossary lead there, the first time that each stands in a block, and say what they mean.
  const terms = new Map([...document.querySelectorAll("#glossary + dl dt")].map((term) => [term.textContent, term]));
  const words = [...terms.keys()].sort((one, other) => other.length - one.length); // the longest that fits
  const any = new RegExp(`(?<![\\w-])(${words.join("|") || "$^"})(?![\\w-])`);
  function explain(block) {
    const walker = document.createTreeWalker(block, NodeFilter.SHOW_TEXT), nodes = [], said = new Set();
    while (walker.nextNode()) nodes.push(walker.currentNode);
    for (const node of nodes.filter(({ parentElement }) => !parentElement.closest("a, button, output"))) {
      // Every other part is a term.
      node.replaceWith(...node.data.split(any).map((part, k) => {
        if (k % 2 === 0 || said.has(part)) return part;
        said.add(part);
        const { id, nextSibling } = terms.get(part), look = { className: "term", textContent: part };
        return Object.assign(document.createElement("a"), look, { href: `#${id}`, title: nextSibling.textContent });
      }));
    }
  }

  // A page of many figures and words opens at once: each part is drawn or explained when it is nearly seen.
  const eye = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      if (!isIntersecting) continue;
      eye.unobserve(target);
      (target.dataset.file ? show : target.dataset.live ? start : explain)(target);
    }
  }, { rootMargin: "500px" });

  // Folding. The browser itself unfolds what a link leads into.
  const parts = [...document.querySelectorAll("details.part, details.sub")], fold = byId("fold");
  const areOpen = () => parts.every((part) => part.open), unfold = (open) => parts.forEach((part) => (part.open = open));
  parts.forEach((part) => part.addEventListener("toggle", () => {
    fold.setAttribute("aria-expanded", areOpen());
    fold.textContent = areOpen() ? "Fold all" : "Unfold all";
  }));
  fold.addEventListener("click", () => unfold(!areOpen()));

  // A link to a file gives the copy that the page holds: it works where the page came alone.
  addEventListener("click", async (event) => {
    const path = event.target.closest("a[download]")?.getAttribute("href");
    if (!files.has(path)) return;
    event.preventDefault();
    const url = URL.createObjectURL(new Blob([await text(path)]));
    Object.assign(document.createElement("a"), { href: url, download: path.split("/").pop() }).click();
    setTimeout(() => URL.revokeObjectURL(url), 10_000);
  });

  function setLook(look) {
    root.dataset.look = look;
    byId("look-of-page").textContent = look === "dark" ? "Light" : "Dark";
    images.filter((image) => image.drawn).forEach(show);
  }
  const night = matchMedia("(prefers-color-scheme: dark)"), follow = () => setLook(night.matches ? "dark" : "light");
  night.addEventListener("change", follow);
  byId("look-of-page").addEventListener("click", () => setLook(root.dataset.look === "dark" ? "light" : "dark"));

  // On paper all is unfolded, drawn and light. Drawing takes a while, for which a browser's own menu does not wait.
  function showAll() {
    unfold(true);
    return Promise.all(images.map(show));
  }
  async function print() {
    const { look } = root.dataset;
    setLook("light");
    await showAll();
    window.print();
    setLook(look);
  }
  byId("print").addEventListener("click", print);
  addEventListener("beforeprint", showAll);
  addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.key !== "p") return;
    event.preventDefault();
    print();
  });

  addEventListener("submit", (event) => event.preventDefault());
  follow();
  const seen = document.querySelectorAll("img[data-file], [data-live], p, figcaption, th, .checks li, #facts + dl dd");
  seen.forEach((one) => eye.observe(one));
  return { byId, live, ink, text, showAll };
})();

// Steps of 1, 2 or 5 times a power of ten, about `count` of them.
function ticks(low, high, count) {
  const rough = (high - low || 1) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough);
  const first = Math.ceil(low / step - 1e-9), steps = Math.floor(high / step + 1e-9) - first + 1;
  return Array.from({ length: Math.max(steps, 0) }, (_, k) => +((first + k) * step).toFixed(6));
}

const written = (value) => `${+value.toPrecision(4)}`.replace("-", "−");

// The place of the value nearest to one.
function nearest(values, wanted) {
  const apart = values.map((value) => Math.abs(value - wanted));
  return apart.indexOf(Math.min(...apart));
}

// A form's choices, by number, and a slider over so many places with its words beside it.
const options = (select, names) => select.replaceChildren(...names.map((name, k) => new Option(name, k)));
function slider(input, { length }, value) {
  Object.assign(input, { min: 0, max: length - 1, disabled: length === 1, value });
}
function tell(input, words) {
  input.setAttribute("aria-valuetext", words);
  input.nextElementSibling.value = words;
}

// An element of HTML or SVG with these attributes within another.
function add(parent, name, attributes = {}, text = "") {
  const made = document.createElementNS(name === "svg" ? "http://www.w3.org/2000/svg" : parent.namespaceURI, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  parent.append(made);
  return made;
}

// Draw axes within a box of an SVG element. Gives the places of values, the SVG element `inside` the axes, whose
// coordinates are values (upwards with a minus), and the frame around it, which feels the pointer.
function drawAxes(svg, [left, top, width, height], [first, last], [low, high], labels) {
  const x = (value) => left + (width * (value - first)) / (last - first);
  const y = (value) => top + (height * (high - value)) / (high - low);
  const label = (x, y, anchor, text, rest) => add(svg, "text", { x, y, "text-anchor": anchor, ...rest }, text);
  for (const tick of ticks(first, last, Math.max(width / 80, 5))) {
    add(svg, "path", { d: `M${x(tick)} ${top}v${height}`, class: "grid" });
    label(x(tick), top + height + 17, "middle", written(tick));
  }
  for (const tick of ticks(low, high, Math.max(height / 60, 5))) {
    add(svg, "path", { d: `M${left} ${y(tick)}h${width}`, class: "grid" });
    label(left - 6, y(tick) + 4, "end", written(tick));
  }
  const middle = top + height / 2, box = { x: left, y: top, width, height };
  label(left + width / 2, top + height + 37, "middle", labels[0]);
  label(left - 44, middle, "middle", labels[1], { transform: `rotate(-90 ${left - 44} ${middle})` });
  const viewBox = [first, -high, last - first, high - low].join(" ");
  const inside = add(svg, "svg", { ...box, viewBox, preserveAspectRatio: "none" });
  return { x, y, inside, frame: add(svg, "rect", { ...box, class: "frame" }) };
}

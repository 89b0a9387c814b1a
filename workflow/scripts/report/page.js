// What the whole page does: unpack its files, draw figures when they are seen, fold, explain words, turn dark.
const page = (() => {
  const byId = (name) => document.getElementById(name);
  // One content may have several paths.
  const files = new Map([...document.querySelectorAll("script[data-file]")].flatMap((one) =>
    one.dataset.file.split(" ").map((path) => [path, one])));
  const root = document.documentElement, live = {};

  // Base 85 as Python writes it: five letters are four bytes.
  const LETTERS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;<=>?@^_`{|}~";
  const values = new Uint8Array(128);
  [...LETTERS].forEach((letter, value) => (values[letter.charCodeAt(0)] = value));
  function decoded(letters) {
    const bytes = new DataView(new ArrayBuffer(4 * Math.ceil(letters.length / 5))), full = letters.padEnd(letters.length + 4, "~");
    for (let from = 0; from < letters.length; from += 5) {
      let number = 0;
      for (let k = from; k < from + 5; k++) number = 85 * number + values[full.charCodeAt(k)];
      bytes.setUint32((4 * from) / 5, number);
    }
    return bytes.buffer.slice(0, Math.floor((4 * letters.length) / 5));
  }
  async function unpacked(path) {
    const stream = new Blob([decoded(files.get(path).textContent)]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).text();
  }

  // The content of a file that the page holds: tables are put together from columns, figures with the letters that all share.
  let glyphs = null;
  async function text(path) {
    const held = await unpacked(path);
    if (path.endsWith(".svg")) {
      glyphs ||= unpacked("glyphs.json").then(JSON.parse);
      const drawn = await glyphs;
      return held.replace(/<path id="([^"]*)"\/>/g, (_, id) => drawn[id]);
    }
    if (!held.includes("\x1e")) return held;
    const [first, ...others] = held.split("\x1e").map((column) => column.split("\n"));
    return `${first.map((field, row) => [field, ...others.map((column) => column[row])].join(",")).join("\n")}\n`;
  }

  // Ink, paper, grid and the darkest colours of curves, light and dark.
  const TURNED = {
    "#000000": "#d5dbe3", "#222222": "#f0f3f6", "#ffffff": "#14181f", "#d9d9d9": "#39414d", "#767676": "#9aa4b1",
    "#a6193c": "#e0567a", "#5b4bb5": "#9d8ff0", "#0072b2": "#4a9fd8", "#00707a": "#2aa5b0", "#7a6a00": "#b5a12a",
    "#3a93c9": "#a5d8f3",
  };
  const isDark = () => root.dataset.look === "dark";
  const ink = (color) => (isDark() ? TURNED[color.toLowerCase()] || color : color);
  function turned(svg) {
    if (!isDark()) return svg;
    // Text has no colour of its own: it takes the root's.
    return svg.replace("<svg ", `<svg fill="${TURNED["#000000"]}" `).replace(/#[0-9a-f]{6}(?=[;"])/gi, ink);
  }

  const drawing = new Map();
  function show(image) {
    if (image.dataset.look !== root.dataset.look) {
      image.dataset.look = root.dataset.look;
      drawing.set(image, draw(image));
    }
    return drawing.get(image);
  }
  async function draw(image) {
    const url = URL.createObjectURL(new Blob([turned(await text(image.dataset.file))], { type: "image/svg+xml" }));
    const old = image.src;
    image.src = url;
    await image.decode().catch(() => {});
    if (old.startsWith("blob:")) URL.revokeObjectURL(old);
  }

  const images = [...document.querySelectorAll("img[data-file]")];
  const showAll = () => Promise.all(images.map(show));
  const eye = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      if (!isIntersecting) continue;
      if (target.dataset.file) show(target);
      else if (live[target.dataset.live]) start(target);
    }
  }, { rootMargin: "500px" });

  // A live part of the page: `begin(data)` draws it and gives what draws it anew, or nothing.
  const drawn = new Map();
  async function start(section) {
    const name = section.dataset.live;
    if (drawn.has(name)) return;
    drawn.set(name, () => {});
    section.querySelector(".unscripted")?.remove();
    drawn.set(name, (await live[name](JSON.parse(await text(`${name}.json`)))) || (() => {}));
    section.dataset.ready = "yes";
  }
  const redraw = () => drawn.forEach((again) => again());

  // Kept for the next time, where the browser lets a file keep anything.
  const LOOK = "isarflow-look";
  function kept(...look) {
    try {
      return look.length ? localStorage.setItem(LOOK, ...look) : localStorage.getItem(LOOK);
    } catch {
      return null;
    }
  }
  function setLook(look) {
    root.dataset.look = look;
    byId("look-of-page").textContent = look === "dark" ? "Light" : "Dark";
    for (const image of images) if (image.src.startsWith("blob:") || image.getBoundingClientRect().top < innerHeight) show(image);
    redraw();
  }

  // Words of the glossary: the first time that each stands in a block, what one points at says what it means.
  const terms = new Map([...document.querySelectorAll(".glossary dt")].map((one) => [one.textContent, one.nextElementSibling.textContent]));
  const escaped = [...terms.keys()].sort((a, b) => b.length - a.length).map((term) => term.replace(/[.*+?^${}()|[\]\\]/g, "\\$&"));
  const any = new RegExp(`(?<![\\w-])(?:${escaped.join("|")})(?![\\w-])`, "g");
  function explain(block) {
    if (block.dataset.explained) return;
    block.dataset.explained = "yes";
    const said = new Set(), walker = document.createTreeWalker(block, NodeFilter.SHOW_TEXT), nodes = [];
    while (walker.nextNode()) if (!walker.currentNode.parentElement.closest("a, button, output, .term")) nodes.push(walker.currentNode);
    for (const node of nodes) {
      const parts = [];
      let from = 0;
      for (const { 0: term, index } of node.data.matchAll(any)) {
        if (said.has(term)) continue;
        said.add(term);
        // No button: a line may break before the comma behind one.
        const word = Object.assign(document.createElement("span"), { className: "term", textContent: term, tabIndex: 0, role: "button" });
        word.setAttribute("aria-describedby", "meaning");
        parts.push(node.data.slice(from, index), word);
        from = index + term.length;
      }
      if (parts.length) node.replaceWith(...parts, node.data.slice(from));
    }
  }
  function mean(term) {
    const box = byId("meaning");
    box.hidden = !term;
    if (!term) return;
    box.textContent = terms.get(term.textContent);
    const at = term.getBoundingClientRect(), width = Math.min(340, innerWidth - 24);
    Object.assign(box.style, { width: `${width}px`, left: `${Math.min(Math.max(at.left, 12), innerWidth - width - 12)}px` });
    const below = at.bottom + 8 + box.offsetHeight < innerHeight;
    box.style.top = `${below ? at.bottom + 8 : at.top - 8 - box.offsetHeight}px`;
  }
  for (const type of ["pointerover", "focusin", "click"]) {
    addEventListener(type, (event) => mean(event.target.closest?.(".term") || (type === "focusin" ? null : document.activeElement?.closest(".term"))));
  }
  addEventListener("keydown", (event) => event.key === "Escape" && mean(null));
  addEventListener("scroll", () => mean(null), { passive: true });

  // What is seen is explained, so that a page of many words opens at once.
  const reader = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) if (isIntersecting) explain(target);
  }, { rootMargin: "200px" });

  // Folding. A link into a folded part unfolds what it lies in.
  const parts = [...document.querySelectorAll("details.part, details.sub")];
  function unfold(target) {
    for (let box = target?.closest("details"); box; box = box.parentElement.closest("details")) box.open = true;
  }
  let sought = null;
  const arrive = () => {
    sought = location.hash.length > 1 ? byId(decodeURIComponent(location.hash.slice(1))) : null;
    if (sought) unfold(sought), sought.scrollIntoView();
  };
  // What is drawn on the way there grows, and the page would come to rest short of it.
  addEventListener("scrollend", () => {
    sought?.scrollIntoView({ behavior: "instant" });
    sought = null;
  });
  addEventListener("wheel", () => (sought = null), { passive: true });
  const foldAll = (open) => parts.forEach((part) => (part.open = open));
  const fold = byId("fold");
  fold.addEventListener("click", () => {
    const open = fold.getAttribute("aria-expanded") === "false";
    document.querySelectorAll("details").forEach((box) => (box.open = open));
  });
  const state = () => {
    const open = parts.every((part) => part.open);
    fold.setAttribute("aria-expanded", open);
    fold.textContent = open ? "Fold all" : "Unfold all";
  };
  parts.forEach((part) => part.addEventListener("toggle", state));

  // A link to a file gives the copy that the page holds: it works where the page came alone.
  document.addEventListener("click", async (event) => {
    const link = event.target.closest?.("a[download]"), path = link?.getAttribute("href");
    if (!files.has(path)) {
      const to = event.target.closest?.("a[href^='#']");
      if (to && to.hash === location.hash) arrive();
      return;
    }
    event.preventDefault();
    const type = path.endsWith(".svg") ? "image/svg+xml" : "text/csv";
    const url = URL.createObjectURL(new Blob([await text(path)], { type }));
    Object.assign(document.createElement("a"), { href: url, download: path.split("/").pop() }).click();
    setTimeout(() => URL.revokeObjectURL(url), 10_000);
  });

  // On paper all is unfolded, drawn and light. What is drawn takes a while, for which a browser's own menu does not wait.
  async function print() {
    const look = root.dataset.look;
    setLook("light");
    foldAll(true);
    await showAll();
    window.print();
    setLook(look);
  }
  addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.altKey || event.shiftKey || event.key.toLowerCase() !== "p") return;
    event.preventDefault();
    print();
  });
  addEventListener("beforeprint", () => {
    foldAll(true);
    showAll();
  });
  addEventListener("hashchange", arrive);
  let width = innerWidth;
  addEventListener("resize", () => {
    if (innerWidth !== width) redraw();
    width = innerWidth;
  });

  addEventListener("DOMContentLoaded", () => {
    const dark = matchMedia("(prefers-color-scheme: dark)");
    root.dataset.look = kept() || (dark.matches ? "dark" : "light");
    dark.addEventListener("change", () => setLook(dark.matches ? "dark" : "light"));
    byId("look-of-page").addEventListener("click", () => {
      setLook(isDark() ? "light" : "dark");
      kept(root.dataset.look);
    });
    byId("print").addEventListener("click", print);
    setLook(root.dataset.look);
    // What is hidden in a folded part is not seen until it unfolds.
    images.forEach((image) => eye.observe(image));
    document.querySelectorAll("[data-live]").forEach((section) => eye.observe(section));
    document.querySelectorAll("p, figcaption, th, .checks li, .facts dd").forEach((block) => reader.observe(block));
    arrive();
  });

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

// A form's choices.
const options = (select, names) => select.replaceChildren(...names.map((name, k) => new Option(name, k)));

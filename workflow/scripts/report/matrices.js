// Confusion matrices with a slider over the SNR (see section_confusion.py).
page.live.matrices = ({ entries }) => {
  const { set, entry, snr } = page.byId("matrices-form").elements, sets = [...new Set(entries.map((one) => one.set))];
  let shown = [], wanted = 12;

  function choose() {
    shown = entries.filter((one) => one.set === sets[set.value]);
    options(entry, shown.map((one) => one.words));
    slide();
  }

  function slide() {
    const { snrs } = shown[entry.value];
    slider(snr, snrs, nearest(snrs, wanted));
    draw();
  }

  function cell(line, tag, text, rest = {}) {
    line.append(Object.assign(document.createElement(tag), { textContent: text, ...rest }));
    return line.lastChild;
  }

  function draw() {
    const one = shown[entry.value], at = `${written(one.snrs[snr.value])} dB`, head = document.createElement("tr");
    ["target ↓, taken for →", ...one.classes].forEach((name) => cell(head, "th", name, { scope: "col" }));
    const rows = one.counts[snr.value].map((counts, k) => {
      const line = document.createElement("tr"), sum = counts.reduce((total, count) => total + count, 0) || 1;
      cell(line, "th", one.targets[k], { scope: "row" });
      for (const count of counts) {
        const share = count / sum, made = cell(line, "td", `${(100 * share).toFixed(1)} %`);
        made.classList.toggle("strong", share > 0.5);
        made.style.setProperty("--share", share);
        cell(made, "small", count.toLocaleString("en"));
      }
      return line;
    });
    page.byId("matrices-table").replaceChildren(head, ...rows);
    page.byId("matrices-caption").textContent =
      `${one.words}, ${one.set}, at ${at}: share of each target's test images, and their number.`;
    tell(snr, at);
  }

  options(set, sets);
  set.addEventListener("change", choose);
  entry.addEventListener("change", slide);
  snr.addEventListener("input", () => {
    wanted = shown[entry.value].snrs[snr.value];
    draw();
  });
  choose();
  return draw;
};

// Confusion matrices with a slider over the SNR (see section_confusion.py).
page.live.matrices = ({ entries }) => {
  const form = page.byId("matrices-form"), { set, entry, snr } = form.elements, table = page.byId("matrices-table");
  const sets = [...new Set(entries.map((one) => one.set))];
  let shown = [];

  const cell = (tag, text, rest = {}) => Object.assign(document.createElement(tag), { textContent: text, ...rest });

  function choose() {
    shown = entries.filter((one) => one.set === sets[set.value]);
    options(entry, shown.map((one) => one.words));
    slide();
  }

  function slide() {
    const { snrs } = shown[entry.value], kept = snr.dataset.db ?? 12;
    Object.assign(snr, { min: 0, max: snrs.length - 1, step: 1, disabled: snrs.length === 1 });
    snr.value = snrs.reduce((best, one, k) => (Math.abs(one - kept) < Math.abs(snrs[best] - kept) ? k : best), 0);
    draw();
  }

  function draw() {
    const one = shown[entry.value], counts = one.counts[snr.value], at = written(one.snrs[snr.value]);
    snr.dataset.db = one.snrs[snr.value];
    snr.setAttribute("aria-valuetext", `${at} dB`);
    snr.nextElementSibling.value = `${at} dB`;
    const head = document.createElement("tr");
    head.append(cell("th", "target ↓, taken for →", { scope: "col" }), ...one.classes.map((name) => cell("th", name, { scope: "col" })));
    const rows = counts.map((row, k) => {
      const line = document.createElement("tr"), sum = row.reduce((total, count) => total + count, 0) || 1;
      line.append(cell("th", one.targets[k], { scope: "row" }));
      row.forEach((count) => {
        const share = count / sum, made = cell("td", `${(100 * share).toFixed(1)} %`);
        made.style.setProperty("--share", share);
        made.classList.toggle("strong", share > 0.5);
        made.append(cell("small", `${count.toLocaleString("en")}`));
        line.append(made);
      });
      return line;
    });
    table.replaceChildren(head, ...rows);
    page.byId("matrices-caption").textContent = `${one.words}, ${one.set}, at ${at} dB: share of each target's test images, and their number.`;
  }

  options(set, sets);
  set.addEventListener("change", choose);
  entry.addEventListener("change", slide);
  snr.addEventListener("input", draw);
  form.addEventListener("submit", (event) => event.preventDefault());
  choose();
};

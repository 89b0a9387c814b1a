// Confusion matrices with a slider over the SNR (see section_headline.py).
page.live.matrices = ({ entries }) => {
  const [form, table, caption] = ["form", "table", "caption"].map((name) => page.byId(`matrices-${name}`));
  const { set, entry, snr } = form.elements, sets = [...new Set(entries.map((one) => one.set))];
  let shown = [], wanted = 12;

  function choose({ target } = { target: set }) {
    if (target === snr) wanted = shown[entry.value].snrs[snr.value];
    if (target === set) {
      shown = entries.filter((one) => one.set === sets[set.value]);
      options(entry, shown.map((one) => one.words));
    }
    const { words, snrs, classes, targets, counts } = shown[entry.value];
    slider(snr, snrs, nearest(snrs, wanted));
    tell(snr, `${written(snrs[snr.value])} dB`);
    table.replaceChildren();
    const head = add(table, "tr");
    for (const name of ["target ↓, taken for →", ...classes]) add(head, "th", { scope: "col" }, name);
    counts[snr.value].forEach((row, k) => {
      const line = add(table, "tr"), sum = row.reduce((total, count) => total + count, 0) || 1;
      add(line, "th", { scope: "row" }, targets[k]);
      for (const count of row) {
        const share = count / sum, look = { style: `--share: ${share}`, class: share > 0.5 ? "strong" : "" };
        add(add(line, "td", look, `${(100 * share).toFixed(1)} %`), "small", {}, count.toLocaleString("en"));
      }
    });
    const what = `${words}, ${sets[set.value]}, at ${written(snrs[snr.value])} dB`;
    caption.textContent = `${what}: share of each target's test images, and their number.`;
  }

  options(set, sets);
  form.addEventListener("input", choose);
  choose();
  return () => {}; // of any width
};

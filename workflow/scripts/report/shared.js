// What both live parts of the page use. Each has a form <name>-form, and its data in the page as JSON, <name>-data.
const shared = {
  byId: (name) => document.getElementById(name),

  // The form and data of a part; that it needs JavaScript is no longer said.
  start(name) {
    const form = shared.byId(`${name}-form`);
    form.querySelector(".unscripted").remove();
    return { form, data: JSON.parse(shared.byId(`${name}-data`).textContent) };
  },

  // Steps of 1, 2 or 5 times a power of ten, about `count` of them.
  ticks(low, high, count) {
    const rough = (high - low || 1) / count, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough);
    const first = Math.ceil(low / step - 1e-9), steps = Math.floor(high / step + 1e-9) - first + 1;
    return Array.from({ length: Math.max(steps, 0) }, (_, k) => +((first + k) * step).toFixed(6));
  },

  written: (value) => `${+value.toPrecision(4)}`.replace("-", "−"),
};

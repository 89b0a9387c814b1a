// From a field to images and range profiles, as workflow/scripts/imaging and section_scattering.py do it.
const imaging = (() => {
  const C0 = 299792458;

  const numbers = (Type, packed) => new Type(Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0)).buffer);

  // Complex numbers lie as pairs in one array.
  const zeros = (rows, columns) => new Float64Array(2 * rows * columns);

  // Samples (frequency, aperture) about an azimuth of a field (polarization, frequency, elevation, azimuth), m.
  function aperture(data, field, p, e, centre) {
    const [count, angles, around] = [data.frequency.length, data.angle.length, data.azimuths.length];
    const samples = zeros(count, angles), half = angles >> 1;
    for (let f = 0; f < count; f++) {
      const row = ((p * count + f) * data.elevations.length + e) * around;
      for (let a = 0; a < angles; a++) {
        const from = 2 * (row + ((centre + a - half + around) % around)), to = 2 * (f * angles + a);
        samples[to] = field[from];
        samples[to + 1] = field[from + 1];
      }
    }
    return samples;
  }

  // The power of samples by a definition of SNR (see imaging/noise.py).
  function power(samples, definition) {
    const each = Float64Array.from({ length: samples.length / 2 }, (_, k) => samples[2 * k] ** 2 + samples[2 * k + 1] ** 2);
    const least = definition === "peak_3db" ? 0.5 * each.reduce((most, one) => Math.max(most, one), 0) : 0;
    const strong = each.filter((one) => one >= least);
    return strong.reduce((sum, one) => sum + one, 0) / strong.length;
  }

  // White noise at an SNR in dB, which counts the power of `first`, the same for the same seed: mulberry32, and Box and
  // Muller's pairs.
  function withNoise(samples, snr, definition, seed, first = samples) {
    const spread = Math.sqrt(power(first, definition) / 10 ** (snr / 10) / 2);
    let state = seed >>> 0;
    const random = () => {
      state = (state + 0x6d2b79f5) >>> 0;
      let mixed = Math.imul(state ^ (state >>> 15), state | 1);
      mixed ^= mixed + Math.imul(mixed ^ (mixed >>> 7), mixed | 61);
      return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
    };
    const noisy = samples.slice();
    for (let k = 0; k < noisy.length; k += 2) {
      const length = spread * Math.sqrt(-2 * Math.log(1 - random())), turn = 2 * Math.PI * random();
      noisy[k] += length * Math.cos(turn);
      noisy[k + 1] += length * Math.sin(turn);
    }
    return noisy;
  }

  // Bilinear interpolation from (frequency, angle) onto (kx, ky).
  function onto(data, samples, kx, ky) {
    const { frequency, angle } = data, out = zeros(kx.length, ky.length);
    const cell = (value, axis) => {
      const place = Math.min(Math.max(((value - axis[0]) / (axis.at(-1) - axis[0])) * (axis.length - 1), 0), axis.length - 1);
      const low = Math.min(Math.floor(place), axis.length - 2);
      return [low, place - low];
    };
    kx.forEach((x, i) => ky.forEach((y, j) => {
      const [f, pf] = cell((Math.hypot(x, y) * C0) / (2 * Math.PI), frequency), [a, pa] = cell(Math.atan2(y, x), angle);
      for (const [df, da, weight] of [[0, 0, (1 - pf) * (1 - pa)], [0, 1, (1 - pf) * pa], [1, 0, pf * (1 - pa)], [1, 1, pf * pa]]) {
        const from = 2 * ((f + df) * angle.length + a + da), to = 2 * (i * ky.length + j);
        out[to] += weight * samples[from];
        out[to + 1] += weight * samples[from + 1];
      }
    }));
    return out;
  }

  // An image by one of the ways (see imaging/imagers/fourier.py): its pixels' centres in m, and magnitudes.
  function image(data, samples, way, rows, columns) {
    const [kx, ky] = data.ways[way], [over, across] = data.windows;
    const axis = (count, k) => Array.from({ length: count }, (_, n) => ((n - (count >> 1)) * Math.PI) / (count * (k[1] - k[0])));
    const range = axis(rows, kx), cross = axis(columns, ky), level = new Float64Array(rows * columns);
    if (way === "exact") {
      const k = data.frequency.map((f) => (2 * Math.PI * f) / C0), angles = data.angle.length, weights = [];
      let sum = 0;
      k.forEach((one, f) => across.forEach((wide) => weights.push(over[f] * one * wide)));
      for (const weight of weights) sum += weight;
      for (let i = 0; i < rows; i++) for (let j = 0; j < columns; j++) {
        let [re, im] = [0, 0];
        for (let f = 0, s = 0; f < k.length; f++) for (let a = 0; a < angles; a++, s++) {
          const phase = 2 * k[f] * (range[i] * Math.cos(data.angle[a]) - cross[j] * Math.sin(data.angle[a]));
          const [c, d] = [weights[s] * Math.cos(phase), weights[s] * Math.sin(phase)];
          re += c * samples[2 * s] - d * samples[2 * s + 1];
          im += c * samples[2 * s + 1] + d * samples[2 * s];
        }
        level[i * columns + j] = Math.hypot(re, im) / sum;
      }
      return { range, cross, level };
    }
    const grid = way === "polar" ? onto(data, samples, kx, ky) : samples, n = ky.length, half = zeros(kx.length, columns);
    for (let j = 0; j < columns; j++) for (let a = 0; a < n; a++) {
      const phase = -2 * cross[j] * ky[a], [c, d] = [across[a] * Math.cos(phase), across[a] * Math.sin(phase)];
      for (let f = 0; f < kx.length; f++) {
        const from = 2 * (f * n + a), to = 2 * (f * columns + j);
        half[to] += c * grid[from] - d * grid[from + 1];
        half[to + 1] += c * grid[from + 1] + d * grid[from];
      }
    }
    const sums = zeros(rows, columns);
    for (let i = 0; i < rows; i++) for (let f = 0; f < kx.length; f++) {
      const phase = 2 * range[i] * kx[f], [c, d] = [over[f] * Math.cos(phase), over[f] * Math.sin(phase)];
      for (let j = 0; j < columns; j++) {
        const from = 2 * (f * columns + j), to = 2 * (i * columns + j);
        sums[to] += c * half[from] - d * half[from + 1];
        sums[to + 1] += c * half[from + 1] + d * half[from];
      }
    }
    for (let k = 0; k < level.length; k++) level[k] = Math.hypot(sums[2 * k], sums[2 * k + 1]);
    return { range, cross, level };
  }

  // Range profiles at every azimuth of an elevation: ranges in m, and magnitudes (range, azimuth).
  function profiles(data, field, p, e, finer) {
    const { frequency } = data, around = data.azimuths.length, count = finer * frequency.length;
    const span = C0 / (2 * (frequency[1] - frequency[0])), middle = frequency.reduce((sum, f) => sum + f, 0) / frequency.length;
    const range = Array.from({ length: count }, (_, n) => ((n - (count >> 1)) * span) / count), level = new Float64Array(count * around);
    const re = new Float64Array(around), im = new Float64Array(around);
    range.forEach((distance, n) => {
      re.fill(0);
      im.fill(0);
      frequency.forEach((f, k) => {
        const phase = ((4 * Math.PI) / C0) * distance * (f - middle), weight = data.windows[0][k];
        const [c, d] = [weight * Math.cos(phase), weight * Math.sin(phase)], row = ((p * frequency.length + k) * data.elevations.length + e) * around;
        for (let a = 0; a < around; a++) {
          const [x, y] = [field[2 * (row + a)], field[2 * (row + a) + 1]];
          re[a] += c * x - d * y;
          im[a] += c * y + d * x;
        }
      });
      for (let a = 0; a < around; a++) level[n * around + a] = Math.hypot(re[a], im[a]);
    });
    return { range, level };
  }

  // Levels in dB of the strongest.
  function decibels(level) {
    const most = level.reduce((top, one) => Math.max(top, one), 0) || 1;
    return level.map((one) => 20 * Math.log10(Math.max(one / most, 1e-5)));
  }

  return { aperture, decibels, image, numbers, profiles, withNoise };
})();

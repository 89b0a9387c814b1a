// From a field to images and range profiles, as workflow/scripts/imaging and section_scattering.py do it. Matrices of
// complex numbers are arrays of pairs, row by row.
const imaging = (() => {
  const C0 = 299792458;
  const zeros = (rows, columns) => new Float64Array(2 * rows * columns);

  // Samples (frequency, azimuth) of a field (polarization, frequency, elevation, azimuth), m, at places of azimuths.
  function samplesOf({ frequency, elevations, azimuths }, field, p, e, places) {
    return Float64Array.from(frequency.flatMap((_, f) => places.flatMap((place) => {
      const from = 2 * (((p * frequency.length + f) * elevations.length + e) * azimuths.length + place);
      return [field[from], field[from + 1]];
    })));
  }

  // Samples of the aperture about an azimuth by its place.
  function aperture(data, field, p, e, centre) {
    const around = data.azimuths.length, half = data.angle.length >> 1;
    return samplesOf(data, field, p, e, data.angle.map((_, a) => (centre + a - half + around) % around));
  }

  // The power of samples by a definition of SNR (see imaging/noise.py).
  function power(samples, definition) {
    const each = magnitudes(samples).map((one) => one ** 2), most = each.reduce((top, one) => Math.max(top, one), 0);
    const strong = definition === "peak_3db" ? each.filter((one) => one >= most / 2) : each;
    return strong.reduce((sum, one) => sum + one, 0) / strong.length;
  }

  // White noise at an SNR in dB, which counts the power of `first`: Box and Muller's pairs.
  function withNoise(samples, snr, definition, first = samples) {
    const spread = Math.sqrt(power(first, definition) / 10 ** (snr / 10) / 2);
    const pair = () => {
      const length = spread * Math.sqrt(-2 * Math.log(1 - Math.random())), turn = 2 * Math.PI * Math.random();
      return [length * Math.cos(turn), length * Math.sin(turn)];
    };
    const noise = Array.from({ length: samples.length / 2 }, pair).flat();
    return samples.map((one, k) => one + noise[k]);
  }

  // The matrix of waves: weight * exp(1j * phase), both functions of row and column.
  function waves(rows, columns, weight, phase) {
    const out = zeros(rows, columns);
    for (let row = 0, to = 0; row < rows; row++) for (let column = 0; column < columns; column++, to += 2) {
      out[to] = weight(row, column) * Math.cos(phase(row, column));
      out[to + 1] = weight(row, column) * Math.sin(phase(row, column));
    }
    return out;
  }

  // So many places about 0 that span so much.
  function centred(count, span) {
    return Array.from({ length: count }, (_, n) => ((n - (count >> 1)) * span) / count);
  }

  // The product of matrices (rows, inner) and (inner, columns).
  function times(left, right, inner) {
    const rows = left.length / (2 * inner), columns = right.length / (2 * inner), out = zeros(rows, columns);
    for (let row = 0; row < rows; row++) for (let k = 0; k < inner; k++) {
      const at = 2 * (row * inner + k), re = left[at], im = left[at + 1];
      for (let from = 2 * k * columns, to = 2 * row * columns; to < 2 * (row + 1) * columns; from += 2, to += 2) {
        out[to] += re * right[from] - im * right[from + 1];
        out[to + 1] += re * right[from + 1] + im * right[from];
      }
    }
    return out;
  }

  function magnitudes(pairs) {
    return Float64Array.from({ length: pairs.length / 2 }, (_, k) => Math.hypot(pairs[2 * k], pairs[2 * k + 1]));
  }

  // Bilinear interpolation from (frequency, angle) onto (kx, ky).
  function reformatted({ frequency, angle }, samples, kx, ky) {
    const out = zeros(kx.length, ky.length);
    const cell = (value, axis) => {
      const last = axis.length - 1, place = ((value - axis[0]) / (axis[last] - axis[0])) * last;
      const low = Math.min(Math.max(Math.floor(place), 0), last - 1);
      return [low, Math.min(Math.max(place - low, 0), 1)];
    };
    kx.forEach((x, i) => ky.forEach((y, j) => {
      const [f, pf] = cell((Math.hypot(x, y) * C0) / (2 * Math.PI), frequency), [a, pa] = cell(Math.atan2(y, x), angle);
      for (const [df, da] of [[0, 0], [0, 1], [1, 0], [1, 1]]) {
        const weight = (df ? pf : 1 - pf) * (da ? pa : 1 - pa);
        const from = 2 * ((f + df) * angle.length + a + da), to = 2 * (i * ky.length + j);
        out[to] += weight * samples[from];
        out[to + 1] += weight * samples[from + 1];
      }
    }));
    return out;
  }

  // Samples summed over frequency for each range: (range, angle).
  function compressed({ windows: [over] }, samples, range, kx) {
    return times(waves(range.length, kx.length, (_, f) => over[f], (n, f) => 2 * range[n] * kx[f]), samples, kx.length);
  }

  // Levels in dB of the strongest.
  function decibels(level) {
    const most = level.reduce((top, one) => Math.max(top, one), 0) || 1;
    return level.map((one) => 20 * Math.log10(Math.max(one / most, 1e-5)));
  }

  // An image by one of the ways (see imaging/imagers/fourier.py): its pixels' centres in m, and levels in dB.
  function image(data, samples, way, rows, columns) {
    const [kx, ky] = data.ways[way], across = data.windows[1];
    const range = centred(rows, Math.PI / (kx[1] - kx[0])), cross = centred(columns, Math.PI / (ky[1] - ky[0]));
    const grid = way === "polar" ? reformatted(data, samples, kx, ky) : samples;
    const aside = waves(ky.length, columns, (a) => across[a], (a, j) => -2 * ky[a] * cross[j]);
    return { range, cross, decibels: decibels(magnitudes(times(compressed(data, grid, range, kx), aside, ky.length))) };
  }

  // Range profiles at every azimuth of an elevation: ranges in m, and levels in dB (range, azimuth).
  function profiles(data, field, p, e, finer) {
    const kx = data.frequency.map((f) => (2 * Math.PI * f) / C0);
    const range = centred(finer * kx.length, Math.PI / (kx[1] - kx[0]));
    const samples = samplesOf(data, field, p, e, [...data.azimuths.keys()]);
    return { range, decibels: decibels(magnitudes(compressed(data, samples, range, kx))) };
  }

  return { aperture, image, profiles, withNoise };
})();

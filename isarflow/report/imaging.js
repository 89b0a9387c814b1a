// From a field to images and range profiles, as isarflow/imaging does it. Matrices of
// complex numbers are arrays of pairs, row by row.
const imaging = (() => {
  // Samples (frequency, azimuth) of a field (polarization, frequency, elevation, azimuth) at places of azimuths.
  function samples({ frequency, elevations, azimuths }, field, p, e, places) {
    return Float64Array.from(frequency.flatMap((_, f) => places.flatMap((place) => {
      const from = 2 * (((p * frequency.length + f) * elevations.length + e) * azimuths.length + place);
      return [field[from], field[from + 1]];
    })));
  }

  function magnitudes(pairs) {
    return Float64Array.from({ length: pairs.length / 2 }, (_, k) => Math.hypot(pairs[2 * k], pairs[2 * k + 1]));
  }

  // White noise at an SNR in dB, which counts the power of `first` (see imaging/noise.py): Box and Muller's pairs.
  function withNoise(samples, snr, definition, first = samples) {
    const powers = magnitudes(first).map((one) => one ** 2), most = Math.max(...powers);
    const strong = definition === "peak_3db" ? powers.filter((one) => one >= most / 2) : powers;
    const signal = strong.reduce((sum, one) => sum + one, 0) / strong.length;
    const spread = Math.sqrt(signal / 10 ** (snr / 10) / 2);
    const noise = Array.from({ length: samples.length / 2 }, () => {
      const length = spread * Math.sqrt(-2 * Math.log(1 - Math.random())), turn = 2 * Math.PI * Math.random();
      return [length * Math.cos(turn), length * Math.sin(turn)];
    }).flat();
    return samples.map((one, k) => one + noise[k]);
  }

  // The sum over the rows of (rows, columns), each times weights[row] * exp(2j * waves[row] * place): (columns, places).
  function summed(pairs, weights, waves, places) {
    const columns = pairs.length / (2 * waves.length), out = new Float64Array(2 * columns * places.length);
    places.forEach((place, n) => waves.forEach((wave, row) => {
      const re = weights[row] * Math.cos(2 * wave * place), im = weights[row] * Math.sin(2 * wave * place);
      for (let column = 0; column < columns; column++) {
        const from = 2 * (row * columns + column), to = 2 * (column * places.length + n);
        out[to] += re * pairs[from] - im * pairs[from + 1];
        out[to + 1] += re * pairs[from + 1] + im * pairs[from];
      }
    }));
    return out;
  }

  // So many pixels' centres about 0 m that span what steps between these waves leave unambiguous.
  function centred(count, waves) {
    return Array.from({ length: count }, (_, n) => ((n - (count >> 1)) * Math.PI) / (waves[1] - waves[0]) / count);
  }

  // Levels in dB of the strongest.
  function decibels(pairs) {
    const levels = magnitudes(pairs), most = levels.reduce((top, one) => Math.max(top, one), 0) || 1;
    return levels.map((one) => 20 * Math.log10(Math.max(one / most, 1e-5)));
  }

  // An image by one of the ways (see imaging/imagers/fourier.py): its pixels' centres in m, and levels in dB.
  function image({ ways, windows: [over, across] }, seen, way, rows, columns) {
    const { kx, ky, weights } = ways[way], range = centred(rows, kx), cross = centred(columns, ky);
    const weighted = (row, part) => row.reduce((sum, [place, weight]) => sum + weight * seen[2 * place + part], 0);
    const grid = weights.flatMap((row) => [weighted(row, 0), weighted(row, 1)]);
    const ranges = summed(grid, over, kx, range);
    return { range, cross, decibels: decibels(summed(ranges, across, ky.map((k) => -k), cross)) };
  }

  // Range profiles at every azimuth of an elevation: ranges in m, and levels in dB (azimuth, range).
  function profiles(data, field, p, e, finer) {
    const { k, azimuths, windows } = data, range = centred(finer * k.length, k);
    const seen = samples(data, field, p, e, [...azimuths.keys()]);
    return { range, decibels: decibels(summed(seen, windows[0], k, range)) };
  }

  return { samples, image, profiles, withNoise };
})();

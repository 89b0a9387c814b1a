// The viewer of meshes, images and range profiles. Its data are the run's fields (see section_explore.py).
page.live.explore = (data) => {
  const form = page.byId("explore-form"), { target, polarization, snr, way, pad, azimuth, elevation, floor, play, back } = form.elements;
  const [meshCanvas, ...boxes] = ["mesh", "image", "sinogram", "profile"].map((name) => page.byId(`explore-${name}`));
  const [imageBox, sinogramBox, profileBox] = boxes;
  const RATIO = 0.8, MARGIN = { left: 62, right: 70, top: 20, bottom: 46 }, SURFACE = [158, 189, 219], FINER = 4, LEVELS = 64;
  const { azimuths, elevations, own } = data, half = data.angle.length >> 1;
  // The places of azimuths about which there is a whole aperture.
  const centres = azimuths.map((_, k) => k).slice(...(data.closed ? [0] : [half, -half]));
  const turn = { across: 0, up: 0 };
  let view = null, plots = null;

  const radians = (degrees) => (degrees * Math.PI) / 180;
  const color = (level) => data.colors[Math.round(Math.min(Math.max(level, 0), 1) * (data.colors.length - 1))];
  const edges = (axis) => [axis[0] - (axis[1] - axis[0]) / 2, axis.at(-1) + (axis[1] - axis[0]) / 2];
  const cell = (axis, value) => Math.round((value - axis[0]) / (axis[1] - axis[0]));

  const bytes = (packed) => Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
  const scaled = (packed, scale) => Float32Array.from(new Int16Array(bytes(packed).buffer), (number) => number * scale);
  const inThrees = (numbers) => Array.from({ length: numbers.length / 3 }, (_, k) => [...numbers.subarray(3 * k, 3 * k + 3)]);
  function unpacked({ name, field, mesh }) {
    const shown = { name, samples: scaled(field.samples, field.scale) };
    if (!mesh) return shown;
    const steps = bytes(mesh.triangles).buffer;
    let corner = 0;
    const corners = Uint32Array.from(mesh.wide ? new Int32Array(steps) : new Int16Array(steps), (step) => (corner += step));
    return { ...shown, points: inThrees(scaled(mesh.vertices, mesh.scale)), triangles: inThrees(corners) };
  }
  const targets = data.targets.map(unpacked);

  // The triangles' corners to the right, up and towards the radar (see draw_mesh.project).
  function seen({ points, triangles }, az, el) {
    const [ca, sa, ce, se] = [Math.cos(az), Math.sin(az), Math.cos(el), Math.sin(el)];
    const turned = points.map(([x, y, z]) => [ca * y - sa * x, ce * z - se * (ca * x + sa * y), ce * (ca * x + sa * y) + se * z]);
    return triangles.map((corners) => corners.map((corner) => turned[corner]));
  }

  function drawMesh() {
    const width = meshCanvas.clientWidth, height = RATIO * width, context = meshCanvas.getContext("2d"), { shown } = view;
    Object.assign(meshCanvas, { width: width * devicePixelRatio, height: height * devicePixelRatio });
    context.scale(devicePixelRatio, devicePixelRatio);
    page.byId("explore-meshless").hidden = shown.points;
    if (!shown.points) return;
    // The scale does not depend on the view, so that the target turns and does not breathe.
    const scale = (0.47 * height) / Math.max(...shown.points.map((point) => Math.hypot(...point)));
    const depth = ([a, b, c]) => a[2] + b[2] + c[2];
    const triangles = seen(shown, radians(view.az + turn.across), radians(view.el + turn.up)).sort((one, other) => depth(one) - depth(other));
    Object.assign(context, { lineWidth: 0.4, strokeStyle: "rgba(29, 52, 70, 0.55)" });
    for (const [a, b, c] of triangles) {
      const [ux, uy, uz] = b.map((one, k) => one - a[k]), [vx, vy, vz] = c.map((one, k) => one - a[k]);
      const [nx, ny, nz] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
      const lit = (Math.sign(nz) * (-0.35 * nx + 0.6 * ny + 0.72 * nz)) / (Math.hypot(nx, ny, nz) || 1);
      const shade = 0.45 + 0.65 * Math.min(Math.max(lit, 0), 1);
      context.fillStyle = `rgb(${SURFACE.map((value) => value * shade).join()})`;
      context.beginPath();
      for (const [right, up] of [a, b, c]) context.lineTo(width / 2 + scale * right, height / 2 - scale * up);
      context.closePath();
      context.fill();
      context.stroke();
    }
  }

  // Axes in one of the boxes: its SVG element, where it lies, and what maps values to places. even: one scale for both.
  function plot(box, across, up, labels, even) {
    const width = Math.max(box.clientWidth, 200), height = RATIO * width, svg = box.querySelector("svg");
    const spans = [across[1] - across[0], up[1] - up[0]], room = [width - MARGIN.left - MARGIN.right, height - MARGIN.top - MARGIN.bottom];
    const scale = Math.min(room[0] / spans[0], room[1] / spans[1]), [w, h] = even ? spans.map((span) => scale * span) : room;
    const [left, top] = [MARGIN.left + (room[0] - w) / 2, MARGIN.top + (room[1] - h) / 2];
    svg.replaceChildren();
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const { x, y } = drawAxes(svg, [left, top, w, h], across, up, labels);
    add(svg, "rect", { x: left, y: top, width: w, height: h, class: "frame" });
    const within = (value, [low, high], d) => (value >= low && value <= high ? d : "");
    return {
      svg, left, top, w, h, x, y,
      upright: (value) => within(value, across, `M${x(value)} ${top}v${h}`),
      level: (value) => within(value, up, `M${left} ${y(value)}h${w}`),
      // What lies under the pointer.
      at: ({ clientX, clientY }) => {
        const { x, y } = box.getBoundingClientRect(), part = [(clientX - x - left) / w, (clientY - y - top) / h];
        return part.every((one) => one >= 0 && one <= 1) ? [across[0] + part[0] * spans[0], up[1] - part[1] * spans[1]] : null;
      },
      mark: add(svg, "path", { class: "cursor" }),
    };
  }

  // Levels in dB (rows upwards, columns) as coloured pixels below the axes, and the bar of colours.
  function paint(box, { svg, left, top, w, h }, levels, rows, columns) {
    const canvas = box.querySelector("canvas"), pixels = new ImageData(columns, rows);
    Object.assign(canvas, { width: columns, height: rows });
    Object.assign(canvas.style, { left: `${left}px`, top: `${top}px`, width: `${w}px`, height: `${h}px` });
    levels.forEach((level, k) => {
      const row = rows - 1 - Math.floor(k / columns);
      pixels.data.set([...color(1 + level / floor.value), 255], 4 * (row * columns + (k % columns)));
    });
    canvas.getContext("2d").putImageData(pixels, 0, 0);
    const bar = left + w + 12, step = h / LEVELS;
    for (let k = 0; k < LEVELS; k++) {
      add(svg, "rect", { x: bar, y: top + k * step, width: 12, height: step + 0.5, fill: `rgb(${color(1 - k / LEVELS)})` });
    }
    for (let k = 0; k <= 4; k++) add(svg, "text", { x: bar + 15, y: top + (k * h) / 4 + 4 }, written((-k * floor.value) / 4));
    add(svg, "text", { x: bar, y: top - 7 }, "dB");
  }

  function drawImage({ shown, formed, el }) {
    const axes = plot(imageBox, edges(formed.cross), edges(formed.range), ["cross-range [m]", "range [m]"], true);
    paint(imageBox, axes, formed.decibels, formed.range.length, formed.cross.length);
    if (shown.points) outline(axes, seen(shown, radians(formed.azimuth), radians(el)), Math.cos(radians(el)));
    return axes;
  }

  // The rim of the target's shadow in the image plane: drawn thick, its inside left out. shortening: of cross-range by the
  // elevation (see imaging/geometry.py).
  function outline({ svg, left, top, w, h, x, y }, triangles, shortening) {
    const d = triangles.map((corners) => {
      const [a, b, c] = corners.map(([right, , ahead]) => [x(shortening * right), y(-ahead)]);
      // All the same way round: near and far sides would cancel.
      const back = (b[0] - a[0]) * (c[1] - a[1]) < (b[1] - a[1]) * (c[0] - a[0]);
      return `M${a}L${back ? c : b}L${back ? b : c}Z`;
    }).join("");
    const box = { x: left, y: top, width: w, height: h }, mask = add(svg, "mask", { id: "outside", maskUnits: "userSpaceOnUse", ...box });
    add(mask, "rect", { ...box, fill: "white" });
    add(mask, "path", { d, fill: "black", stroke: "black", "stroke-width": 0.6 });
    add(svg, "path", { d, class: "outline", mask: "url(#outside)" });
  }

  function drawProfiles({ profiles: { range, level }, centre }) {
    const sinogram = plot(sinogramBox, edges(azimuths), edges(range), ["azimuth [°]", "range [m]"]);
    paint(sinogramBox, sinogram, level, range.length, azimuths.length);
    add(sinogram.svg, "path", { d: sinogram.upright(azimuths[centre]), class: "azimuth" });
    const profile = plot(profileBox, edges(range), [-floor.value, 2], ["range [m]", "level [dB]"]);
    const levels = range.map((_, n) => Math.max(level[n * azimuths.length + centre], -floor.value));
    add(profile.svg, "polyline", { points: range.map((far, n) => `${profile.x(far)},${profile.y(levels[n])}`).join(" ") });
    return [sinogram, profile];
  }

  // The image of a view by the chosen imager: pixels' centres, levels in dB, and the azimuth that it is of.
  function formed({ p, e, az, centre, shown }) {
    if (way.value === "own") {
      const a = nearest(own.azimuths.map((one) => Math.abs(((one - az + 540) % 360) - 180)), 0);
      const count = own.range.length * own.crossrange.length, start = (e * own.azimuths.length + a) * count;
      const levels = [...bytes(own.levels[target.value]).subarray(start, start + count)];
      const decibels = levels.map((level) => (1 - level / 255) * data.floor);
      return { range: own.range, cross: own.crossrange, decibels, azimuth: own.azimuths[a] };
    }
    let samples = imaging.aperture(data, shown.samples, p, e, centre);
    if (+snr.value) {
      const first = imaging.aperture(data, shown.samples, 0, e, centre); // a receiver's noise is the same in all
      samples = imaging.withNoise(samples, data.snrs[snr.value - 1], data.definition, 7919 * centre + 31 * e + +target.value, first);
    }
    const { range, cross, level } = imaging.image(data, samples, way.value, ...data.pixels.map((count) => count * 2 ** pad.value));
    return { range, cross, decibels: imaging.decibels(level), azimuth: az };
  }

  function say() {
    const { az, el, shown } = view, at = `azimuth ${written(az)}°, elevation ${written(el)}°`;
    const noise = +snr.value && way.value !== "own" ? `at an SNR of ${written(data.snrs[snr.value - 1])} dB (${data.definition})` : "without noise";
    const imaged = view.formed.azimuth === az ? "" : ` (of azimuth ${written(view.formed.azimuth)}°)`;
    const turned = turn.across || turn.up ? "turned by hand" : "as the radar sees it";
    page.byId("explore-caption").textContent = `${shown.name} at ${at}: ${turned}, its image ${noise}${imaged}, its range profiles at that elevation over azimuth, and the one at that azimuth.`;
    tell(azimuth, `${written(az)}°`);
    tell(elevation, `${written(el)}°`);
    tell(floor, `${floor.value} dB`);
  }

  function draw() {
    const centre = centres[azimuth.value], e = +elevation.value, p = +polarization.value, shown = targets[target.value];
    view = { shown, p, e, centre, az: azimuths[centre], el: elevations[e] };
    view.formed = formed(view);
    const { range, level } = imaging.profiles(data, shown.samples, p, e, FINER);
    view.profiles = { range, level: imaging.decibels(level) };
    drawMesh();
    plots = [drawImage(view), ...drawProfiles(view)];
    say();
  }

  // What lies under the pointer, in words, and lines through it in all pictures.
  function point(range, cross, level) {
    const across = cross === undefined ? "" : `, cross-range ${written(cross)} m`;
    page.byId("explore-cursor").textContent = `Cursor: range ${written(range)} m${across}, ${level.toFixed(1)} dB.`;
    const [image, sinogram, profile] = plots;
    image.mark.setAttribute("d", image.level(range) + (across && image.upright(cross)));
    sinogram.mark.setAttribute("d", sinogram.level(range));
    profile.mark.setAttribute("d", profile.upright(range));
  }
  const profiled = (range, place) => view.profiles.level[cell(view.profiles.range, range) * azimuths.length + place];
  const pointed = [
    ([cross, range]) => {
      const { formed } = view;
      point(range, cross, formed.decibels[cell(formed.range, range) * formed.cross.length + cell(formed.cross, cross)]);
    },
    ([az, range]) => point(range, undefined, profiled(range, cell(azimuths, az))),
    ([range]) => point(range, undefined, profiled(range, view.centre)),
  ];
  boxes.forEach((box, k) => box.addEventListener("pointermove", (event) => {
    const place = plots[k].at(event);
    if (place) pointed[k](place);
  }));
  sinogramBox.addEventListener("click", (event) => {
    const place = plots[1].at(event);
    if (place) azimuth.value = cell(azimuths, place[0]) - centres[0];
    draw();
  });
  meshCanvas.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    turn.across -= 0.5 * event.movementX;
    turn.up = Math.min(Math.max(turn.up + 0.5 * event.movementY, -180), 180);
    drawMesh();
    say();
  });
  meshCanvas.addEventListener("pointerdown", (event) => meshCanvas.setPointerCapture(event.pointerId));
  back.addEventListener("click", () => {
    Object.assign(turn, { across: 0, up: 0 });
    draw();
  });

  let playing = 0;
  play.addEventListener("click", () => {
    clearInterval(playing);
    playing = playing ? 0 : setInterval(() => {
      azimuth.value = (+azimuth.value + 1) % centres.length;
      draw();
    }, 100);
    play.textContent = playing ? "Stop" : "Play";
  });

  const WAYS = { polar: "polar reformatting", exact: "back-projection (exact)", none: "plain FFT" };
  const sizes = [1, 2, 4, 8].map((finer) => data.pixels.map((count) => count * finer)).filter(([rows, columns], k) => !k || rows * columns <= 20_000);
  options(target, targets.map((shown) => shown.name));
  options(polarization, data.polarizations);
  options(snr, ["no noise", ...data.snrs.map((one) => `${written(one)} dB`)]);
  options(pad, sizes.map((size, k) => `${size.join(" × ")}${k ? ", zero-padded" : ""}`));
  way.append(...(own ? [new Option(`${own.name}, as this run made them`, "own")] : []), ...Object.keys(data.ways).map((name) => new Option(WAYS[name], name)));
  polarization.closest("label").hidden = data.polarizations.length === 1;
  slider(azimuth, centres, Math.floor(centres.length / 8));
  slider(elevation, elevations, nearest(elevations, 0));
  floor.value = -data.floor;
  pad.value = Math.min(data.pixels[0] < 32 ? 2 : 0, pad.length - 1); // coarse pixels hide what an image shows
  form.addEventListener("input", draw);
  draw();
  page.live.explored = () => view.formed;
  return draw;
};

// The viewer of meshes, images and range profiles. Its data are the run's fields (see section_explore.py).
page.live.explore = (data) => {
  const names = ["form", "mesh", "image", "sinogram", "profile", "caption", "cursor", "meshless"];
  const [form, mesh, image, sinogram, profile, caption, cursor, meshless] = names.map((name) => page.byId(`explore-${name}`));
  const { target, polarization, snr, way, pad, azimuth, elevation, floor, play, back } = form.elements;
  const MARGIN = { left: 62, right: 70, top: 20, bottom: 46 }, SURFACE = [158, 189, 219], FINER = 4, LEVELS = 64;
  const { azimuths, elevations, targets } = data, half = data.angle.length >> 1;
  // The places of azimuths about which there is a whole aperture.
  const centres = [...azimuths.keys()].slice(...(data.closed ? [0] : [half, -half])), turn = { across: 0, up: 0 };
  let view = null, playing = 0;

  const radians = (degrees) => (degrees * Math.PI) / 180;
  const color = (level) => data.colors[Math.round(Math.min(Math.max(level, 0), 1) * (data.colors.length - 1))];
  const edges = (axis) => [axis[0] - (axis[1] - axis[0]) / 2, axis.at(-1) + (axis[1] - axis[0]) / 2];
  const cell = (axis, value) => Math.round((value - axis[0]) / (axis[1] - axis[0]));

  // The triangles' corners to the right, up and towards the radar (see project in plots.py).
  function seen({ vertices, triangles }, az, el) {
    const [ca, sa, ce, se] = [Math.cos(az), Math.sin(az), Math.cos(el), Math.sin(el)];
    const turned = vertices.map(([x, y, z]) => {
      const ahead = ca * x + sa * y;
      return [ca * y - sa * x, ce * z - se * ahead, ce * ahead + se * z];
    });
    return triangles.map((corners) => corners.map((corner) => turned[corner]));
  }

  function drawMesh({ shown, az, el }) {
    const width = mesh.clientWidth, height = mesh.clientHeight, context = mesh.getContext("2d");
    Object.assign(mesh, { width: width * devicePixelRatio, height: height * devicePixelRatio });
    meshless.hidden = shown.mesh;
    if (!shown.mesh) return;
    // The scale does not depend on the view, so that the target turns and does not breathe.
    const scale = (0.47 * mesh.height) / Math.max(...shown.mesh.vertices.map((vertex) => Math.hypot(...vertex)));
    context.setTransform(scale, 0, 0, -scale, mesh.width / 2, mesh.height / 2);
    Object.assign(context, { lineWidth: (0.4 * devicePixelRatio) / scale, strokeStyle: "rgba(29, 52, 70, 0.55)" });
    const { part, colors } = shown.mesh; // of several parts
    const triangles = seen(shown.mesh, radians(az + turn.across), radians(el + turn.up)).map((corners, n) => {
      const [red, green, blue, opacity] = part ? colors[part[n]] : [...SURFACE, 1];
      return { corners, color: [red, green, blue], opacity, depth: corners.reduce((sum, corner) => sum + corner[2], 0) };
    });
    for (const { corners: [a, b, c], color, opacity } of triangles.sort((one, other) => one.depth - other.depth)) {
      const [ux, uy, uz] = b.map((one, k) => one - a[k]), [vx, vy, vz] = c.map((one, k) => one - a[k]);
      const [nx, ny, nz] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
      const lit = (Math.sign(nz) * (-0.35 * nx + 0.6 * ny + 0.72 * nz)) / (Math.hypot(nx, ny, nz) || 1);
      const shade = 0.45 + 0.65 * Math.min(Math.max(lit, 0), 1);
      context.fillStyle = `rgba(${color.map((value) => value * shade).join()}, ${opacity})`;
      context.beginPath();
      for (const [right, up] of [a, b, c]) context.lineTo(right, up);
      context.closePath();
      context.fill();
      context.stroke();
    }
  }

  // Axes in one of the boxes, which call `pointed` with the values under the pointer. even: one scale for both.
  function plot(box, across, up, labels, pointed, even) {
    const width = Math.max(box.clientWidth, 200), height = 0.8 * width, svg = box.querySelector("svg");
    const spans = [across[1] - across[0], up[1] - up[0]];
    const room = [width - MARGIN.left - MARGIN.right, height - MARGIN.top - MARGIN.bottom];
    const scale = Math.min(room[0] / spans[0], room[1] / spans[1]);
    const [w, h] = even ? spans.map((span) => scale * span) : room;
    const [left, top] = [MARGIN.left + (room[0] - w) / 2, MARGIN.top + (room[1] - h) / 2];
    svg.replaceChildren();
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const { inside, frame } = drawAxes(svg, [left, top, w, h], across, up, labels);
    for (const type of ["pointermove", "click"]) frame.addEventListener(type, ({ clientX, clientY }) => {
      const { x, y } = new DOMPoint(clientX, clientY).matrixTransform(inside.getScreenCTM().inverse());
      pointed(x, -y, type === "click");
    });
    return { svg, inside, left, top, w, h };
  }

  // Levels in dB, a function of row (upwards) and column, as coloured pixels below the axes, and the bar of colours.
  function paint(box, { svg, left, top, w, h }, level, rows, columns) {
    const canvas = box.querySelector("canvas"), pixels = new ImageData(columns, rows);
    Object.assign(canvas, { width: columns, height: rows });
    Object.assign(canvas.style, { left: `${left}px`, top: `${top}px`, width: `${w}px`, height: `${h}px` });
    for (let row = 0; row < rows; row++) for (let column = 0; column < columns; column++) {
      const place = 4 * ((rows - 1 - row) * columns + column);
      pixels.data.set([...color(1 + level(row, column) / floor.value), 255], place);
    }
    canvas.getContext("2d").putImageData(pixels, 0, 0);
    const x = left + w + 12, height = h / LEVELS;
    for (let k = 0; k < LEVELS; k++) {
      add(svg, "rect", { x, y: top + k * height, width: 12, height, fill: `rgb(${color(1 - k / LEVELS)})` });
    }
    for (const part of [0, 0.25, 0.5, 0.75, 1]) {
      add(svg, "text", { x: x + 15, y: top + part * h + 4 }, written(-part * floor.value));
    }
    add(svg, "text", { x, y: top - 7 }, "dB");
  }

  function drawImage({ shown, p, e, centre, az, el }) {
    const places = data.angle.map((_, a) => (centre + a - half + azimuths.length) % azimuths.length);
    const [own, first] = [p, 0].map((channel) => imaging.samples(data, shown.field, channel, e, places));
    // A receiver's noise is the same in all channels.
    const noisy = +snr.value ? imaging.withNoise(own, data.snrs[snr.value - 1], data.definition, first) : own;
    const { range, cross, decibels } = (view.formed = imaging.image(data, noisy, way.value, ...sizes[pad.value]));
    const level = (row, column) => decibels[row * cross.length + column];
    const pointed = (x, y) => point(y, level(cell(range, y), cell(cross, x)), x);
    const axes = plot(image, edges(cross), edges(range), ["cross-range [m]", "range [m]"], pointed, true);
    paint(image, axes, level, range.length, cross.length);
    if (shown.mesh) outline(axes.inside, seen(shown.mesh, radians(az), radians(el)), Math.cos(radians(el)));
  }

  // The rim of the target's shadow in the image plane: drawn thick, its inside left out. shortening: of cross-range by
  // the elevation (see imaging/geometry.py).
  function outline(inside, triangles, shortening) {
    const d = triangles.map((corners) => {
      const [a, b, c] = corners.map(([right, , ahead]) => [shortening * right, ahead]);
      // All the same way round: near and far sides would cancel.
      const turned = (b[0] - a[0]) * (c[1] - a[1]) < (b[1] - a[1]) * (c[0] - a[0]);
      return `M${a}L${turned ? c : b}L${turned ? b : c}Z`;
    }).join("");
    const mask = add(inside, "mask", { id: "outside" });
    for (const name of ["outline", "shadow"]) add(mask, "path", { d, class: name });
    add(inside, "path", { d, class: "outline", mask: "url(#outside)" });
  }

  function drawProfiles({ shown, p, e, centre }) {
    const { range, decibels } = imaging.profiles(data, shown.field, p, e, FINER), [near, far] = edges(range);
    const level = (row, column) => decibels[column * range.length + row];
    const all = plot(sinogram, edges(azimuths), [near, far], ["azimuth [°]", "range [m]"], (x, y, pressed) => {
      if (!pressed) return point(y, level(cell(range, y), cell(azimuths, x)));
      azimuth.value = cell(azimuths, x) - centres[0];
      draw();
    });
    paint(sinogram, all, level, range.length, azimuths.length);
    add(all.inside, "path", { d: `M${azimuths[centre]} ${-far}V${-near}`, class: "azimuth" });
    const pointed = (x) => point(x, level(cell(range, x), centre));
    const one = plot(profile, [near, far], [-floor.value, 2], ["range [m]", "level [dB]"], pointed);
    add(one.inside, "polyline", { points: range.map((x, row) => `${x},${-level(row, centre)}`).join(" ") });
  }

  function say({ az, el, shown }) {
    const chosen = data.snrs[snr.value - 1];
    const noise = +snr.value ? `at an SNR of ${written(chosen)} dB (${data.definition})` : "without noise";
    const turned = turn.across || turn.up ? "turned by hand" : "as the radar sees it";
    caption.textContent = `${shown.name} at azimuth ${written(az)}°, elevation ${written(el)}°: ${turned}, its image ` +
      `${noise}, its range profiles at that elevation over azimuth, and the one at that azimuth.`;
    const said = [[azimuth, `${written(az)}°`], [elevation, `${written(el)}°`], [floor, `${floor.value} dB`]];
    for (const [input, words] of said) tell(input, words);
  }

  function draw() {
    const centre = centres[azimuth.value], e = +elevation.value, p = +polarization.value, shown = targets[target.value];
    view = { shown, p, e, centre, az: azimuths[centre], el: elevations[e] };
    for (const show of [drawMesh, drawImage, drawProfiles, say]) show(view);
  }

  // What lies under the pointer, in words.
  function point(range, decibels, cross) {
    const across = cross === undefined ? "" : `, cross-range ${written(cross)} m`;
    cursor.textContent = `Cursor: range ${written(range)} m${across}, ${decibels.toFixed(1)} dB.`;
  }

  mesh.addEventListener("pointerdown", (event) => mesh.setPointerCapture(event.pointerId));
  mesh.addEventListener("pointermove", ({ buttons, movementX, movementY }) => {
    if (!buttons) return;
    turn.across -= 0.5 * movementX;
    turn.up = Math.min(Math.max(turn.up + 0.5 * movementY, -180), 180);
    drawMesh(view);
    say(view);
  });
  back.addEventListener("click", () => {
    Object.assign(turn, { across: 0, up: 0 });
    draw();
  });
  play.addEventListener("click", () => {
    clearInterval(playing);
    playing = playing ? 0 : setInterval(() => {
      azimuth.value = (+azimuth.value + 1) % centres.length;
      draw();
    }, 100);
    play.textContent = playing ? "Stop" : "Play";
  });

  const WAYS = { polar: "polar reformatting", none: "plain FFT" };
  const finer = [1, 2, 4, 8].map((factor) => data.pixels.map((count) => count * factor));
  const sizes = finer.filter(([rows, columns], k) => k === 0 || rows * columns <= 20_000);
  options(target, targets.map((shown) => shown.name));
  options(polarization, data.polarizations);
  options(snr, ["no noise", ...data.snrs.map((one) => `${written(one)} dB`)]);
  options(pad, sizes.map((size, k) => `${size.join(" × ")}${k ? ", zero-padded" : ""}`));
  way.append(...Object.keys(data.ways).map((name) => new Option(WAYS[name], name)));
  polarization.closest("label").hidden = data.polarizations.length === 1;
  slider(azimuth, centres, Math.floor(centres.length / 8));
  slider(elevation, elevations, nearest(elevations, 0));
  Object.assign(floor, { min: 10, max: 80, step: 5, value: -data.floor });
  pad.value = Math.min(data.pixels[0] < 32 ? 2 : 0, pad.length - 1); // coarse pixels hide what an image shows
  form.addEventListener("input", draw);
  draw();
  page.live.explored = () => view.formed;
  return draw;
};

// The viewer of meshes, images and range profiles. Its data are the run's fields (see section_explore.py).
page.live.explore = (data) => {
  const form = page.byId("explore-form"), caption = page.byId("explore-caption"), told = page.byId("explore-cursor");
  const canvases = Object.fromEntries(["mesh", "image", "sinogram", "profile"].map((name) => [name, page.byId(`explore-${name}`)]));
  const { target, polarization, snr, way, pad, azimuth, elevation, floor, play, back } = form.elements;
  const SURFACE = [158, 189, 219], FONT = "13px system-ui, sans-serif", RATIO = 0.8, FINER = 4;
  const MARGIN = { left: 62, right: 70, top: 20, bottom: 46 };
  const radians = (degrees) => (degrees * Math.PI) / 180;
  const color = (level) => data.colors[Math.round(Math.min(Math.max(level, 0), 1) * (data.colors.length - 1))];
  const half = data.angle.length >> 1, centres = data.azimuths.map((_, k) => k).slice(...(data.closed ? [0] : [half, -half]));
  const turn = { across: 0, up: 0 }, scales = {};
  let cursor = null;

  // What is packed is unpacked when it is first asked for.
  function unpacked(shown) {
    if (!shown.samples) {
      const { scale, samples } = shown.field;
      shown.samples = Float32Array.from(imaging.numbers(Int16Array, samples), (n) => n * scale);
      if (shown.mesh) {
        let last = 0;
        const steps = imaging.numbers(shown.mesh.wide ? Int32Array : Int16Array, shown.mesh.triangles);
        shown.mesh.corners = Uint32Array.from(steps, (step) => (last += step));
        shown.mesh.points = Float32Array.from(imaging.numbers(Int16Array, shown.mesh.vertices), (n) => n * shown.mesh.scale);
      }
    }
    return shown;
  }

  const ink = () => getComputedStyle(document.documentElement).getPropertyValue("--ink");

  // A canvas as large as its box, and as fine as the screen.
  function prepared(canvas) {
    const width = Math.max(canvas.clientWidth, 200), height = Math.round(width * RATIO), fine = devicePixelRatio || 1;
    canvas.width = Math.round(width * fine);
    canvas.height = Math.round(height * fine);
    const context = canvas.getContext("2d");
    context.scale(fine, fine);
    context.font = FONT;
    context.fillStyle = context.strokeStyle = ink();
    return { context, width, height };
  }

  // Right, up and towards the radar of every vertex (see draw_mesh.project).
  function seen(points, az, el) {
    const [ca, sa, ce, se] = [Math.cos(az), Math.sin(az), Math.cos(el), Math.sin(el)], out = new Float32Array(points.length);
    for (let k = 0; k < points.length; k += 3) {
      const [x, y, z] = [points[k], points[k + 1], points[k + 2]], ahead = ca * x + sa * y;
      out[k] = ca * y - sa * x;
      out[k + 1] = ce * z - se * ahead;
      out[k + 2] = ce * ahead + se * z;
    }
    return out;
  }

  function drawMesh(shown, az, el) {
    const { context, width, height } = prepared(canvases.mesh);
    if (!shown.mesh) {
      context.fillText("No mesh to show: there is none, or it is too fine for this page.", 12, 24);
      return;
    }
    const { points, corners } = shown.mesh, eye = seen(points, az, el);
    // The scale does not depend on the view, so that the target turns and does not breathe.
    let reach = 0;
    for (let k = 0; k < points.length; k += 3) reach = Math.max(reach, Math.hypot(points[k], points[k + 1], points[k + 2]));
    const scale = (0.47 * Math.min(width, height)) / reach;
    const count = corners.length / 3, depth = new Float32Array(count);
    for (let k = 0; k < count; k++) depth[k] = eye[3 * corners[3 * k] + 2] + eye[3 * corners[3 * k + 1] + 2] + eye[3 * corners[3 * k + 2] + 2];
    const order = Uint32Array.from({ length: count }, (_, k) => k).sort((a, b) => depth[a] - depth[b]);
    context.lineWidth = 0.4;
    context.strokeStyle = "rgba(29, 52, 70, 0.55)";
    for (const k of order) {
      const [a, b, c] = [3 * corners[3 * k], 3 * corners[3 * k + 1], 3 * corners[3 * k + 2]];
      const [ux, uy, uz] = [eye[b] - eye[a], eye[b + 1] - eye[a + 1], eye[b + 2] - eye[a + 2]];
      const [vx, vy, vz] = [eye[c] - eye[a], eye[c + 1] - eye[a + 1], eye[c + 2] - eye[a + 2]];
      const [nx, ny, nz] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
      const lit = (Math.sign(nz) * (-0.35 * nx + 0.6 * ny + 0.72 * nz)) / (Math.hypot(nx, ny, nz) || 1);
      const shade = 0.45 + 0.65 * Math.min(Math.max(lit, 0), 1);
      context.fillStyle = `rgb(${SURFACE.map((value) => Math.min(255, Math.round(value * shade))).join()})`;
      context.beginPath();
      for (const p of [a, b, c]) context.lineTo(width / 2 + scale * eye[p], height / 2 - scale * eye[p + 1]);
      context.closePath();
      context.fill();
      context.stroke();
    }
  }

  // Axes of a plot within a canvas: what maps its coordinates to places, and draws ticks and labels. square: one scale.
  function plotted(name, [left, right], [low, high], labels, square) {
    const { context, width, height } = prepared(canvases[name]);
    const room = [width - MARGIN.left - MARGIN.right, height - MARGIN.top - MARGIN.bottom];
    const even = Math.min(room[0] / (right - left), room[1] / (high - low));
    const [w, h] = square ? [even * (right - left), even * (high - low)] : room;
    const [x0, y0] = [MARGIN.left + (room[0] - w) / 2, MARGIN.top + (room[1] - h) / 2];
    const plot = { context, width, height, box: [x0, y0, w, h] };
    plot.x = (value) => x0 + (w * (value - left)) / (right - left);
    plot.y = (value) => y0 + (h * (high - value)) / (high - low);
    scales[name] = (px, py) => [left + ((px - x0) / w) * (right - left), high - ((py - y0) / h) * (high - low)];
    plot.frame = () => {
      context.fillStyle = context.strokeStyle = ink();
      context.lineWidth = 1;
      context.strokeRect(x0, y0, w, h);
      context.textAlign = "center";
      for (const tick of ticks(left, right, 5)) context.fillText(written(tick), plot.x(tick), y0 + h + 16);
      context.fillText(labels[0], x0 + w / 2, y0 + h + 36);
      context.textAlign = "right";
      for (const tick of ticks(low, high, 5)) context.fillText(written(tick), x0 - 6, plot.y(tick) + 4);
      upright(context, labels[1], x0 - 46, y0 + h / 2);
    };
    // Where the cursor is, or the azimuth: lines across.
    plot.line = (x1, y1, x2, y2, style, dash = []) => {
      context.save();
      context.beginPath();
      context.rect(x0, y0, w, h);
      context.clip();
      Object.assign(context, { strokeStyle: style, lineWidth: 1.2 });
      context.setLineDash(dash);
      context.beginPath();
      context.moveTo(x1, y1);
      context.lineTo(x2, y2);
      context.stroke();
      context.restore();
    };
    plot.bar = () => {
      const at = x0 + w + 12;
      for (let k = 0; k < h; k++) {
        context.fillStyle = `rgb(${color(1 - k / h).join()})`;
        context.fillRect(at, y0 + k, 12, 1.5);
      }
      context.fillStyle = ink();
      context.textAlign = "left";
      context.fillText("dB", at, y0 - 7);
      for (let k = 0; k <= 4; k++) context.fillText(written((-k * floor.value) / 4), at + 15, y0 + (k * h) / 4 + 4);
    };
    return plot;
  }

  function upright(context, text, x, y) {
    context.save();
    context.translate(x, y);
    context.rotate(-Math.PI / 2);
    context.textAlign = "center";
    context.fillText(text, 0, 0);
    context.restore();
  }

  // Levels in dB (rows upwards, columns) as coloured pixels in the box of a plot.
  function paint(plot, level, rows, columns) {
    const small = new ImageData(columns, rows), buffer = new OffscreenCanvas(columns, rows);
    level.forEach((one, k) => {
      const row = rows - 1 - Math.floor(k / columns);
      small.data.set([...color(1 + one / floor.value), 255], 4 * (row * columns + (k % columns)));
    });
    buffer.getContext("2d").putImageData(small, 0, 0);
    plot.context.imageSmoothingEnabled = false;
    plot.context.drawImage(buffer, ...plot.box);
  }

  const edges = (axis) => [axis[0] - (axis[1] - axis[0]) / 2, axis.at(-1) + (axis[1] - axis[0]) / 2];

  function drawImage(shown, formed, az, el) {
    const plot = plotted("image", edges(formed.cross), edges(formed.range), ["cross-range [m]", "range [m]"], true);
    paint(plot, formed.decibels, formed.range.length, formed.cross.length);
    if (shown.mesh) outline(plot, shown.mesh, az, el);
    plot.frame();
    plot.bar();
    if (cursor) {
      const [x0, y0, w, h] = plot.box;
      plot.line(x0, plot.y(cursor.range), x0 + w, plot.y(cursor.range), "white", [4, 4]);
      if ("cross" in cursor) plot.line(plot.x(cursor.cross), y0, plot.x(cursor.cross), y0 + h, "white", [4, 4]);
    }
  }

  // The rim of the target's shadow in the image plane: drawn thick, then its inside taken out.
  function outline({ context, box, width, height, x, y }, mesh, az, el) {
    const fine = devicePixelRatio || 1, eye = seen(mesh.points, az, el);
    const layer = new OffscreenCanvas(Math.round(width * fine), Math.round(height * fine)), pen = layer.getContext("2d");
    pen.scale(fine, fine);
    const shadow = new Path2D();
    for (let k = 0; k < mesh.corners.length; k += 3) {
      // Cross-range is shortened by the elevation (see imaging/geometry.py).
      const at = [0, 1, 2].map((corner) => 3 * mesh.corners[k + corner]).map((p) => [x(Math.cos(el) * eye[p]), y(-eye[p + 2])]);
      const [[ax, ay], [bx, by], [cx, cy]] = at;
      // All the same way round: near and far sides would cancel.
      if ((bx - ax) * (cy - ay) < (by - ay) * (cx - ax)) at.reverse();
      at.forEach((corner, number) => (number ? shadow.lineTo(...corner) : shadow.moveTo(...corner)));
      shadow.closePath();
    }
    pen.beginPath();
    pen.rect(...box);
    pen.clip();
    Object.assign(pen, { lineJoin: "round", strokeStyle: "white", lineWidth: 3 });
    pen.stroke(shadow);
    pen.globalCompositeOperation = "destination-out";
    pen.lineWidth = 0.6;
    pen.stroke(shadow);
    pen.fill(shadow, "nonzero");
    context.drawImage(layer, 0, 0, width, height);
  }

  // Range profiles of a view's elevation, kept until another is asked for.
  const kept = {};
  function profiles(shown, p, e) {
    const key = [target.value, p, e].join();
    if (kept.key !== key) {
      const { range, level } = imaging.profiles(data, shown.samples, p, e, FINER);
      Object.assign(kept, { key, range, level: imaging.decibels(level) });
    }
    return kept;
  }

  function drawProfiles(shown, p, e, centre) {
    const { range, level } = profiles(shown, p, e), around = data.azimuths.length, az = data.azimuths[centre];
    const wide = plotted("sinogram", edges(data.azimuths), edges(range), ["azimuth [°]", "range [m]"]);
    paint(wide, level, range.length, around);
    wide.frame();
    wide.bar();
    const [x0, y0, w, h] = wide.box;
    wide.line(wide.x(az), y0, wide.x(az), y0 + h, "white");
    if (cursor) wide.line(x0, wide.y(cursor.range), x0 + w, wide.y(cursor.range), "white", [4, 4]);
    const one = plotted("profile", edges(range), [-floor.value, 2], ["range [m]", "level [dB]"]);
    one.frame();
    range.slice(1).forEach((far, n) => {
      const at = (k) => [one.x(range[k]), one.y(Math.max(level[k * around + centre], -100))];
      one.line(...at(n), ...at(n + 1), page.ink("#0072B2"));
    });
    if (cursor) one.line(one.x(cursor.range), one.box[1], one.x(cursor.range), one.box[1] + one.box[3], ink(), [4, 4]);
  }

  // The image of a view by the chosen imager: pixels' centres, levels in dB.
  function form_(shown, p, e, centre) {
    if (way.value === "own") {
      const { own } = data, a = own.azimuths.reduce((best, one, k) => (distance(one, centre) < distance(own.azimuths[best], centre) ? k : best), 0);
      const count = own.range.length * own.crossrange.length, levels = imaging.numbers(Uint8Array, own.levels[target.value]);
      const start = (e * own.azimuths.length + a) * count;
      const decibels = Array.from(levels.subarray(start, start + count), (level) => (1 - level / 255) * data.floor);
      return { range: own.range, cross: own.crossrange, decibels, azimuth: own.azimuths[a] };
    }
    let samples = imaging.aperture(data, shown.samples, p, e, centre);
    if (+snr.value) {
      const first = imaging.aperture(data, shown.samples, 0, e, centre); // a receiver's noise is the same in all
      samples = imaging.withNoise(samples, data.snrs[snr.value - 1], data.definition, 7919 * centre + 31 * e + +target.value, first);
    }
    const [rows, columns] = data.pixels.map((count) => count * 2 ** pad.value);
    const formed = imaging.image(data, samples, way.value, rows, columns);
    return { ...formed, decibels: imaging.decibels(formed.level), azimuth: data.azimuths[centre] };
  }
  const distance = (az, centre) => Math.abs(((az - data.azimuths[centre] + 540) % 360) - 180);

  function say(shown, formed, centre, el) {
    const az = data.azimuths[centre], noise = +snr.value && way.value !== "own" ? `at an SNR of ${written(data.snrs[snr.value - 1])} dB (${data.definition})` : "without noise";
    for (const [input, value] of [[azimuth, `${written(az)}°`], [elevation, `${written(el)}°`], [floor, `${floor.value} dB`]]) {
      input.setAttribute("aria-valuetext", value);
      input.nextElementSibling.value = value;
    }
    const at = `azimuth ${written(az)}°, elevation ${written(el)}°`, moved = turn.across || turn.up;
    const imaged = formed.azimuth === az ? "" : ` (of azimuth ${written(formed.azimuth)}°)`;
    caption.textContent = `${shown.name} at ${at}: ${moved ? "turned by hand" : "as the radar sees it"}, its image ${noise}${imaged}, its range profiles at that elevation over azimuth, and the one at that azimuth.`;
    canvases.mesh.setAttribute("aria-label", `Mesh of ${shown.name} as seen from ${at}`);
    canvases.image.setAttribute("aria-label", `ISAR image of ${shown.name} at ${at} ${noise}`);
    canvases.sinogram.setAttribute("aria-label", `Range profiles of ${shown.name} over azimuth at elevation ${written(el)}°`);
    canvases.profile.setAttribute("aria-label", `Range profile of ${shown.name} at ${at}`);
  }

  let last = null;
  function draw() {
    const shown = unpacked(data.targets[target.value]), e = +elevation.value, p = +polarization.value, centre = centres[azimuth.value];
    const [el, az] = [data.elevations[e], data.azimuths[centre]];
    last = { shown, p, e, centre, formed: form_(shown, p, e, centre) };
    drawMesh(shown, radians(az + turn.across), radians(el + turn.up));
    drawImage(shown, last.formed, radians(last.formed.azimuth), radians(el));
    drawProfiles(shown, p, e, centre);
    say(shown, last.formed, centre, el);
  }

  // What lies under the pointer, in words, and lines through it in all pictures.
  function point(place) {
    cursor = place;
    told.textContent = place ? `Cursor: range ${written(place.range)} m${"cross" in place ? `, cross-range ${written(place.cross)} m` : ""}${"level" in place ? `, ${place.level.toFixed(1)} dB` : ""}.` : "";
    const { shown, p, e, centre, formed } = last;
    drawImage(shown, formed, radians(formed.azimuth), radians(data.elevations[e]));
    drawProfiles(shown, p, e, centre);
  }
  const nearest = (axis, value) => Math.round((value - axis[0]) / (axis[1] - axis[0]));
  const places = {
    image: ([cross, range]) => {
      const { formed } = last, [i, j] = [nearest(formed.range, range), nearest(formed.cross, cross)];
      const inside = i >= 0 && j >= 0 && i < formed.range.length && j < formed.cross.length;
      return inside ? { range, cross, level: formed.decibels[i * formed.cross.length + j] } : null;
    },
    sinogram: ([az, range]) => ({ range, level: kept.level[nearest(kept.range, range) * data.azimuths.length + nearest(data.azimuths, az)] ?? NaN }),
    profile: ([range]) => ({ range, level: kept.level[nearest(kept.range, range) * data.azimuths.length + last.centre] ?? NaN }),
  };
  for (const [name, place] of Object.entries(places)) {
    canvases[name].addEventListener("pointermove", (event) => point(place(scales[name](event.offsetX, event.offsetY))));
    canvases[name].addEventListener("pointerleave", () => point(null));
  }
  canvases.sinogram.addEventListener("click", (event) => {
    const picked = nearest(data.azimuths, scales.sinogram(event.offsetX, event.offsetY)[0]);
    azimuth.value = picked - centres[0];
    draw();
  });
  canvases.mesh.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    turn.across -= 0.5 * event.movementX;
    turn.up = Math.min(Math.max(turn.up + 0.5 * event.movementY, -180), 180);
    const { shown, centre, e, formed } = last;
    drawMesh(shown, radians(data.azimuths[centre] + turn.across), radians(data.elevations[e] + turn.up));
    say(shown, formed, centre, data.elevations[e]);
  });
  canvases.mesh.addEventListener("pointerdown", (event) => canvases.mesh.setPointerCapture(event.pointerId));
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
    play.setAttribute("aria-pressed", !!playing);
  });

  const slider = (input, { length }) => Object.assign(input, { min: 0, max: length - 1, step: 1, disabled: length === 1 });
  const WAYS = { polar: "polar reformatting", exact: "back-projection (exact)", none: "plain FFT" };
  options(target, data.targets.map((shown) => shown.name));
  options(polarization, data.polarizations);
  options(snr, ["no noise", ...data.snrs.map((one) => `${written(one)} dB`)]);
  options(pad, [0, 1, 2, 3].map((power) => data.pixels.map((count) => count * 2 ** power)).filter(([rows, columns], k) => !k || rows * columns <= 20_000).map((size, k) => `${size.join(" × ")}${k ? ", zero-padded" : ""}`));
  way.replaceChildren(...(data.own ? [new Option(`${data.own.name}, as this run made them`, "own")] : []), ...Object.keys(data.ways).map((name) => new Option(WAYS[name], name)));
  polarization.closest("label").hidden = data.polarizations.length === 1;
  slider(azimuth, centres);
  slider(elevation, data.elevations);
  azimuth.value = Math.floor(centres.length / 8);
  elevation.value = data.elevations.reduce((best, value, k) => (Math.abs(value) < Math.abs(data.elevations[best]) ? k : best), 0);
  floor.value = -data.floor;
  pad.value = Math.min(data.pixels[0] < 32 ? 2 : 0, pad.length - 1); // coarse pixels hide what an image shows
  form.addEventListener("input", draw);
  form.addEventListener("submit", (event) => event.preventDefault());
  draw();
  page.live.explored = () => last.formed;
  return draw;
};

// The viewer of meshes and images. Its data stand in the page as JSON (see section_explore.py).
(() => {
  const { form, data } = shared.start("explore"), { ticks, written, byId } = shared;
  const caption = byId("explore-caption"), meshCanvas = byId("explore-mesh"), imageCanvas = byId("explore-image");
  const { target, snr, azimuth, elevation } = form.elements;
  const [rows, columns] = data.pixels;
  const SURFACE = [158, 189, 219], FONT = "13px system-ui, sans-serif";
  const MARGIN = { left: 58, right: 76, top: 10, bottom: 44 };
  const radians = (degrees) => (degrees * Math.PI) / 180;
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const color = (level) => data.colors[Math.round(Math.min(Math.max(level, 0), 1) * (data.colors.length - 1))];

  // What is packed is unpacked when it is first asked for.
  function unpacked(shown) {
    if (!shown.levels) {
      shown.levels = bytes(shown.images);
      if (shown.mesh) {
        const corners = bytes(shown.mesh.triangles).buffer;
        shown.mesh.corners = shown.mesh.wide ? new Uint32Array(corners) : new Uint16Array(corners);
        shown.mesh.points = Float32Array.from(new Int16Array(bytes(shown.mesh.vertices).buffer), (n) => n * shown.mesh.scale);
      }
    }
    return shown;
  }

  // A canvas as large as its box, and as fine as the screen.
  function prepared(canvas, ratio) {
    const width = Math.max(canvas.clientWidth, 200), height = Math.round(width * ratio), fine = devicePixelRatio || 1;
    canvas.width = Math.round(width * fine);
    canvas.height = Math.round(height * fine);
    const context = canvas.getContext("2d");
    context.scale(fine, fine);
    context.clearRect(0, 0, width, height);
    context.font = FONT;
    context.fillStyle = "#1b1f24";
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
    const { context, width, height } = prepared(meshCanvas, 0.8);
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
    for (const k of order) {
      const [a, b, c] = [3 * corners[3 * k], 3 * corners[3 * k + 1], 3 * corners[3 * k + 2]];
      const [ux, uy, uz] = [eye[b] - eye[a], eye[b + 1] - eye[a + 1], eye[b + 2] - eye[a + 2]];
      const [vx, vy, vz] = [eye[c] - eye[a], eye[c + 1] - eye[a + 1], eye[c + 2] - eye[a + 2]];
      const [nx, ny, nz] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
      const lit = (Math.sign(nz) * (-0.35 * nx + 0.6 * ny + 0.72 * nz)) / (Math.hypot(nx, ny, nz) || 1);
      const shade = 0.45 + 0.65 * Math.min(Math.max(lit, 0), 1);
      context.fillStyle = `rgb(${SURFACE.map((value) => Math.min(255, Math.round(value * shade))).join()})`;
      context.strokeStyle = "rgba(29, 52, 70, 0.55)";
      context.beginPath();
      for (const p of [a, b, c]) context.lineTo(width / 2 + scale * eye[p], height / 2 - scale * eye[p + 1]);
      context.closePath();
      context.fill();
      context.stroke();
    }
  }

  function drawImage(shown, store, e, a, az, el) {
    const { context, width, height } = prepared(imageCanvas, 0.8), [left, right] = data.crossrange, [near, far] = data.range;
    const room = [width - MARGIN.left - MARGIN.right, height - MARGIN.top - MARGIN.bottom];
    const scale = Math.min(room[0] / (right - left), room[1] / (far - near));
    const [w, h] = [scale * (right - left), scale * (far - near)], [x0, y0] = [MARGIN.left + (room[0] - w) / 2, MARGIN.top + (room[1] - h) / 2];
    const x = (cross) => x0 + scale * (cross - left), y = (range) => y0 + scale * (far - range);
    const small = new ImageData(columns, rows), start = ((store * data.elevations.length + e) * data.azimuths.length + a) * rows * columns;
    shown.levels.subarray(start, start + rows * columns).forEach((level, k) => {
      const row = rows - 1 - Math.floor(k / columns);
      small.data.set([...color(level / 255), 255], 4 * (row * columns + (k % columns)));
    });
    const buffer = new OffscreenCanvas(columns, rows);
    buffer.getContext("2d").putImageData(small, 0, 0);
    context.imageSmoothingEnabled = false;
    context.drawImage(buffer, x0, y0, w, h);
    if (shown.mesh) outline(context, shown.mesh, az, el, x, y, [x0, y0, w, h], width, height);
    context.strokeStyle = "#1b1f24";
    context.strokeRect(x0, y0, w, h);
    context.textAlign = "center";
    for (const tick of ticks(left, right, 5)) context.fillText(written(tick), x(tick), y0 + h + 16);
    context.fillText("cross-range [m]", x0 + w / 2, y0 + h + 36);
    context.textAlign = "right";
    for (const tick of ticks(near, far, 5)) context.fillText(written(tick), x0 - 6, y(tick) + 4);
    turned(context, "range [m]", x0 - 44, y0 + h / 2);
    const bar = x0 + w + 12;
    for (let k = 0; k < h; k++) {
      context.fillStyle = `rgb(${color(1 - k / h).join()})`;
      context.fillRect(bar, y0 + k, 12, 1.5);
    }
    context.fillStyle = "#1b1f24";
    context.textAlign = "left";
    for (let k = 0; k <= 4; k++) context.fillText(written((k * data.floor) / 4), bar + 16, y0 + (k * h) / 4 + 4);
    turned(context, "|image| [dB]", bar + 56, y0 + h / 2);
  }

  function turned(context, text, x, y) {
    context.save();
    context.translate(x, y);
    context.rotate(-Math.PI / 2);
    context.textAlign = "center";
    context.fillText(text, 0, 0);
    context.restore();
  }

  // The rim of the target's shadow in the image plane: drawn thick, then its inside taken out.
  function outline(context, mesh, az, el, x, y, box, width, height) {
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
    pen.lineJoin = "round";
    pen.strokeStyle = "white";
    pen.lineWidth = 3;
    pen.stroke(shadow);
    pen.globalCompositeOperation = "destination-out";
    pen.lineWidth = 0.6;
    pen.stroke(shadow);
    pen.fill(shadow, "nonzero");
    context.drawImage(layer, 0, 0, width, height);
  }

  const options = (select, names) => select.replaceChildren(...names.map((name, k) => new Option(name, k)));

  const slider = (input, { length }) => Object.assign(input, { min: 0, max: length - 1, step: 1, disabled: length === 1 });

  function draw() {
    const shown = unpacked(data.targets[target.value]), [e, a] = [+elevation.value, +azimuth.value];
    const [el, az] = [data.elevations[e], data.azimuths[a]], store = +snr.value;
    for (const [input, value] of [[azimuth, az], [elevation, el]]) {
      input.setAttribute("aria-valuetext", `${written(value)} degrees`);
      input.nextElementSibling.value = `${written(value)}°`;
    }
    drawMesh(shown, radians(az), radians(el));
    drawImage(shown, store, e, a, radians(az), radians(el));
    const noise = store ? `at an SNR of ${shown.snrs[store]} (${data.definition}, first realization)` : "without noise";
    const at = `azimuth ${written(az)}°, elevation ${written(el)}°`;
    caption.textContent = `${shown.name} at ${at}: as the radar sees it, and its image ${noise}.`;
    meshCanvas.setAttribute("aria-label", `Mesh of ${shown.name} as seen from ${at}`);
    imageCanvas.setAttribute("aria-label", `ISAR image of ${shown.name} at ${at} ${noise}`);
  }

  options(target, data.targets.map((shown) => shown.name));
  slider(azimuth, data.azimuths);
  slider(elevation, data.elevations);
  azimuth.value = Math.floor(data.azimuths.length / 8);
  elevation.value = data.elevations.reduce((best, value, k) => (Math.abs(value) < Math.abs(data.elevations[best]) ? k : best), 0);
  options(snr, data.targets[0].snrs);
  form.addEventListener("input", (event) => {
    if (event.target === target) {
      const kept = snr.selectedOptions[0].text, names = data.targets[target.value].snrs;
      options(snr, names);
      snr.value = Math.max(names.indexOf(kept), 0);
    }
    draw();
  });
  addEventListener("resize", draw);
  draw();
})();

// The hemisphere: forward to the right, the source on the left; no network, no library.
(function () {
  "use strict";
  const data = JSON.parse(document.getElementById("hemisphere-data").textContent);
  const disc = document.getElementById("disc"), cut = document.getElementById("cut");
  const said = document.getElementById("value");
  const pick = {};
  ["element", "place", "scale"].forEach((n) => { pick[n] = document.getElementById("pick-" + n); });
  const floats = (text) => {
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
    return new Float32Array(bytes.buffer);
  };
  const add = (select, words) => words.forEach((word, k) => select.add(new Option(word, k)));
  add(pick.element, data.elements.map((e) => e.name + " [" + e.unit + "]"));
  add(pick.place, data.places.map((p) => p.name));
  const cache = {};
  const layer = () => {
    const key = pick.place.value + "/" + pick.element.value;
    if (!cache[key]) {
      const held = data.places[pick.place.value].layers[pick.element.value];
      cache[key] = { value: floats(held[0]), error: held[1] ? floats(held[1]) : null, top: held[2] };
    }
    return cache[key];
  };
  const shown = (v) => (Number.isFinite(v) ? v.toPrecision(3) : "not known");
  const nT = data.n_theta, nP = data.n_dphi, DECADES = 4;
  const share = (v, top, signed) => {           // 0 ... 1 on the colour scale
    if (pick.scale.value === "log") {
      const size = Math.max(0, 1 + Math.log10(Math.abs(v) / top) / DECADES);
      return signed ? 0.5 + 0.5 * Math.sign(v) * Math.min(1, size) : Math.min(1, v > 0 ? size : 0);
    }
    return Math.min(1, Math.max(0, signed ? 0.5 + 0.5 * v / top : v / top));
  };
  const colour = (v, top, element) => {
    if (!Number.isFinite(v)) return [217, 217, 217];
    const map = element.signed ? data.signed : data.rising;
    return map[Math.round(share(v, top, element.signed) * (map.length - 1))];
  };
  const cellAt = (x, y, radius) => {
    const r = Math.hypot(x, y) / radius;
    if (r >= 1) return null;
    const dphi = (Math.atan2(y, x) + 3 * Math.PI) % (2 * Math.PI);
    return { t: Math.min(nT - 1, Math.floor(r * nT)), p: Math.round(dphi / (2 * Math.PI) * nP) % nP };
  };
  const letters = (g, text, x, y) => {
    g.font = "14px system-ui, sans-serif"; g.textAlign = "center"; g.textBaseline = "middle";
    g.lineWidth = 4; g.strokeStyle = "white"; g.strokeText(text, x, y);
    g.fillStyle = "black"; g.fillText(text, x, y);
  };
  function drawDisc() {
    const element = data.elements[pick.element.value], at = layer(), size = disc.width;
    const g = disc.getContext("2d"), radius = size / 2 - 26, image = g.createImageData(size, size);
    for (let j = 0; j < size; j++) for (let i = 0; i < size; i++) {
      const cell = cellAt(i + 0.5 - size / 2, size / 2 - j - 0.5, radius), k = 4 * (j * size + i);
      if (!cell) continue;
      const n = cell.t * nP + cell.p, v = at.value[n];
      let c = colour(v, at.top, element);
      const unsure = at.error && Math.abs(v) < 2 * at.error[n];
      if (unsure && (i + j) % 7 === 0) c = [110, 110, 110];
      image.data[k] = c[0]; image.data[k + 1] = c[1]; image.data[k + 2] = c[2]; image.data[k + 3] = 255;
    }
    g.clearRect(0, 0, size, size);
    g.putImageData(image, 0, 0);
    [1 / 3, 2 / 3, 1].forEach((part) => {
      g.beginPath(); g.arc(size / 2, size / 2, part * radius, 0, 7);
      g.strokeStyle = "rgba(0,0,0,.55)"; g.lineWidth = 1; g.stroke();
    });
    const zenith = data.places[pick.place.value].theta_i_deg / 90 * radius;
    letters(g, "30°", size / 2 + radius / 3 * 0.4, size / 2 - radius / 3 * 0.92);
    letters(g, "60°", size / 2 + 2 * radius / 3 * 0.4, size / 2 - 2 * radius / 3 * 0.92);
    letters(g, "★", size / 2 - zenith, size / 2); letters(g, "+", size / 2 + zenith, size / 2);
    letters(g, "0°", 12, size / 2); letters(g, "180°", size - 16, size / 2);
    letters(g, "270°", size / 2, 11); letters(g, "90°", size / 2, size - 11);
  }
  function drawCut(marked) {
    const element = data.elements[pick.element.value], at = layer(), g = cut.getContext("2d");
    const w = cut.width, h = cut.height, left = 62, low = 34, log = pick.scale.value === "log" && !element.signed;
    const points = [];
    for (let t = nT - 1; t >= 0; t--) points.push([-(t + 0.5) * 90 / nT, t * nP]);
    for (let t = 0; t < nT; t++) points.push([(t + 0.5) * 90 / nT, t * nP + nP / 2]);
    const known = points.map((p) => at.value[p[1]]).filter((v) => Number.isFinite(v) && (!log || v > 0));
    const top = Math.max(...known, 1e-30), base = log ? Math.max(top / 1e5, Math.min(...known) / 2) : Math.min(0, ...known);
    const X = (a) => left + (a + 90) / 180 * (w - left - 12);
    const part = (v) => (log ? Math.log(Math.max(v, base) / base) / Math.log(top * 1.3 / base) : (v - base) / ((top - base) * 1.08));
    const Y = (v) => h - low - Math.min(1, Math.max(0, part(v))) * (h - low - 14);
    g.clearRect(0, 0, w, h);
    g.strokeStyle = "#999"; g.lineWidth = 1; g.strokeRect(left, 14, w - left - 12, h - low - 14);
    g.font = "13px system-ui, sans-serif"; g.fillStyle = "#222"; g.textBaseline = "middle";
    g.textAlign = "right"; g.fillText(shown(top), left - 5, Y(top)); g.fillText(shown(base), left - 5, Y(base));
    g.textAlign = "center";
    [-90, -60, -30, 0, 30, 60, 90].forEach((a) => g.fillText(a + "°", Math.min(X(a), w - 16), h - low + 12));
    points.forEach((p) => {
      const v = at.value[p[1]];
      if (!Number.isFinite(v) || (log && v <= 0)) return;
      const near = marked !== undefined && Math.abs(p[0] - marked) < 45 / nT + 1e-9;
      g.strokeStyle = g.fillStyle = near ? "#D55E00" : "#0072B2";
      if (at.error) {
        const e = 2 * at.error[p[1]];
        g.beginPath(); g.moveTo(X(p[0]), Y(v - e)); g.lineTo(X(p[0]), Y(v + e)); g.stroke();
      }
      g.beginPath(); g.arc(X(p[0]), Y(v), near ? 5 : 2.2, 0, 7); g.fill();
    });
  }
  function tell(event) {
    const box = disc.getBoundingClientRect(), unit = disc.width / box.width, size = disc.width;
    const x = (event.clientX - box.left) * unit - size / 2, y = size / 2 - (event.clientY - box.top) * unit;
    const cell = cellAt(x, y, size / 2 - 26);
    if (!cell) return;
    const at = layer(), n = cell.t * nP + cell.p, zenith = (cell.t + 0.5) * 90 / nT, e = data.elements[pick.element.value];
    const error = at.error ? " ± " + shown(at.error[n]) : "";
    said.textContent = e.name + " = " + shown(at.value[n]) + error + " " + e.unit + " at zenith " +
      zenith.toFixed(1) + "°, azimuth from the source " + (cell.p * 360 / nP).toFixed(1) + "°";
    drawCut(Math.cos(cell.p * 2 * Math.PI / nP) < 0 ? zenith : -zenith);
  }
  const all = () => { drawDisc(); drawCut(); };
  Object.values(pick).forEach((select) => select.addEventListener("change", all));
  ["pointermove", "pointerdown"].forEach((kind) => disc.addEventListener(kind, tell));
  all();
})();

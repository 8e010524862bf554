// The hemisphere: forward to the right, the source on the left; no network, no library.
(function () {
  "use strict";
  const data = JSON.parse(document.getElementById("hemisphere-data").textContent);
  const byId = (name) => document.getElementById(name);
  const disc = byId("disc"), cut = byId("cut"), bar = byId("scale"), said = byId("value");
  const nT = data.n_theta, nP = data.n_dphi, DECADES = 4, RIM = 40, FONT = "13px system-ui, sans-serif";
  const dims = data.dims.map((_, k) => "dim" + k);
  const pick = {};
  ["element", ...dims, "bounces", "show", "scale"].forEach((n) => { pick[n] = byId("pick-" + n); });
  const add = (select, words) => words.forEach((word, k) => select.add(new Option(word, k)));
  add(pick.element, data.elements.map((e) => e.name + " [" + e.unit + "]"));
  data.dims.forEach((d, k) => add(pick[dims[k]], d.values));
  if (pick.bounces) add(pick.bounces, data.bounces);
  const dry = data.dims.findIndex((d) => d.name === "state" && d.values.includes("dry"));
  const views = ["Monte Carlo"];
  if (data.model) views.push("analytical model", "Monte Carlo - model", "difference in standard errors");
  if (dry >= 0) views.push("minus dry");
  views.forEach((word) => pick.show.add(new Option(word, word)));

  // Half precision times a factor
  const floats = ([factor, text]) => {
    const raw = atob(text), out = new Float64Array(raw.length / 2);
    for (let k = 0; k < out.length; k++) {
      const bits = raw.charCodeAt(2 * k) | (raw.charCodeAt(2 * k + 1) << 8);
      const power = (bits >> 10) & 31, part = bits & 1023, sign = bits & 32768 ? -1 : 1;
      out[k] = factor * sign * (power === 31 ? (part ? NaN : Infinity)
        : power ? (1 + part / 1024) * 2 ** (power - 15) : part / 1024 * 2 ** -14);
    }
    return out;
  };
  const cache = {};
  const unpacked = (key, held) => (cache[key] ||= { value: floats(held[0]),
    error: held[1] ? floats(held[1]) : null, top: held[2] });
  const element = () => data.elements[pick.element.value];
  const place = (changed) => data.dims.reduce((sum, d, k) => {
    const at = changed && k === changed[0] ? changed[1] : Number(pick[dims[k]].value);
    return sum * d.values.length + at;
  }, 0);
  const traced = (at) => {
    const b = pick.bounces ? pick.bounces.value : 0, e = pick.element.value;
    return unpacked(["mc", at, b, e].join(), data.monte_carlo[at][b][e]);
  };
  const modelled = (at) => unpacked(["model", at, pick.element.value].join(), data.model[at][pick.element.value]);
  const reach = (values, errors) => {
    const sizes = [];
    values.forEach((v, k) => { if (Number.isFinite(v) && !(errors && errors[k] > Math.abs(v))) sizes.push(Math.abs(v)); });
    sizes.sort((a, b) => a - b);
    return sizes.length ? sizes[Math.floor(0.99 * (sizes.length - 1))] || 1 : 1;
  };
  const apart = (a, b) => {                      // angles repeat after 180 degrees
    const d = a - b;
    return element().kind === "angle" ? d - 180 * Math.round(d / 180) : d;
  };
  const shownLayer = () => {                     // value, error, top, unit and kind of what is shown
    const at = place(), e = element(), view = pick.show.value, mc = traced(at);
    if (view === "Monte Carlo") return { ...mc, unit: e.unit, kind: e.kind, name: e.name };
    if (view === "analytical model") return { ...modelled(at), unit: e.unit, kind: e.kind, name: e.name + " (model)" };
    const base = view === "minus dry"
      ? traced(place([dry, data.dims[dry].values.indexOf("dry")])) : modelled(at);
    const value = mc.value.map((v, k) => apart(v, base.value[k]));
    const error = mc.error && mc.error.map((v, k) => (base.error ? Math.hypot(v, base.error[k]) : v));
    if (view === "difference in standard errors") {
      const ratio = value.map((v, k) => (error && error[k] > 0 ? v / error[k] : NaN));
      return { value: ratio, error: null, top: 5, unit: "standard errors", kind: "signed", name: e.name + " beyond the model" };
    }
    return { value, error, top: reach(value, error), unit: e.unit, kind: "signed",
      name: e.name + (view === "minus dry" ? " minus dry" : " - model") };
  };
  const shown = (v) => {
    if (!Number.isFinite(v)) return "not known";
    const size = Math.abs(v), short = size === 0 || (size >= 1e-3 && size < 1e5);
    return short ? String(Number(v.toPrecision(3))) : v.toExponential(2);
  };
  const wide = (layer) => {                      // as the plots choose: decades are spanned
    if (layer.wide === undefined) {
      const lit = Array.from(layer.value, Math.abs).filter((v) => v > 0 && Number.isFinite(v)).sort((a, b) => a - b);
      layer.wide = layer.kind !== "angle" && layer.unit === "1/sr" && lit.length > 0 &&
        layer.top > 30 * (lit[(lit.length - 1) >> 1] + lit[lit.length >> 1]) / 2;
    }
    return layer.wide;
  };
  const log = (layer) => pick.scale.value === "log" || (pick.scale.value === "auto" && wide(layer));

  const share = (v, layer) => {                  // 0 ... 1 on the colour scale
    if (layer.kind === "angle") return (v + 90) / 180;
    const signed = layer.kind === "signed";
    if (log(layer)) {
      const size = Math.min(1, Math.max(0, 1 + Math.log10(Math.abs(v) / layer.top) / DECADES));
      return signed ? 0.5 + 0.5 * Math.sign(v) * size : v > 0 ? size : 0;
    }
    return Math.min(1, Math.max(0, signed ? 0.5 + 0.5 * v / layer.top : v / layer.top));
  };
  const mapped = (part, kind) => {
    const map = data[kind];
    return map[Math.round(Math.min(1, Math.max(0, part)) * (map.length - 1))];
  };
  const prepared = (canvas, width, height) => {  // letters keep their size on any screen
    const fine = window.devicePixelRatio || 1, g = canvas.getContext("2d");
    canvas.width = Math.round(width * fine); canvas.height = Math.round(height * fine);
    canvas.style.width = width + "px"; canvas.style.height = height + "px";
    g.setTransform(fine, 0, 0, fine, 0, 0); g.clearRect(0, 0, width, height); g.font = FONT;
    return g;
  };
  const room = (most) => Math.floor(Math.min(most, disc.closest(".viewer").clientWidth));
  const letters = (g, text, x, y) => {
    g.textAlign = "center"; g.textBaseline = "middle";
    g.lineWidth = 4; g.strokeStyle = "white"; g.strokeText(text, x, y);
    g.fillStyle = "black"; g.fillText(text, x, y);
  };
  let size = 0, radius = 0, mark = null;         // mark: ring and sector that are pointed at
  const cellAt = (x, y) => {
    const r = Math.hypot(x, y) / radius;
    if (r >= 1) return null;
    const dphi = (Math.atan2(y, x) + 3 * Math.PI) % (2 * Math.PI);
    return { t: Math.min(nT - 1, Math.floor(r * nT)), p: Math.round(dphi / (2 * Math.PI) * nP) % nP };
  };

  function drawDisc(layer) {
    size = room(420); radius = size / 2 - RIM;
    const g = prepared(disc, size, size), fine = disc.width / size;
    const image = g.createImageData(disc.width, disc.height);
    for (let j = 0; j < disc.height; j++) for (let i = 0; i < disc.width; i++) {
      const cell = cellAt((i + 0.5) / fine - size / 2, size / 2 - (j + 0.5) / fine);
      if (!cell) continue;
      const n = cell.t * nP + cell.p, v = layer.value[n], k = 4 * (j * disc.width + i);
      let c = Number.isFinite(v) ? mapped(share(v, layer), layer.kind) : [217, 217, 217];
      const unsure = layer.error && layer.kind !== "angle" && Math.abs(v) < 2 * layer.error[n];
      if (unsure && Math.floor((i + j) / fine) % 7 === 0) c = [110, 110, 110];
      image.data.set([c[0], c[1], c[2], 255], k);
    }
    g.putImageData(image, 0, 0);
    [1 / 3, 2 / 3, 1].forEach((part) => {
      g.beginPath(); g.arc(size / 2, size / 2, part * radius, 0, 7);
      g.strokeStyle = "rgba(0,0,0,.55)"; g.lineWidth = 1; g.stroke();
    });
    const zenith = data.theta_i_deg[place()] / 90 * radius, middle = size / 2;
    letters(g, "30°", middle + radius / 3 * 0.4, middle - radius / 3 * 0.92);
    letters(g, "60°", middle + 2 * radius / 3 * 0.4, middle - 2 * radius / 3 * 0.92);
    letters(g, "★", middle - zenith, middle); letters(g, "+", middle + zenith, middle);
    letters(g, "0°", 12, middle); letters(g, "180°", size - 18, middle);
    letters(g, "270°", middle, 12); letters(g, "90°", middle, size - 12);
    if (mark) {
      const r = (mark.t + 0.5) / nT * radius, a = mark.p * 2 * Math.PI / nP - Math.PI;
      g.beginPath(); g.arc(middle + r * Math.cos(a), middle - r * Math.sin(a), 6, 0, 7);
      g.lineWidth = 4; g.strokeStyle = "white"; g.stroke(); g.lineWidth = 2; g.strokeStyle = "#D55E00"; g.stroke();
    }
  }
  function drawBar(layer) {
    const width = size, g = prepared(bar, width, 44), left = 28, span = width - 2 * left;
    for (let i = 0; i < span; i++) {
      g.fillStyle = "rgb(" + mapped(i / span, layer.kind).join() + ")"; g.fillRect(left + i, 2, 1.5, 14);
    }
    const top = layer.kind === "angle" ? 90 : layer.top, least = top / 10 ** DECADES;
    const marks = layer.kind === "rising" ? (log(layer) ? [least, top / 100, top] : [0, top / 2, top])
      : log(layer) && layer.kind === "signed" ? [-top, "±" + shown(least), top] : [-top, 0, top];
    g.fillStyle = "#222"; g.textBaseline = "top";
    marks.forEach((v, k) => {
      g.textAlign = ["left", "center", "right"][k];
      g.fillText(typeof v === "string" ? v : shown(v), [2, width / 2, width - 2][k], 20);
    });
  }
  const left = 66, low = 52;
  const cutPoints = () => {
    const points = [];
    for (let t = nT - 1; t >= 0; t--) points.push([-(t + 0.5) * 90 / nT, t * nP, t, 0]);
    for (let t = 0; t < nT; t++) points.push([(t + 0.5) * 90 / nT, t * nP + nP / 2, t, nP / 2]);
    return points;
  };
  const cutX = (a, w) => left + (a + 90) / 180 * (w - left - 14);
  function drawCut(layer) {
    const w = room(520), h = 340, g = prepared(cut, w, h), points = cutPoints();
    const curve = data.model && pick.show.value === "Monte Carlo" ? modelled(place()) : null;
    const scan = pick.show.value === "Monte Carlo" && (!pick.bounces || pick.bounces.value === "0")
      ? data.readings[place()][element().name] || [] : [];
    const logarithmic = log(layer) && layer.kind === "rising";
    const all = points.flatMap((p) => [layer.value[p[1]], curve ? curve.value[p[1]] : NaN]).concat(scan.map((r) => r[1]))
      .filter((v) => Number.isFinite(v) && (!logarithmic || v > 0));
    const angle = layer.kind === "angle";
    let top = angle ? 90 : all.length ? Math.max(...all) : 1;
    let base = angle ? -90 : all.length ? Math.min(0, ...all) : 0;
    // Room for the bars, as far as they are no longer than the curve is high
    const bars = angle || !layer.error ? [] : points.map((p) => [layer.value[p[1]], 2 * layer.error[p[1]]])
      .concat(scan.map((r) => [r[1], 2 * (r[2] || 0)])).filter((b) => b.every(Number.isFinite));
    const tall = top - base;
    if (bars.length) top = Math.max(top, Math.min(top + tall, Math.max(...bars.map((b) => b[0] + b[1]))));
    if (base < 0 && bars.length) base = Math.min(base, Math.max(base - tall, Math.min(...bars.map((b) => b[0] - b[1]))));
    if (logarithmic) base = Math.max(top / 1e5, Math.min(...all, top) / 2);
    if (!(top > base)) top = base + 1;
    const part = (v) => (logarithmic ? Math.log(Math.max(v, base) / base) / Math.log(top * 1.3 / base) : (v - base) / ((top - base) * 1.08));
    const X = (a) => cutX(a, w), Y = (v) => h - low - Math.min(1, Math.max(0, part(v))) * (h - low - 24);
    g.fillStyle = "#222"; g.textBaseline = "top"; g.textAlign = "left";
    g.fillText(layer.name + " [" + layer.unit + "]", left, 2);
    g.strokeStyle = "#999"; g.lineWidth = 1; g.strokeRect(left, 24, w - left - 14, h - low - 24);
    g.textBaseline = "middle"; g.textAlign = "right";
    g.fillText(shown(top), left - 5, Y(top)); g.fillText(shown(base), left - 5, Y(base));
    if (base < 0 && top > 0) {
      g.strokeStyle = "#ccc"; g.beginPath(); g.moveTo(X(-90), Y(0)); g.lineTo(X(90), Y(0)); g.stroke();
      if (Y(base) - Y(0) > 16 && Y(0) - Y(top) > 16) g.fillText("0", left - 5, Y(0));
    }
    g.textAlign = "center";
    [-90, -45, 0, 45, 90].forEach((a) => g.fillText(a + "°", Math.min(X(a), w - 16), h - low + 14));
    g.fillText("view angle [deg], + forward", (left + w - 14) / 2, h - 12);
    if (curve) {
      g.strokeStyle = "#D55E00"; g.setLineDash([6, 4]); g.lineWidth = 1.5; g.beginPath();
      points.forEach((p) => { const v = curve.value[p[1]]; if (Number.isFinite(v) && (!logarithmic || v > 0)) g.lineTo(X(p[0]), Y(v)); });
      g.stroke(); g.setLineDash([]); g.lineWidth = 1;
    }
    const dot = (x, v, e, r) => {
      if (!Number.isFinite(v) || (logarithmic && v <= 0)) return;
      if (e) { g.beginPath(); g.moveTo(x, Y(v - 2 * e)); g.lineTo(x, Y(v + 2 * e)); g.stroke(); }
      g.beginPath(); g.arc(x, Y(v), r, 0, 7); g.fill();
    };
    points.forEach((p) => {
      const near = mark && mark.t === p[2] && mark.p === p[3];
      g.strokeStyle = g.fillStyle = near ? "#D55E00" : "#0072B2";
      dot(X(p[0]), layer.value[p[1]], layer.error && layer.error[p[1]], near ? 5 : 2.2);
    });
    g.strokeStyle = "#333"; g.fillStyle = "white";
    scan.forEach((r) => {
      if (r[1] === null || (logarithmic && r[1] <= 0)) return;
      const x = X(r[0]), y = Y(r[1]);
      if (r[2]) { g.beginPath(); g.moveTo(x, Y(r[1] - 2 * r[2])); g.lineTo(x, Y(r[1] + 2 * r[2])); g.stroke(); }
      g.beginPath(); g.moveTo(x - 4, y); g.lineTo(x, y - 4); g.lineTo(x + 4, y); g.lineTo(x, y + 4); g.closePath(); g.fill(); g.stroke();
    });
  }
  function tell() {
    if (!mark) return;
    const layer = shownLayer(), n = mark.t * nP + mark.p, zenith = (mark.t + 0.5) * 90 / nT;
    const error = layer.error ? " ± " + shown(layer.error[n]) : "";
    said.textContent = layer.name + " = " + shown(layer.value[n]) + error + " " + layer.unit + " at zenith " +
      zenith.toFixed(1) + "°, azimuth from the source " + (mark.p * 360 / nP).toFixed(1) + "°";
  }
  function all() {
    if (pick.bounces) pick.bounces.disabled = pick.show.value === "analytical model";
    const layer = shownLayer();
    drawDisc(layer); drawBar(layer); drawCut(layer); tell();
  }
  const move = (cell) => { if (cell) { mark = cell; all(); } };
  const onDisc = (event) => {
    const box = disc.getBoundingClientRect();
    move(cellAt(event.clientX - box.left - size / 2, size / 2 - (event.clientY - box.top)));
  };
  const onCut = (event) => {
    const box = cut.getBoundingClientRect(), w = box.width;
    const view = (event.clientX - box.left - left) / (w - left - 14) * 180 - 90;
    if (Math.abs(view) < 90) move({ t: Math.floor(Math.abs(view) / 90 * nT), p: view < 0 ? 0 : nP / 2 });
  };
  disc.addEventListener("keydown", (event) => {
    const at = mark || { t: 0, p: nP / 2 }, step = {
      ArrowUp: { t: Math.min(nT - 1, at.t + 1), p: at.p }, ArrowDown: { t: Math.max(0, at.t - 1), p: at.p },
      ArrowRight: { t: at.t, p: (at.p + 1) % nP }, ArrowLeft: { t: at.t, p: (at.p + nP - 1) % nP } }[event.key];
    if (step) { event.preventDefault(); move(step); }
  });
  byId("download").addEventListener("click", () => {
    const layer = shownLayer(), lines = ["# " + Object.values(pick).filter((s) => s)
      .map((s) => s.selectedOptions[0].text).join(", ") + "; three digits",
      "theta_s_deg,dphi_deg,value,stderr"];
    for (let t = 0; t < nT; t++) for (let p = 0; p < nP; p++) {
      const n = t * nP + p, number = (v) => (Number.isFinite(v) ? v.toPrecision(4) : "");
      lines.push([((t + 0.5) * 90 / nT).toFixed(4), (p * 360 / nP).toFixed(4), number(layer.value[n]),
        layer.error ? number(layer.error[n]) : ""].join());
    }
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([lines.join("\n") + "\n"], { type: "text/csv" }));
    link.download = element().name + ".csv"; link.click(); URL.revokeObjectURL(link.href);
  });
  Object.values(pick).filter((s) => s).forEach((select) => select.addEventListener("change", all));
  ["pointermove", "pointerdown"].forEach((kind) => { disc.addEventListener(kind, onDisc); cut.addEventListener(kind, onCut); });
  window.addEventListener("resize", all);
  all();
})();

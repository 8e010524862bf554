// Before the page's own scripts: errors, and what canvases letter, as seen on the screen
window.seen = { errors: [], letters: [] };
addEventListener("error", (e) => seen.errors.push(String(e.message)));
addEventListener("unhandledrejection", (e) => seen.errors.push(String(e.reason)));
["error", "warn"].forEach((kind) => { console[kind] = (...said) => seen.errors.push(said.join(" ")); });
const plain = CanvasRenderingContext2D.prototype.fillText;
CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
  const c = this.canvas, screen = this.getTransform().a * c.getBoundingClientRect().width / c.width;
  const across = this.measureText(text).width, at = { left: 0, center: across / 2, right: across }[this.textAlign];
  seen.letters.push([parseFloat(this.font) * screen, text, x - at, x - at + across, c.width / this.getTransform().a]);
  return plain.apply(this, arguments);
};

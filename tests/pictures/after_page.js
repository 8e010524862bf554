// After them: what a reader meets. ASK: [selections, ring, sector, rings, sectors] each
addEventListener("load", () => {
  const ask = ASK, out = { errors: seen.errors, answers: [], small: [], wide: [], images: [] };
  const disc = document.getElementById("disc"), said = document.getElementById("value");
  const choose = (picked) => {
    for (const [name, text] of Object.entries(picked)) {
      const select = document.getElementById("pick-" + name);
      const option = [...select.options].find((o) => o.text === text);
      if (!option) throw new Error(name + " offers no " + text);
      select.value = option.value; select.dispatchEvent(new Event("change"));
    }
  };
  const hash = (canvas) => { let h = 0; for (const c of canvas.toDataURL()) h = (31 * h + c.charCodeAt(0)) | 0; return h; };
  for (const [picked, ring, sector, rings, sectors] of ask) {
    try { choose(picked); } catch (e) { seen.errors.push(String(e)); }
    const box = disc.getBoundingClientRect(), radius = box.width / 2 - 40;
    const angle = sector * 2 * Math.PI / sectors - Math.PI, r = (ring + 0.5) / rings * radius;
    disc.dispatchEvent(new PointerEvent("pointermove", { bubbles: true,
      clientX: box.left + box.width / 2 + r * Math.cos(angle), clientY: box.top + box.width / 2 - r * Math.sin(angle) }));
    out.answers.push([said.textContent, hash(disc), hash(document.getElementById("cut"))]);
  }
  out.controls = [...document.querySelectorAll("select")].map((s) => [s.id, [...s.options].map((o) => o.text)]);
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const parent = texts.currentNode.parentElement;
    if (!texts.currentNode.textContent.trim() || parent.closest("script, style")) continue;
    const size = parseFloat(getComputedStyle(parent).fontSize);
    if (size < 12) out.small.push([size, texts.currentNode.textContent.trim().slice(0, 40)]);
  }
  seen.letters.forEach((l) => {
    // The disc ends 40 px from the border of its canvas
    if (l[1] === "180°" && l[2] < l[4] - 40) out.wide.push(["on the disc: " + l[1], l[2], l[3], l[4]]);
    if (l[0] < 12) out.small.push([l[0], l[1]]);
    if (l[2] < -0.5 || l[3] > l[4] + 0.5) out.wide.push(["letters " + l[1], l[2], l[3], l[4]]);
  });
  document.querySelectorAll("body *").forEach((e) => {
    if (e.closest(".wide") && !e.classList.contains("wide")) return;
    const box = e.getBoundingClientRect();
    if (box.width && (box.right > innerWidth + 0.5 || box.left < -0.5)) out.wide.push([e.tagName + " " + e.id, box.left, box.right, innerWidth]);
  });
  if (document.documentElement.scrollWidth > innerWidth) out.wide.push(["page", 0, document.documentElement.scrollWidth, innerWidth]);
  // Numbers and names break nowhere; hashes may
  out.broken = [];
  const words = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (words.nextNode()) {
    const node = words.currentNode;
    if (!node.parentElement.closest("table") || node.parentElement.closest(".long")) continue;
    for (const word of node.textContent.matchAll(/\S+/g)) {
      const range = document.createRange();
      range.setStart(node, word.index); range.setEnd(node, word.index + word[0].length);
      if (new Set([...range.getClientRects()].map((b) => b.top)).size > 1) out.broken.push(word[0]);
    }
  }
  // What scrolls says so, and nothing else does
  out.uncued = [...document.querySelectorAll(".wide")].filter((e) =>
    (e.scrollWidth > e.clientWidth + 1) !== (getComputedStyle(e, "::before").content !== "none"))
    .map((e) => e.textContent.slice(0, 40));
  out.scrolling = [...document.querySelectorAll(".wide")].filter((e) => e.scrollWidth > e.clientWidth + 1).length;
  out.images = [...document.images].map((i) => [i.complete && i.naturalWidth, i.getBoundingClientRect().width]);
  out.lettered = seen.letters.map((l) => l[1]);
  parent.postMessage({ width: NUMBER, out }, "*");
});

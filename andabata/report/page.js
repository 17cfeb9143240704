// Zoom, pan and values of the drawn figures. The page is whole without it.
"use strict";
for (const figure of document.querySelectorAll("figure[data-axes]")) {
  const svg = figure.querySelector("svg");
  const whole = svg.viewBox.baseVal;
  const home = [whole.x, whole.y, whole.width, whole.height];
  let box = home.slice();
  const axes = JSON.parse(figure.dataset.axes);
  svg.classList.add("zoomed");

  const show = () => svg.setAttribute("viewBox", box.map((v) => v.toFixed(3)).join(" "));
  const place = (event) => {
    const r = svg.getBoundingClientRect();
    return [
      box[0] + ((event.clientX - r.left) / r.width) * box[2],
      box[1] + ((event.clientY - r.top) / r.height) * box[3],
    ];
  };
  const zoom = (factor, x, y) => {
    const size = Math.min(Math.max(box[2] * factor, home[2] / 60), home[2]);
    const share = size / box[2];
    box = [x - (x - box[0]) * share, y - (y - box[1]) * share, box[2] * share, box[3] * share];
    keep();
    show();
  };
  const keep = () => {
    for (const k of [0, 1]) {
      box[k] = Math.min(Math.max(box[k], home[k]), home[k] + home[k + 2] - box[k + 2]);
    }
  };

  const buttons = document.createElement("div");
  buttons.className = "buttons";
  const middle = () => [box[0] + box[2] / 2, box[1] + box[3] / 2];
  for (const [text, title, act] of [
    ["+", "closer", () => zoom(0.6, ...middle())],
    ["−", "further", () => zoom(1 / 0.6, ...middle())],
    ["whole", "the whole figure", () => { box = home.slice(); show(); }],
  ]) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = text;
    button.title = title;
    button.addEventListener("click", act);
    buttons.append(button);
  }
  const tip = document.createElement("div");
  tip.className = "tip";
  figure.querySelector("figcaption").prepend(buttons);
  figure.append(tip);

  // The wheel scrolls the page; with Ctrl or Shift it zooms.
  svg.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.shiftKey) return;
    event.preventDefault();
    const turned = event.deltaY || event.deltaX;
    zoom(turned < 0 ? 0.8 : 1.25, ...place(event));
  }, { passive: false });
  svg.addEventListener("dblclick", (event) => zoom(0.5, ...place(event)));

  let held = null;
  svg.addEventListener("pointerdown", (event) => {
    held = place(event);
    svg.setPointerCapture(event.pointerId);
  });
  svg.addEventListener("pointerup", () => { held = null; });
  svg.addEventListener("pointerleave", () => { tip.style.display = "none"; });

  // Corners of each line, read from its path once.
  const lines = axes.map((one) => one.lines.map((line) => {
    const path = svg.querySelector("#" + CSS.escape(line.id) + " path");
    const numbers = path ? ((path.getAttribute("d") || "").match(/-?[\d.]+(?:e-?\d+)?/g) || []).map(Number) : [];
    return { label: line.label, numbers };
  }));
  const nearest = (k, x, y) => {
    let best = null;
    for (const { label, numbers } of lines[k]) {
      for (let i = 0; i + 1 < numbers.length; i += 2) {
        const gap = Math.hypot(numbers[i] - x, numbers[i + 1] - y);
        if (best === null || gap < best.gap) best = { gap, label, x: numbers[i], y: numbers[i + 1] };
      }
    }
    return best && best.gap < (12 * box[2]) / svg.getBoundingClientRect().width ? best : null;
  };
  const words = (value, span) => {
    const digits = Math.min(Math.max(2 - Math.floor(Math.log10(Math.abs(span) || 1)), 0), 6);
    return value.toFixed(digits);
  };
  svg.addEventListener("pointermove", (event) => {
    const [x, y] = place(event);
    if (held) {
      box[0] += held[0] - x;
      box[1] += held[1] - y;
      keep();
      show();
      return;
    }
    const k = axes.findIndex((a) => x >= a.box[0] && x <= a.box[2] && y >= a.box[1] && y <= a.box[3]);
    if (k < 0) { tip.style.display = "none"; return; }
    const a = axes[k];
    const near = nearest(k, x, y);
    const [px, py] = near ? [near.x, near.y] : [x, y];
    const [x0, x1] = a.x, [y0, y1] = a.y;
    const u = x0 + ((px - a.box[0]) / (a.box[2] - a.box[0])) * (x1 - x0);
    const v = y1 - ((py - a.box[1]) / (a.box[3] - a.box[1])) * (y1 - y0);
    const name = near && near.label ? near.label + ": " : "";
    tip.textContent = `${name}${a.xlabel || "x"} ${words(u, x1 - x0)}, ${a.ylabel || "y"} ${words(v, y1 - y0)}`;
    const r = figure.getBoundingClientRect();
    tip.style.display = "block";
    const left = Math.min(event.clientX - r.left + 14, r.width - tip.offsetWidth - 4);
    tip.style.left = Math.max(left, 0) + "px";
    tip.style.top = event.clientY - r.top + 16 + "px";
  });
}

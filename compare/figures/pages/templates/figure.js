// Makes a picture of compare/figures/pictures.py answer: series are switched on and off, the pointer reads values, and
// panzoom.js magnifies. What is shown is read off the picture, to the hundredths of a point that it is written in.
const NEAR = 12;  // pixels within which the pointer is on a mark or a line

// The marks and lines of a series: points [x, y] in the units of the picture, those of a line joined to the one before.
function read(group) {
  const found = [...group.querySelectorAll("use[x]")].map(mark => [+mark.getAttribute("x"), +mark.getAttribute("y"), false]);
  for (const path of group.querySelectorAll("path:not(defs path)")) {
    const line = !path.hasAttribute("marker-mid");
    for (const [, letter, numbers] of (path.getAttribute("d") ?? "").matchAll(/([A-Za-z])([^A-Za-z]*)/g)) {
      const all = numbers.trim().split(/\s+/).map(Number);  // of a curve the last two, where it ends
      for (let k = line ? all.length - 2 : 0; k >= 0 && k + 1 < all.length; k += 2) found.push([all[k], all[k + 1], line && letter != "M"]);
    }
  }
  return found;
}

function nearest(points, x, y) {
  let best = {off: Infinity};
  points.forEach(([px, py, joined], k) => {
    let at = [px, py];
    if (joined) {
      const [qx, qy] = points[k - 1], dx = px - qx, dy = py - qy;
      const share = Math.max(0, Math.min(1, ((x - qx) * dx + (y - qy) * dy) / (dx * dx + dy * dy || 1)));
      at = [qx + share * dx, qy + share * dy];
    }
    const off = Math.hypot(at[0] - x, at[1] - y) + (joined ? 2 : 0);  // a mark before the line that it lies on
    if (off < best.off) best = {off, at};
  });
  return best;
}

function told({label, kind, a, b, names}, place) {
  let value = a + b * place;
  if (names) return names.reduce((one, other) => Math.abs(other[0] - value) < Math.abs(one[0] - value) ? other : one)[1];
  if (kind == "log") value = 10 ** value;
  const size = Math.abs(value), shown = size < 0.01 * Math.abs(b) && kind == "linear" ? 0
    : size < 1e-3 || size >= 1e6 ? value.toExponential(2) : +value.toPrecision(4);
  return `${label}: ${shown}`;
}

function enliven(figure) {
  const svg = figure.querySelector("svg"), wide = svg.viewBox.baseVal.width;
  const bar = Object.assign(document.createElement("div"), {className: "series"});
  const value = Object.assign(document.createElement("output"), {className: "value", hidden: true});
  const frame = Object.assign(document.createElement("div"), {className: "frame"});
  svg.replaceWith(frame);
  frame.append(svg);
  figure.append(value);

  const series = new Map();
  for (const group of svg.querySelectorAll("[data-series]")) {
    const name = group.dataset.series;
    series.set(name, [...series.get(name) ?? [], group]);
  }
  const boxes = [];
  if (series.size > 1) {
    for (const [name, groups] of series) {
      const label = document.createElement("label"), box = Object.assign(document.createElement("input"), {type: "checkbox", checked: true});
      const look = getComputedStyle(groups[0].querySelector("use, path:not(defs path)") ?? groups[0]);
      box.style.accentColor = [look.stroke, look.fill].find(colour => colour != "none" && colour != "rgb(255, 255, 255)") ?? "gray";
      box.addEventListener("change", () => groups.forEach(group => { group.style.display = box.checked ? "" : "none"; }));
      label.append(box, Object.assign(document.createElement("span"), {innerHTML: name}));
      bar.append(label);
      boxes.push(box);
    }
  }
  function button(text, name, act) {
    const made = Object.assign(document.createElement("button"), {type: "button", textContent: text, title: name});
    made.setAttribute("aria-label", name);
    made.addEventListener("click", act);
    bar.append(made);
  }
  const all = on => boxes.forEach(box => { box.checked = on; box.dispatchEvent(new Event("change")); });
  if (boxes.length > 4) {
    button("all", "show all series", () => all(true));
    button("none", "hide all series", () => all(false));
  }

  const zoom = Panzoom(svg, {minScale: 1, maxScale: 20, contain: "outside", panOnlyWhenZoomed: true, touchAction: "auto", cursor: "auto"});
  button("+", "closer", () => zoom.zoomIn());
  button("−", "farther", () => zoom.zoomOut());
  button("1:1", "the whole figure", () => zoom.reset());
  svg.addEventListener("panzoomchange", event => { svg.style.touchAction = event.detail.scale > 1 ? "none" : "auto"; });
  frame.addEventListener("dblclick", event => zoom.zoomToPoint(2 * zoom.getScale(), event));
  frame.addEventListener("wheel", event => { if (event.ctrlKey) zoom.zoomWithWheel(event); }, {passive: false});
  figure.querySelector("figcaption").before(bar);

  const panels = [...svg.querySelectorAll("[data-axes]")].map(group => ({
    ...JSON.parse(group.dataset.axes), series: [...group.querySelectorAll("[data-series]")].map(own => ({own, points: null})),
  }));
  function point(event) {
    const place = svg.getBoundingClientRect(), unit = wide / place.width;
    const x = (event.clientX - place.left) * unit, y = (event.clientY - place.top) * unit;
    const panel = panels.find(({box}) => x >= box[0] && x <= box[1] && y >= box[2] && y <= box[3]);
    value.hidden = !panel;
    if (!panel) return;
    let best = {off: NEAR * unit, at: [x, y], name: ""};
    for (const each of panel.series) {
      if (each.own.style.display == "none") continue;
      each.points ??= read(each.own);
      const found = nearest(each.points, x, y);
      if (found.off < best.off) best = {...found, name: each.own.dataset.series};
    }
    value.innerHTML = `${best.name ? `<b>${best.name}</b><br>` : ""}${told(panel.x, best.at[0])}<br>${told(panel.y, best.at[1])}`;
    const whole = figure.getBoundingClientRect();
    value.style.left = `${Math.min(event.clientX - whole.left + 14, whole.width - value.offsetWidth)}px`;
    value.style.top = `${event.clientY - whole.top + 14}px`;
  }
  frame.addEventListener("pointermove", point);
  frame.addEventListener("pointerdown", point);
  frame.addEventListener("pointerleave", () => { value.hidden = true; });
}

const seen = new IntersectionObserver(entries => {
  for (const entry of entries) {
    if (!entry.isIntersecting) continue;
    seen.unobserve(entry.target);
    enliven(entry.target);
  }
}, {rootMargin: "300px"});
document.querySelectorAll("figure.plot").forEach(figure => seen.observe(figure));

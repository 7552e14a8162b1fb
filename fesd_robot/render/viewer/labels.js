// Words over the scene: each keeps to its place in the world, and those that would cover an earlier one are left out.
function makeLabels(viewer) {
  const layer = byId("labels"), entries = [], hidden = new Set();
  const GAP = 4; // pixels between labels

  function add({ text, at, kind, rank, group = null, below = false }) {
    const element = document.createElement("span");
    element.className = kind;
    element.style.visibility = "hidden";
    layer.append(element);
    const entry = { at, rank, group, below, element, shown: true, width: 0, height: 0 };
    entry.write = (words) => {
      if (element.textContent === words) return;
      element.textContent = words;
      entry.width = 0;
    };
    entry.write(text);
    entries.push(entry);
    entries.sort((one, other) => one.rank - other.rank);
    return entry;
  }

  function place() {
    const width = layer.clientWidth, height = layer.clientHeight, taken = [];
    viewer.camera.updateMatrixWorld(true);
    for (const entry of entries) {
      const visible = entry.shown && entry.element.textContent && !hidden.has(entry.group);
      if (visible && !entry.width) {
        entry.width = entry.element.offsetWidth;
        entry.height = entry.element.offsetHeight;
      }
      const point = toCamera(entry.at).project(viewer.camera);
      const x = (point.x + 1) / 2 * width, y = (1 - point.y) / 2 * height;
      const left = x - entry.width / 2, top = entry.below ? y + 3 : y - entry.height - 4;
      const right = left + entry.width, bottom = top + entry.height;
      const inside = Math.abs(point.z) <= 1 && left >= 0 && right <= width && top >= 0 && bottom <= height;
      const free = taken.every((one) => left > one[2] + GAP || right < one[0] - GAP || top > one[3] || bottom < one[1]);
      const show = visible && inside && free;
      entry.element.style.visibility = show ? "visible" : "hidden";
      if (!show) continue;
      taken.push([left, top, right, bottom]);
      entry.element.style.transform = `translate(${left}px, ${top}px)`;
    }
  }

  for (const tick of settings.ticks) add({ text: tick.text, at: tick.at, kind: "tick", rank: 2, below: true });
  const render = viewer.render.bind(viewer);
  viewer.render = () => { render(); place(); };
  return { add, setGroup: (group, shown) => { if (shown) hidden.delete(group); else hidden.add(group); } };
}

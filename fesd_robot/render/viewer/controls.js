// The controls as bars against their limits.
function makeControls() {
  const panel = byId("efforts"), { start: starts, entries } = story.controls;
  panel.hidden = entries.length === 0;
  const rows = entries.map((entry) => {
    const cell = (name) => panel.appendChild(Object.assign(document.createElement("span"), { className: name }));
    const name = cell("name"), range = cell("range"), value = cell("value");
    name.textContent = name.title = entry.name;
    const largest = Math.max(1e-9, ...entry.values.map(Math.abs));
    const low = Math.min(entry.lower ?? -largest, 0), high = Math.max(entry.upper ?? largest, 0);
    const fill = range.appendChild(document.createElement("i")), zero = range.appendChild(document.createElement("b"));
    const share = (number) => 100 * (number - low) / (high - low || 1);
    zero.style.left = `${share(0)}%`;
    range.title = `limits ${entry.lower ?? "none"} to ${entry.upper ?? "none"} ${entry.unit}`;
    return { entry, fill, value, share };
  });
  return {
    show(moment) {
      const k = before(starts, moment);
      for (const { entry, fill, value, share } of rows) {
        const number = entry.values[k], [from, to] = [Math.min(share(0), share(number)), Math.max(share(0), share(number))];
        fill.style.left = `${from}%`;
        fill.style.width = `${to - from}%`;
        const limit = number >= 0 ? entry.upper : entry.lower;
        fill.classList.toggle("at-limit", limit !== null && Math.abs(number) > 0.99 * Math.abs(limit) && number !== 0);
        value.textContent = `${number.toFixed(Math.abs(number) < 10 ? 2 : 1)}${limit ? ` / ${Number(limit.toPrecision(4))}` : ""} ${entry.unit}`;
      }
    },
  };
}

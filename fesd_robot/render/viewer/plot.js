// One plot, of a curve that the reader chooses, with a line at the moment that the scene shows.
const LINES = ["#0072b2", "#d55e00", "#009e73"];
const FLAT = 1e-3; // half of the least range that a plot shows, so that round-off is flat
const PLOT_HEIGHT = 170, LOW_PLOT_HEIGHT = 120; // pixels

function makePlot(seek) {
  const panel = byId("plot-panel"), host = byId("plot"), choice = byId("curve");
  panel.hidden = false;
  const { start: starts, entries } = story.controls;
  const steps = [...starts, start + duration];
  const curves = story.curves.map((curve) => ({ ...curve, times: story.time }));
  for (const entry of entries) {
    const limits = [["upper limit", entry.upper], ["lower limit", entry.lower]].filter(([, value]) => value !== null);
    curves.push({
      group: "control", name: entry.name, unit: entry.unit, times: steps, stepped: true,
      lines: [{ name: entry.name, values: [...entry.values, entry.values[entry.values.length - 1]] },
        ...limits.map(([name, value]) => ({ name, values: steps.map(() => value), dashed: true }))],
    });
  }
  const groups = new Map();
  curves.forEach((curve, index) => {
    if (!groups.has(curve.group)) {
      groups.set(curve.group, choice.appendChild(Object.assign(document.createElement("optgroup"), { label: curve.group })));
    }
    groups.get(curve.group).append(new Option(`${curve.group}: ${curve.name} (${curve.unit})`, index));
  });
  // The contact that carries most is what a reader asks for first.
  const strength = (curve) => curve.group === "contact force" ? Math.max(...curve.lines[0].values) : -1;
  choice.value = String(curves.reduce((best, curve, index) => strength(curve) > strength(curves[best]) ? index : best, 0));
  let plot = null, playhead = null, now = start;

  function draw() {
    const curve = curves[Number(choice.value)];
    if (plot) plot.destroy();
    const series = curve.lines.map((line, index) => ({
      label: line.name, width: line.dashed ? 1 : 1.5, points: { show: false },
      stroke: line.dashed ? "#8b949e" : LINES[index % LINES.length], dash: line.dashed ? [4, 4] : undefined,
      paths: curve.stepped && !line.dashed ? uPlot.paths.stepped({ align: 1 }) : undefined,
    }));
    byId("keys").replaceChildren(...(curve.lines.length > 1 ? curve.lines : []).map((line, index) => {
      const entry = document.createElement("span"), swatch = document.createElement("i");
      swatch.className = "swatch";
      swatch.style.background = series[index].stroke;
      entry.append(swatch, line.name);
      return entry;
    }));
    const axis = { stroke: "#3d454d", grid: { stroke: "#eaeef2" }, ticks: { stroke: "#d0d7de" }, font: "11px system-ui, sans-serif" };
    const height = window.innerWidth <= 720 ? LOW_PLOT_HEIGHT : PLOT_HEIGHT;
    const range = (_, low, high) => {
      const middle = (low + high) / 2, half = Math.max((high - low) * 0.55, FLAT, 1e-6 * Math.abs(middle));
      return [middle - half, middle + half];
    };
    plot = new uPlot({
      width: Math.max(host.clientWidth, 120), height, series: [{}, ...series],
      scales: { x: { time: false, range: [start, start + (duration || 1)] }, y: { range } },
      axes: [{ ...axis, size: 26 }, { ...axis, size: 46 }],
      legend: { show: false }, cursor: { drag: { x: false, y: false }, points: { show: false } },
    }, [curve.times, ...curve.lines.map((line) => line.values)], host);
    playhead = document.createElement("div");
    playhead.className = "playhead";
    plot.over.append(playhead);
    plot.over.addEventListener("click", (event) => seek(plot.posToVal(event.offsetX, "x")));
    place();
  }
  function place() {
    if (playhead) playhead.style.left = `${100 * (now - start) / (duration || 1)}%`;
  }
  choice.addEventListener("change", draw);
  let width = 0;
  new ResizeObserver(() => {
    if (host.clientWidth === width || !host.clientWidth) return;
    width = host.clientWidth;
    draw();
  }).observe(host);
  return { show(moment) { now = moment; place(); }, playhead: () => now };
}

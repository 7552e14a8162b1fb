// Plots of costs by uPlot: against a time with the front that no plan beats, and their distribution.
const SIZE = { width: 760, height: 300 };

function front(points) {
  // The points, by increasing time, that no other beats in time and cost.
  let best = Infinity;
  return points.filter(([, cost]) => (cost < best ? ((best = cost), true) : false));
}

function drawPareto(data, time) {
  const points = data.rows
    .filter((row) => row[data.verdict] === "solved" && row[time] !== null && row[data.cost] !== null)
    .map((row) => [row[time], row[data.cost], row[0]])
    .sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const kept = new Set(front(points).map((point) => point[2]));
  const place = document.getElementById("pareto");
  place.replaceChildren();
  if (!points.length) return;
  const options = {
    ...SIZE,
    scales: { x: { time: false } },
    axes: [{ label: `${data.columns[time]}, s` }, { label: "cost", size: 70 }],
    legend: { show: false },
    series: [
      {},
      { stroke: "#0072b2", paths: () => null, points: { show: true, size: 7, fill: "#0072b2" } },
      { stroke: "#d55e00", width: 2, spanGaps: true, points: { show: true, size: 8, fill: "#d55e00" } },
    ],
    hooks: {
      ready: [
        (plot) =>
          plot.over.addEventListener("click", () => {
            const page = plot.cursor.idx === null ? null : data.pages[points[plot.cursor.idx][2]];
            if (page) window.location.href = page;
          }),
      ],
    },
  };
  const columns = [
    points.map((point) => point[0]),
    points.map((point) => point[1]),
    points.map((point) => (kept.has(point[2]) ? point[1] : null)),
  ];
  new uPlot(options, columns, place);
}

function drawCosts(data) {
  const costs = data.rows
    .filter((row) => row[data.verdict] === "solved" && row[data.cost] !== null)
    .map((row) => row[data.cost]);
  const place = document.getElementById("costs");
  place.replaceChildren();
  if (!costs.length) return;
  const low = costs.reduce((a, b) => Math.min(a, b)), high = costs.reduce((a, b) => Math.max(a, b));
  const count = Math.max(1, Math.min(40, Math.ceil(2 * Math.cbrt(costs.length))));
  const width = (high - low) / count || Math.abs(low) * 0.01 || 1;
  const heights = new Array(count).fill(0);
  for (const cost of costs) heights[Math.min(count - 1, Math.floor((cost - low) / width))] += 1;
  const options = {
    ...SIZE,
    scales: { x: { time: false, range: [low - 0.5 * width, low + (count + 0.5) * width] }, y: { range: (_, a, b) => [0, 1.05 * b] } },
    axes: [{ label: "cost" }, { label: "plans", size: 60 }],
    legend: { show: false },
    series: [{}, { stroke: "#0072b2", fill: "#56b4e9", paths: uPlot.paths.bars({ size: [0.95] }), points: { show: false } }],
  };
  new uPlot(options, [heights.map((_, index) => low + (index + 0.5) * width), heights], place);
}

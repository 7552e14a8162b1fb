// The page put together: what is chosen, and what is drawn of it.
const data = JSON.parse(document.getElementById("data").textContent);
for (const name of ["verdict", "cost", "message"]) data[name] = data.columns.indexOf(name);

function choices(id, names, first, redraw) {
  const select = document.getElementById(id);
  for (const name of names) select.appendChild(Object.assign(document.createElement("option"), { value: name, textContent: name }));
  select.value = first;
  select.onchange = redraw;
  return () => (select.value === "–" ? null : data.columns.indexOf(select.value));
}

const cells = () => drawCells(data, across(), down(), colour());
const varied = data.inputs.filter((name) => new Set(data.rows.map((row) => row[data.columns.indexOf(name)])).size > 1);
const keys = varied.length ? varied : data.inputs;
const across = choices("across", ["–", ...keys], keys[0], cells);
const down = choices("down", ["–", ...keys], keys[1] || "–", cells);
const colour = choices("colour", ["cost", "work", "iterations", "seconds", "flights", "slides", "time"], "cost", cells);
const times = new Set(data.rows.map((row) => row[data.columns.indexOf("time")]).map((each) => each && each.toPrecision(6)));
const time = choices("time", ["time", "seconds"], times.size > 2 ? "time" : "seconds", () => drawPareto(data, time()));
const present = VERDICTS.filter((verdict) => data.rows.some((row) => row[data.verdict] === verdict));
const order = { by: 0, up: true };
choices("which", ["all", ...present], "all", (event) => drawTable(data, order, event.target.value));
cells();
drawPareto(data, time());
drawCosts(data);
drawTable(data, order, "all");
window.fesdRobot = { ready: Promise.resolve(true) };

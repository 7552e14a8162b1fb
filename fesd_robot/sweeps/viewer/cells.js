// Success and cost over two keys: a table whose cells have the colour of what is in them.
const MOST_CELLS = 24;
const FAILED = "#d55e00";

function groups(values) {
  // Distinct values in their order; of many numbers as many ranges of one width.
  const numeric = values.every((value) => typeof value === "number");
  const distinct = [...new Set(values)].sort((a, b) => (numeric ? a - b : String(a).localeCompare(String(b))));
  if (!numeric || distinct.length <= MOST_CELLS) {
    const at = new Map(distinct.map((value, index) => [value, index]));
    return { names: distinct.map(label), of: (value) => at.get(value) };
  }
  const low = distinct[0], width = (distinct[distinct.length - 1] - low) / MOST_CELLS;
  const names = Array.from({ length: MOST_CELLS }, (_, index) => label(low + (index + 0.5) * width));
  return { names, of: (value) => Math.min(MOST_CELLS - 1, Math.floor((value - low) / width)) };
}

function label(value) {
  return typeof value === "number" ? String(Number(value.toPrecision(4))) : String(value);
}

function shade(part) {
  // From blue, low, to yellow, high, through green.
  const stops = [[68, 114, 178], [86, 180, 233], [0, 158, 115], [230, 190, 80], [240, 228, 66]];
  const at = Math.max(0, Math.min(1, part)) * (stops.length - 1);
  const first = Math.min(stops.length - 2, Math.floor(at));
  const mix = stops[first].map((low, index) => Math.round(low + (at - first) * (stops[first + 1][index] - low)));
  return `rgb(${mix.join(",")})`;
}

function drawCells(data, across, down, colour) {
  const columns = across === null ? { names: [""], of: () => 0 } : groups(data.rows.map((row) => row[across]));
  const lines = down === null ? { names: [""], of: () => 0 } : groups(data.rows.map((row) => row[down]));
  const cells = lines.names.map(() => columns.names.map(() => []));
  for (const row of data.rows) {
    cells[down === null ? 0 : lines.of(row[down])][across === null ? 0 : columns.of(row[across])].push(row);
  }
  const value = (rows) => {
    const solved = rows.filter((row) => row[data.verdict] === "solved" && row[colour] !== null);
    return solved.length ? solved.reduce((sum, row) => sum + row[colour], 0) / solved.length : null;
  };
  const all = cells.flat().map(value).filter((each) => each !== null);
  const low = Math.min(...all), span = Math.max(...all) - low || 1;
  const table = document.createElement("table");
  const head = table.createTHead().insertRow();
  for (const name of [down === null ? "" : data.columns[down], ...columns.names]) {
    head.appendChild(Object.assign(document.createElement("th"), { textContent: name }));
  }
  const body = table.createTBody();
  cells.forEach((line, index) => {
    const tr = body.insertRow();
    tr.appendChild(Object.assign(document.createElement("th"), { textContent: lines.names[index] }));
    for (const rows of line) tr.appendChild(cell(data, rows, value(rows), low, span));
  });
  table.createCaption().textContent =
    `${across === null ? "" : `across: ${data.columns[across]}; `}mean ${data.columns[colour]} of what is solved, ` +
    `from ${label(low)}, blue, to ${label(low + span)}, yellow; red: nothing is solved there`;
  document.getElementById("cells").replaceChildren(table);
}

function cell(data, rows, value, low, span) {
  const td = document.createElement("td");
  if (!rows.length) return td;
  const solved = rows.filter((row) => row[data.verdict] === "solved").length;
  td.style.background = value === null ? FAILED : shade((value - low) / span);
  td.style.color = value === null ? "#fff" : "#1f2328";
  const page = rows.map((row) => data.pages[row[0]]).find((each) => each);
  const inner = document.createElement(page ? "a" : "span");
  if (page) inner.href = page;
  inner.textContent = rows.length > 1 ? `${solved}/${rows.length}` : value === null ? rows[0][data.verdict] : label(value);
  inner.title = rows.slice(0, 5).map((row) => `${row[0]}: ${row[data.verdict]}, ${row[data.message]}`).join("\n");
  td.appendChild(inner);
  return td;
}

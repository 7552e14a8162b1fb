// All plans, by any column; a plan that is kept opens by its number.
const MOST_LINES = 2000;

function drawTable(data, order, which) {
  const chosen = data.rows.filter((row) => which === "all" || row[data.verdict] === which);
  const sign = order.up ? 1 : -1;
  chosen.sort((a, b) => sign * compared(a[order.by], b[order.by]));
  const table = document.getElementById("plans");
  table.replaceChildren();
  const head = table.createTHead().insertRow();
  data.columns.forEach((name, index) => {
    const th = document.createElement("th");
    th.textContent = name + (index === order.by ? (order.up ? " ▲" : " ▼") : "");
    th.onclick = () => drawTable(data, { by: index, up: index === order.by ? !order.up : true }, which);
    head.appendChild(th);
  });
  const body = table.createTBody();
  for (const row of chosen.slice(0, MOST_LINES)) {
    const tr = body.insertRow();
    row.forEach((value, index) => {
      const td = tr.insertCell();
      if (index === 0 && data.pages[value]) {
        td.appendChild(Object.assign(document.createElement("a"), { href: data.pages[value], textContent: value }));
      } else {
        td.textContent = value === null ? "" : label(value);
        if (typeof value === "string") td.className = "text";
      }
    });
  }
  const more = chosen.length > MOST_LINES ? `, the first ${MOST_LINES} of which are here` : "";
  document.getElementById("count").textContent = `${chosen.length} plans${more}`;
}

function compared(a, b) {
  if (a === null || b === null) return (a === null) - (b === null);
  return typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b));
}

// Who touches when: a bar for every contact above the slider, and marks of the events.
function makeTimeline(seek) {
  const line = byId("timeline"), events = story.events;
  const share = (moment) => `${100 * (moment - start) / (duration || 1)}%`;
  const cell = (name, text = "") => {
    const element = document.createElement("div");
    element.className = name;
    element.textContent = element.title = text;
    line.append(element);
    return element;
  };
  const heads = [];
  for (const row of story.rows) {
    cell("name", row.name);
    const track = cell("track");
    for (const [mode, from, to] of row.spans) {
      const span = document.createElement("i");
      Object.assign(span.style, { left: share(from), width: `${100 * (to - from) / (duration || 1)}%` });
      span.style.background = mode === "flight" ? "#e3e7eb" : settings.modes[mode];
      span.title = `${mode}, ${from.toFixed(3)} to ${to.toFixed(3)} s`;
      track.append(span);
    }
    heads.push(track.appendChild(document.createElement("b")));
  }
  cell("name", events.length ? "events" : "");
  const marks = cell("track events");
  for (const event of events) {
    const mark = document.createElement("button");
    Object.assign(mark, { type: "button", tabIndex: -1, className: event.impact ? "impact" : "", title: `${event.time.toFixed(3)} s: ${event.words}` });
    mark.style.left = share(event.time);
    mark.addEventListener("click", () => seek(event.time));
    marks.append(mark);
  }
  const near = 1e-4; // s
  return {
    show(moment) {
      for (const head of heads) head.style.left = share(moment);
      const event = events.find((one) => Math.abs(one.time - moment) < near);
      byId("event").textContent = event ? event.words : "";
    },
    next: (moment) => events.find((one) => one.time > moment + near)?.time ?? start + duration,
    previous: (moment) => events.filter((one) => one.time < moment - near).pop()?.time ?? start,
  };
}

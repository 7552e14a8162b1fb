// The clock of the page, its buttons and keys.
const STEP = 1 / 50; // s of motion per press of an arrow key
const ICONS = { play: "M3 1.5v13l11-6.5z", pause: "M3 1.5h3.5v13H3zM9.5 1.5H13v13H9.5z" };

function makePlayer(viewer, camera) {
  const slider = byId("slider"), readout = byId("readout"), icon = byId("play-icon");
  const digits = duration < 0.1 ? 4 : 3;
  const followers = [];
  const moment = readout.appendChild(document.createElement("span")), end = readout.appendChild(document.createElement("span"));
  end.className = "end";
  end.textContent = ` / ${(start + duration).toFixed(digits)}`;
  readout.append(" s");
  let now = 0, playing = false, last = null, timeline = null;
  slider.max = String(duration);
  for (const id of ["slider", "play", "previous", "next", "speed", "loop"]) byId(id).disabled = duration === 0;
  byId("time").hidden = duration === 0;
  // The mixer must be active to follow the clock of this page, and paused to have none of its own.
  viewer.animator.play();
  viewer.animator.pause();

  function show(time) {
    now = Math.min(Math.max(time, 0), duration);
    viewer.animator.seek(now);
    slider.value = String(now);
    moment.textContent = (start + now).toFixed(digits);
    camera.show(now);
    for (const follower of followers) follower.show(start + now);
  }
  function setPlaying(value) {
    playing = value && duration > 0;
    last = null;
    icon.setAttribute("d", playing ? ICONS.pause : ICONS.play);
    if (playing && now >= duration) show(0);
    if (playing) requestAnimationFrame(tick);
  }
  function tick(stamp) {
    if (!playing) return;
    // A hidden tab delivers no frames; the motion must not leap when it comes back.
    if (last !== null) {
      let next = now + Math.min((stamp - last) / 1000, 0.25) * Number(byId("speed").value);
      const over = next >= duration;
      if (over && byId("loop").checked) next %= duration;
      show(next);
      if (over && !byId("loop").checked) { setPlaying(false); return; }
    }
    last = stamp;
    requestAnimationFrame(tick);
  }
  const seek = (time) => { setPlaying(false); show(time - start); };
  const jump = (forward) => {
    const here = start + now;
    if (timeline) seek(forward ? timeline.next(here) : timeline.previous(here));
    else seek(forward ? start + duration : start);
  };

  byId("play").addEventListener("click", () => setPlaying(!playing));
  byId("next").addEventListener("click", () => jump(true));
  byId("previous").addEventListener("click", () => jump(false));
  byId("view").addEventListener("change", () => camera.look(byId("view").value));
  byId("follow").addEventListener("change", () => camera.follow(byId("follow").checked));
  slider.addEventListener("input", () => seek(start + Number(slider.value)));
  const KEYS = {
    ArrowRight: (step) => seek(start + now + step),
    ArrowLeft: (step) => seek(start + now - step),
    Home: () => seek(start),
    End: () => seek(start + duration),
    Space: () => setPlaying(!playing),
    KeyN: () => jump(true),
    KeyP: () => jump(false),
    KeyF: () => camera.follow(!camera.following()),
    Digit1: () => camera.look("side"),
    Digit2: () => camera.look("front"),
    Digit3: () => camera.look("top"),
    Digit4: () => camera.look("free"),
  };
  // Elements that have a use of their own for the space bar and the letters.
  const busy = (event) => event.target.closest?.("select, summary, input[type=checkbox]");
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !KEYS[event.code] || busy(event)) return;
    KEYS[event.code](STEP * (event.shiftKey ? 10 : 1));
    event.preventDefault();
  });
  // A button that has the focus would be pressed a second time.
  window.addEventListener("keyup", (event) => { if (event.code === "Space" && !busy(event)) event.preventDefault(); });

  return {
    seek,
    attach(follower) { followers.push(follower); },
    setTimeline(value) { timeline = value; followers.push(value); },
    time: () => start + now,
    play: () => setPlaying(true),
    pause: () => setPlaying(false),
    playing: () => playing,
    show: () => show(now),
  };
}

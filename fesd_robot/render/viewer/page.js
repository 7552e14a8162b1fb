// Puts the parts of the page together.
async function begin() {
  const viewer = new MeshCat.Viewer(byId("scene"));
  for (const command of await commands()) viewer.handle_command_bytearray(command);
  viewer.scene_tree.find(["robot"]).object.traverse((object) => {
    // Merging parts that have several materials each nests the lists; WebGL wants one material per part.
    if (Array.isArray(object.material)) object.material = object.material.map((entry) => [entry].flat()[0]);
  });
  const small = window.matchMedia("(max-width: 720px)");
  byId("more").open = !small.matches;
  const unsolved = document.querySelector("#badge.unsolved");
  byId("scene").classList.toggle("unsolved", Boolean(unsolved));
  if (unsolved) byId("scene").dataset.words = unsolved.textContent;
  const labels = makeLabels(viewer);
  mark(viewer, labels);
  dress(viewer);
  const camera = makeCamera(viewer);
  const player = makePlayer(viewer, camera);
  const parts = { camera };
  if (story) {
    parts.contacts = makeContacts(viewer, labels);
    parts.controls = makeControls();
    parts.plot = makePlot(player.seek);
    parts.timeline = makeTimeline(player.seek);
    for (const part of [parts.contacts, parts.controls, parts.plot]) player.attach(part);
    player.setTimeline(parts.timeline);
  }
  camera.look(camera.view());
  viewer.set_3d_pane_size();
  player.show();
  // plan.html#t=1.25 shows the moment t = 1.25 s.
  const seekAddress = () => {
    const moment = new URLSearchParams(location.hash.slice(1)).get("t");
    if (!moment || !Number.isFinite(Number(moment))) return false;
    player.seek(Number(moment));
    return true;
  };
  window.addEventListener("hashchange", seekAddress);
  if (!seekAddress() && !window.matchMedia("(prefers-reduced-motion: reduce)").matches) player.play();
  viewer.render();
  window.fesdRobot.firstFrame = performance.now();
  const { seek, time, play, pause, playing } = player;
  return Object.assign(window.fesdRobot, { seek, time, play, pause, playing, viewer, ...parts });
}

window.fesdRobot = { start, end: start + duration };
window.fesdRobot.ready = begin().catch(fail);

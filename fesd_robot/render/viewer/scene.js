// The scene: what Python drew, lights, marks.
const byId = (id) => document.getElementById(id);
const settings = JSON.parse(byId("settings").textContent);
const { start, duration, box, story } = settings;
const center = box[0].map((low, axis) => (low + box[1][axis]) / 2);
const size = Math.hypot(...box[0].map((low, axis) => box[1][axis] - low));

// The robot's x, y, z (z up) in the camera's own axes (y up).
const toCamera = (point) => new MeshCat.THREE.Vector3(point[0], point[2], -point[1]);

function fail(error) {
  byId("problem").textContent = `This page cannot show the motion: ${error.message || error} `
    + "It needs a browser with WebGL and DecompressionStream (Chrome 80, Firefox 113, Safari 16.4 or later).";
  byId("problem").hidden = false;
  throw error;
}

async function commands() {
  const text = atob(byId("scene-data").textContent);
  const packed = Uint8Array.from(text, (character) => character.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const numbers = new DataView(bytes.buffer);
  let at = 0;
  const next = () => { at += 4; return numbers.getUint32(at - 4, true); };
  const pieces = [], parts = [];
  for (let left = next(); left > 0; left--) {
    const length = next();
    pieces.push(bytes.subarray(at, at + length));
    at += length;
  }
  while (at < bytes.length) {
    const own = [];
    for (let left = next(); left > 0; left--) own.push(pieces[next()]);
    parts.push(new Uint8Array(await new Blob(own).arrayBuffer()));
  }
  return parts;
}

// Names of things go and come with their group.
function mark(viewer, labels) {
  for (const one of settings.labels) labels.add({ text: one.text, at: one.at, kind: "mark", group: one.group, rank: 3 });
  if (document.querySelector("[data-group=ghost]")) {
    viewer.scene_tree.find(["ghost"]).object.traverse((object) => {
      object.castShadow = false;
      for (const material of [object.material || []].flat()) {
        Object.assign(material, { transparent: true, opacity: 0.25, depthWrite: false });
      }
    });
  }
  for (const box of document.querySelectorAll("[data-group]")) {
    const group = box.dataset.group;
    const object = viewer.scene_tree.find(group === "ghost" ? ["ghost"] : ["marks", group]).object;
    object.traverse((part) => {
      part.castShadow = false;
      if (part.material && ["contacts", "goal positions"].includes(group)) {
        part.material.depthTest = false; // a place that touches lies inside of the foot
        part.renderOrder = 1;
      }
    });
    const show = () => {
      object.visible = box.checked;
      labels.setGroup(group, box.checked);
      viewer.set_dirty();
    };
    box.addEventListener("change", show);
    show();
  }
}

function dress(viewer) {
  const THREE = MeshCat.THREE;
  for (const name of ["Grid", "Axes", "Lights"]) viewer.delete_path([name]);
  viewer.set_property(["Background"], "top_color", [0.80, 0.86, 0.91]);
  viewer.set_property(["Background"], "bottom_color", [0.97, 0.98, 0.98]);
  viewer.set_object(["Lights", "Sky"], new THREE.HemisphereLight(0xffffff, 0xc9c6c0, 0.72));
  const sun = new THREE.DirectionalLight(0xffffff, 0.34);
  const reach = Math.max(size, 0.1), radius = 0.55 * reach; // the box lies within half its diagonal of its center
  sun.position.set(center[0] - 0.25 * reach, center[1] - 0.45 * reach, center[2] + 1.5 * reach);
  sun.target.position.set(...center);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  sun.shadow.radius = 3;
  sun.shadow.normalBias = 0.002 * reach;
  Object.assign(sun.shadow.camera, { near: 0.1 * reach, far: 4 * reach });
  Object.assign(sun.shadow.camera, { left: -radius, right: radius, top: radius, bottom: -radius });
  viewer.set_object(["Lights", "Sun"], sun);
  viewer.scene_tree.find(["Lights"]).object.add(sun.target);
  const fill = new THREE.DirectionalLight(0xffffff, 0.16);
  fill.position.set(center[0] + reach, center[1] - reach, center[2] + 0.4 * reach);
  viewer.set_object(["Lights", "Fill"], fill);
  for (const name of ["ground", "walls", "traces"]) {
    viewer.scene_tree.find([name]).object.traverse((object) => { object.castShadow = false; });
  }
}

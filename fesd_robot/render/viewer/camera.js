// The camera: orthographic from the side, the front and above, where lengths are true everywhere; free in perspective.
const FIELD_OF_VIEW = 28; // deg
const VIEWS = { side: [0, -1, 0], front: [1, 0, 0], top: [0, -1e-4, 1], free: [0.5, -1, 0.36] };
const MARGIN = { top: 26, bottom: 46, side: 36 }; // pixels around what is shown, for labels
const ROOM = [1.4, 1.2, 1.12]; // of what is shown around a robot that is followed, over its size
const TRAVEL = 1.5; // the camera follows at first if the motion is this many times longer than the robot
const LOWEST = Math.PI / 2 - 0.03; // rad from the vertical; the free camera stays above the ground

function makeCamera(viewer) {
  const THREE = MeshCat.THREE, pane = byId("scene"), path = settings.follow;
  const flat = new THREE.OrthographicCamera(-1, 1, 1, -1, 0.01, 100);
  const deep = new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 100);
  let view = settings.planar ? "side" : "free", now = 0;
  let following = Boolean(path) && box[1][0] - box[0][0] > TRAVEL * path.size[0];
  let aim = null;
  byId("follow").checked = following;
  byId("follow").disabled = !path;

  function aimAt(time) {
    if (!following) return center;
    const k = before(path.time, time);
    const next = Math.min(k + 1, path.time.length - 1), span = path.time[next] - path.time[k];
    const w = span > 0 ? Math.min(Math.max((time - path.time[k]) / span, 0), 1) : 0;
    return path.center[k].map((value, axis) => (1 - w) * value + w * path.center[next][axis]);
  }

  function fit() {
    const width = Math.max(pane.clientWidth, 1), height = Math.max(pane.clientHeight, 1);
    const extent = following ? path.size.map((length, axis) => length * ROOM[axis]) : box[0].map((low, axis) => Math.max(box[1][axis] - low, 1e-3));
    const direction = toCamera(VIEWS[view]).normalize();
    const camera = view === "free" ? deep : flat;
    const reach = Math.max(Math.hypot(...extent), 0.05);
    const point = aimAt(now);
    aim = toCamera(point);
    const target = aim.clone();
    let distance = 4 * Math.max(reach, size);
    if (camera === flat) {
      const across = view === "front" ? extent[1] : extent[0], up = view === "top" ? extent[1] : extent[2];
      const free = [Math.max(width - 2 * MARGIN.side, 40), Math.max(height - MARGIN.top - MARGIN.bottom, 40)];
      const pixel = Math.max(across / free[0], up / free[1], 1e-6); // m
      Object.assign(flat, { left: -width * pixel / 2, right: width * pixel / 2, top: height * pixel / 2, bottom: -height * pixel / 2 });
      flat.zoom = 1;
      const shift = pixel * (MARGIN.bottom - MARGIN.top) / 2;
      target.add(view === "top" ? new THREE.Vector3(0, 0, shift) : new THREE.Vector3(0, -shift, 0));
    } else {
      const narrow = Math.tan(FIELD_OF_VIEW * Math.PI / 360) * Math.min(1, width / height);
      distance = Math.max(0.56 * reach / narrow, 0.05);
      deep.aspect = width / height;
    }
    Object.assign(camera, { near: distance / 200, far: distance * 40 });
    camera.position.copy(target).addScaledVector(direction, distance);
    if (viewer.camera !== camera) {
      viewer.controls.dispose();
      viewer.set_camera(camera);
    }
    Object.assign(viewer.controls, { enableRotate: view === "free", maxPolarAngle: view === "free" ? LOWEST : Math.PI });
    viewer.controls.target.copy(target);
    camera.updateProjectionMatrix();
    viewer.controls.update();
    viewer.set_dirty();
  }

  function resize() {
    viewer.renderer.setSize(pane.clientWidth, pane.clientHeight);
    fit();
  }
  // Meshcat would fill the whole window.
  viewer.set_3d_pane_size = resize;
  new ResizeObserver(resize).observe(pane);

  return {
    // Moves with the robot, and keeps what the reader did with the mouse.
    show(time) {
      now = time;
      if (!following || !aim) return;
      const next = toCamera(aimAt(time)), step = next.clone().sub(aim);
      aim = next;
      viewer.camera.position.add(step);
      viewer.controls.target.add(step);
      viewer.set_dirty();
    },
    look(name) {
      view = name;
      byId("view").value = name;
      fit();
    },
    follow(value) {
      following = value && Boolean(path);
      byId("follow").checked = following;
      fit();
    },
    following: () => following,
    view: () => view,
    fit,
  };
}

// The index of the last time that is not after a moment, or 0.
function before(times, moment) {
  let low = 0, high = times.length;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= moment) low = middle; else high = middle;
  }
  return low;
}

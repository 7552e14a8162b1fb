"use strict";
(() => {
  const byId = (id) => document.getElementById(id);
  const settings = JSON.parse(byId("settings").textContent);
  const { start, duration, box } = settings;
  const FIELD_OF_VIEW = 28; // deg; narrow, so that distances along the path stay comparable
  const ELEVATION = 9 * Math.PI / 180; // the camera looks down on the ground a little
  const STEP = 1 / 50; // s of motion per press of an arrow key
  const ICONS = { play: "M3 1.5v13l11-6.5z", pause: "M3 1.5h3.5v13H3zM9.5 1.5H13v13H9.5z" };

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

  const labels = []; // sprites that keep their size on the screen

  // The robot's x, y, z (z up) in the camera's own axes (y up).
  const toCamera = (point) => new MeshCat.THREE.Vector3(point[0], point[2], -point[1]);
  const center = box[0].map((low, axis) => (low + box[1][axis]) / 2);
  const size = Math.hypot(...box[0].map((low, axis) => box[1][axis] - low));

  // A label that always faces the camera and stands on its point.
  function label(text, at, width) {
    const THREE = MeshCat.THREE;
    const canvas = document.createElement("canvas");
    const pen = canvas.getContext("2d");
    const font = "44px system-ui, sans-serif";
    pen.font = font;
    Object.assign(canvas, { width: width || Math.ceil(pen.measureText(text).width) + 16, height: 64 });
    Object.assign(pen, { font, textAlign: "center", textBaseline: "middle", fillStyle: "#4a535d" });
    pen.fillText(text, canvas.width / 2, 34);
    const material = new THREE.SpriteMaterial({ map: new THREE.CanvasTexture(canvas), depthWrite: false });
    const sprite = new THREE.Sprite(material);
    sprite.center.set(0.5, 0);
    sprite.position.set(...at);
    sprite.userData.ratio = canvas.width / canvas.height;
    labels.push(sprite);
    return sprite;
  }

  // Names of things are seen through the robot, and go and come with their group.
  function mark(viewer) {
    for (const one of settings.labels) {
      const sprite = label(one.text, one.at);
      sprite.material.depthTest = false;
      sprite.renderOrder = 1;
      sprite.name = one.text;
      viewer.scene_tree.find(["marks", one.group]).object.add(sprite);
    }
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
      const show = () => { object.visible = box.checked; viewer.set_dirty(); };
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
    for (const tick of settings.ticks) viewer.scene_tree.find(["ticks"]).object.add(label(tick.text, tick.at, 256));
    for (const name of ["ground", "walls", "traces"]) {
      viewer.scene_tree.find([name]).object.traverse((object) => { object.castShadow = false; });
    }
  }

  // Looks along +y at the whole box, clear of the caption above and the bar below.
  function sideView(viewer) {
    const height = window.innerHeight, width = window.innerWidth;
    const top = Math.min(byId("caption").offsetHeight + 28, 0.3 * height);
    const bottom = Math.min(byId("bar").offsetHeight + 40, 0.3 * height);
    const tall = Math.tan(FIELD_OF_VIEW * Math.PI / 360);
    const wide = 0.92 * tall * width / height;
    const used = (height - top - bottom) / height;
    let distance = 0;
    for (let corner = 0; corner < 8; corner++) {
      const [x, y, z] = [0, 1, 2].map((axis) => box[(corner >> axis) & 1][axis] - center[axis]);
      const nearer = -(y * Math.cos(ELEVATION)) + z * Math.sin(ELEVATION);
      const up = z * Math.cos(ELEVATION) + y * Math.sin(ELEVATION);
      distance = Math.max(distance, nearer + Math.abs(x) / wide, nearer + Math.abs(up) / (tall * used));
    }
    distance = Math.max(distance, 0.05);
    const camera = viewer.camera;
    Object.assign(camera, { fov: FIELD_OF_VIEW, near: distance / 100, far: distance * 30 });
    const shift = distance * tall * (top - bottom) / height; // m that the middle of the box moves down on the screen
    const target = toCamera([center[0], center[1] + shift * Math.sin(ELEVATION), center[2] + shift * Math.cos(ELEVATION)]);
    viewer.controls.target.copy(target);
    const offset = toCamera([0, -Math.cos(ELEVATION) * distance, Math.sin(ELEVATION) * distance]);
    camera.position.copy(target.add(offset));
    camera.updateProjectionMatrix();
    const pixel = 2 * distance * tall / height;
    for (const sprite of labels) sprite.scale.set(22 * sprite.userData.ratio * pixel, 22 * pixel, 1);
    viewer.controls.update();
    viewer.set_dirty();
  }

  function player(viewer) {
    const slider = byId("slider"), readout = byId("readout"), icon = byId("play-icon");
    const digits = duration < 0.1 ? 4 : 3;
    let now = 0, playing = false, last = null;
    slider.max = String(duration);
    slider.disabled = duration === 0;
    byId("play").disabled = duration === 0;
    // The mixer must be active to follow the clock of this page, and paused to have none of its own.
    viewer.animator.play();
    viewer.animator.pause();

    function show(time) {
      now = Math.min(Math.max(time, 0), duration);
      viewer.animator.seek(now);
      slider.value = String(now);
      readout.textContent = `${(start + now).toFixed(digits)} / ${(start + duration).toFixed(digits)} s`;
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

    byId("play").addEventListener("click", () => setPlaying(!playing));
    slider.addEventListener("input", () => seek(start + Number(slider.value)));
    byId("view").addEventListener("click", () => sideView(viewer));
    window.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
      const step = STEP * (event.shiftKey ? 10 : 1);
      if (event.code === "Space") setPlaying(!playing);
      else if (event.code === "ArrowRight") seek(start + now + step);
      else if (event.code === "ArrowLeft") seek(start + now - step);
      else if (event.code === "Home") sideView(viewer);
      else return;
      event.preventDefault();
    });
    window.addEventListener("keyup", (event) => { if (event.code === "Space") event.preventDefault(); });

    show(0);
    return {
      seek,
      time: () => start + now,
      play: () => setPlaying(true),
      pause: () => setPlaying(false),
      playing: () => playing,
    };
  }

  async function begin() {
    const viewer = new MeshCat.Viewer(byId("scene"));
    for (const command of await commands()) viewer.handle_command_bytearray(command);
    viewer.scene_tree.find(["robot"]).object.traverse((object) => {
      // Merging parts that have several materials each nests the lists; WebGL wants one material per part.
      if (Array.isArray(object.material)) object.material = object.material.map((entry) => [entry].flat()[0]);
    });
    mark(viewer);
    dress(viewer);
    viewer.set_3d_pane_size();
    let touched = false;
    viewer.controls.addEventListener("start", () => { touched = true; });
    byId("view").addEventListener("click", () => { touched = false; });
    sideView(viewer);
    window.addEventListener("resize", () => { if (!touched) sideView(viewer); });
    const controls = player(viewer);
    // plan.html#t=1.25 shows the moment t = 1.25 s.
    const seekAddress = () => {
      const moment = new URLSearchParams(location.hash.slice(1)).get("t");
      if (!moment || !Number.isFinite(Number(moment))) return false;
      controls.seek(Number(moment));
      return true;
    };
    window.addEventListener("hashchange", seekAddress);
    if (!seekAddress() && !window.matchMedia("(prefers-reduced-motion: reduce)").matches) controls.play();
    return Object.assign(window.fesdRobot, controls, { viewer });
  }

  window.fesdRobot = { start, end: start + duration };
  window.fesdRobot.ready = begin().catch(fail);
})();

// What the contacts do: where feet are and in which mode, forces with their friction cones, impulses as flashes.
const FLASH = 0.18; // s of motion for which an impulse stays on the screen
const ARROW = 0.4, IMPULSE = 0.3, CONE = 0.15, FOOT = 0.012, THICK = 0.006; // over the size of the robot

function makeContacts(viewer, labels) {
  const THREE = MeshCat.THREE, unit = settings.size, times = story.time;
  const scene = viewer.scene_tree.find(["contacts"]).object;
  const largest = (vectors) => Math.max(1e-9, ...vectors.map((vector) => Math.hypot(...vector)));
  const forceScale = ARROW * unit / largest(story.feet.flatMap((foot) => foot.force));
  const impulseScale = IMPULSE * unit / largest(story.feet.flatMap((foot) => foot.impulses.map((one) => one.vector)));
  // Arrows lie over the robot, which would hide them.
  const paint = (color, opacity = 1) => new THREE.MeshBasicMaterial(
    { color, opacity, transparent: true, depthTest: false, side: THREE.DoubleSide });

  function arrow(color, order) {
    const group = new THREE.Group(), material = paint(color);
    const shaft = new THREE.Mesh(new THREE.CylinderGeometry(1, 1, 1, 12).translate(0, 0.5, 0), material);
    const head = new THREE.Mesh(new THREE.ConeGeometry(1, 1, 16).translate(0, 0.5, 0), material);
    // A white rim keeps the arrow readable on a dark body.
    const rim = new THREE.Mesh(shaft.geometry, paint("#ffffff")), headRim = new THREE.Mesh(head.geometry, rim.material);
    group.add(shaft, head, rim, headRim);
    for (const part of [shaft, head]) part.renderOrder = order;
    for (const part of [rim, headRim]) part.renderOrder = order - 0.5;
    scene.add(group);
    return {
      group, material,
      point(vector, scale) {
        const length = Math.hypot(...vector) * scale;
        group.visible = length > 0.015 * unit;
        if (!group.visible) return length;
        const thick = THICK * unit, tip = Math.min(6 * thick, 0.6 * length);
        shaft.scale.set(thick, length - tip, thick);
        head.scale.set(0.5 * tip, tip, 0.5 * tip);
        head.position.set(0, length - tip, 0);
        rim.scale.set(1.7 * thick, length - tip, 1.7 * thick);
        headRim.scale.set(0.7 * tip, 1.35 * tip, 0.7 * tip);
        headRim.position.set(0, length - 1.13 * tip, 0);
        rim.material.opacity = material.opacity;
        group.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), new THREE.Vector3(...vector).normalize());
        return length;
      },
    };
  }

  function cone(friction, color) {
    const half = Math.atan(friction), reach = CONE * unit;
    const side = [Math.sin(half) * reach, Math.cos(half) * reach];
    const shape = new THREE.Shape([new THREE.Vector2(0, 0), new THREE.Vector2(...side), new THREE.Vector2(-side[0], side[1])]);
    const mesh = new THREE.Mesh(new THREE.ShapeGeometry(shape), paint(color, 0.22));
    mesh.renderOrder = 8;
    scene.add(mesh);
    return mesh;
  }

  const feet = story.feet.map((foot) => {
    const dot = new THREE.Mesh(new THREE.SphereGeometry(FOOT * unit, 16, 12), paint(settings.modes.flight));
    const ring = new THREE.Mesh(new THREE.RingGeometry(0.75, 1, 40), paint(settings.modes.impact));
    ring.rotation.x = Math.PI / 2; // into the x-z plane
    dot.renderOrder = 11;
    ring.renderOrder = 12;
    scene.add(dot, ring);
    return {
      ...foot, dot, ring,
      spans: story.rows.find((row) => row.name === foot.contact).spans,
      cone: foot.friction > 0 ? cone(foot.friction, settings.colors.cone) : null,
      arrow: arrow(settings.colors.force, 9),
      impulse: arrow(settings.modes.impact, 10),
      forceLabel: labels.add({ text: "", at: [0, 0, 0], kind: "force", rank: 1 }),
      impulseLabel: labels.add({ text: "", at: [0, 0, 0], kind: "impulse", rank: 0 }),
    };
  });

  function state(foot, moment) {
    const k = before(times, moment), next = Math.min(k + 1, times.length - 1);
    const span = times[next] - times[k], w = span > 0 ? Math.min(Math.max((moment - times[k]) / span, 0), 1) : 0;
    const between = (rows) => rows[k].map((value, axis) => (1 - w) * value + w * rows[next][axis]);
    const mode = (foot.spans[before(foot.spans.map((one) => one[1]), moment)] || ["flight"])[0];
    return {
      mode,
      place: between(foot.place),
      force: mode === "flight" ? [0, 0, 0] : between(foot.force),
      normal: foot.normal.length === 1 ? foot.normal[0] : between(foot.normal),
    };
  }

  function show(moment) {
    for (const foot of feet) {
      const { mode, place, force, normal } = state(foot, moment);
      foot.dot.position.set(...place);
      foot.dot.material.color.set(settings.modes[mode]);
      foot.arrow.group.position.set(...place);
      const length = foot.arrow.point(force, forceScale);
      foot.forceLabel.shown = foot.arrow.group.visible;
      if (foot.forceLabel.shown) tip(foot.forceLabel, place, force, length, "N");
      if (foot.cone) {
        foot.cone.visible = mode !== "flight";
        foot.cone.position.set(...place);
        const up = new THREE.Vector3(...normal), along = new THREE.Vector3(normal[2], 0, -normal[0]);
        foot.cone.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(along, up, along.clone().cross(up)));
      }
      const hit = foot.impulses.filter((one) => moment >= one.time - 1e-9 && moment < one.time + FLASH).pop();
      foot.ring.visible = foot.impulseLabel.shown = foot.impulse.group.visible = Boolean(hit);
      if (!hit) continue;
      const fade = 1 - (moment - hit.time) / FLASH, reach = unit * (0.03 + 0.09 * (1 - fade));
      foot.ring.position.set(...place);
      foot.ring.scale.set(reach, reach, reach);
      foot.ring.material.opacity = foot.impulse.material.opacity = fade;
      foot.impulse.group.position.set(...place);
      const reached = foot.impulse.point(hit.vector, impulseScale);
      tip(foot.impulseLabel, place, hit.vector, reached, "N s");
    }
    viewer.set_dirty();
  }

  function tip(label, place, vector, length, name) {
    const norm = Math.hypot(...vector);
    label.at = place.map((value, axis) => value + vector[axis] / norm * length);
    label.write(`${Number(norm.toPrecision(3))} ${name}`);
  }

  return { show, states: (moment) => feet.map((foot) => ({ name: foot.name, contact: foot.contact, ...state(foot, moment) })) };
}

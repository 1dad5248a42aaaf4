// The dancers on the floor, drawn from the farthest bone to the nearest.

const sceneCanvas = document.getElementById("scene");
const scene = sceneCanvas.getContext("2d");

/** Colours of the page's theme, read once a change. */
let colours = {};
function readColours() {
  const style = getComputedStyle(document.documentElement);
  const names = ["page", "ink", "muted", "grid", "grid-strong", "shadow", "target", "contact", "line", "keyframe", "keyframe-edge"];
  for (const hue of ["recorded", "model", "other1", "other2", "other3"]) names.push(hue, `${hue}-edge`);
  colours = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  colours.dark = document.documentElement.dataset.theme === "dark";
}

/** A line's colour on the page: fills are too pale for thin lines on a light one. */
const lineColour = (hue) => (colours.dark ? colours[hue] : colours[`${hue}-edge`]);

/** Thickness of the bone that ends at a joint, cm. */
const thickness = data.thickness;
const HEAD_RADIUS = 9.5;
/** How much of a dancer over another is seen. */
const OVERLAID = 0.7;

/** Cells of the canvas for dancers side by side, as large as they can be. */
function cells(count, width, height) {
  let best = null;
  for (let columns = 1; columns <= count; columns++) {
    const rows = Math.ceil(count / columns);
    const size = Math.min(width / columns, (0.85 * height) / rows);
    if (!best || size > best.size) best = { size, columns, rows };
  }
  return Array.from({ length: count }, (_, index) => ({
    x: ((index % best.columns) * width) / best.columns,
    y: (Math.floor(index / best.columns) * height) / best.rows,
    width: width / best.columns,
    height: height / best.rows,
  }));
}

function drawFloor(view) {
  const step = 50;
  const from = (value) => Math.floor((value - 140) / step) * step;
  const to = (value) => Math.ceil((value + 140) / step) * step;
  const [west, east, north, south] = [from(bounds.x[0]), to(bounds.x[1]), from(bounds.z[0]), to(bounds.z[1])];
  const stroke = (strong) => {
    scene.strokeStyle = colours[strong ? "grid-strong" : "grid"];
    scene.beginPath();
    const line = (a, b) => {
      const seen = view.segment(a, b);
      if (seen) {
        scene.moveTo(seen[0][0], seen[0][1]);
        scene.lineTo(seen[1][0], seen[1][1]);
      }
    };
    for (let x = west; x <= east; x += step) if ((x % 100 === 0) === strong) line([x, floor, north], [x, floor, south]);
    for (let z = north; z <= south; z += step) if ((z % 100 === 0) === strong) line([west, floor, z], [east, floor, z]);
    scene.stroke();
  };
  scene.lineWidth = 1;
  stroke(false);
  stroke(true);
}

/** A path on the floor: faint as a whole, strong up to the present. */
function drawPath(view, places, frame, colour, dash) {
  const onFloor = (place) => [place[0], floor + 0.5, place[2]];
  const line = (last) => {
    scene.beginPath();
    let [x, y] = [];
    for (let index = 1; index <= last; index++) {
      const seen = view.segment(onFloor(places[index - 1]), onFloor(places[index]));
      if (!seen) continue;
      const [from, to] = seen;
      // Only where the line before ends elsewhere: dashes begin anew at each start.
      if (from[0] !== x || from[1] !== y) scene.moveTo(from[0], from[1]);
      scene.lineTo(to[0], to[1]);
      [x, y] = to;
    }
    scene.stroke();
  };
  scene.save();
  scene.strokeStyle = colour;
  scene.lineJoin = scene.lineCap = "round";
  scene.setLineDash(dash);
  scene.lineWidth = 1.6;
  scene.globalAlpha = 0.4;
  line(places.length - 1);
  scene.globalAlpha = 1;
  scene.lineWidth = 2.6;
  line(Math.floor(frame));
  scene.restore();
}

/** A disc on the floor. */
function disc(view, x, z, radius, fill, edge) {
  scene.beginPath();
  for (let side = 0; side <= 24; side++) {
    const angle = (side / 24) * 2 * Math.PI;
    const [px, py, depth] = view.project(x + radius * Math.cos(angle), floor + 0.5, z + radius * Math.sin(angle));
    if (depth < 10) return;
    if (side) scene.lineTo(px, py);
    else scene.moveTo(px, py);
  }
  if (fill) {
    scene.fillStyle = fill;
    scene.fill();
  }
  if (edge) {
    scene.strokeStyle = edge;
    scene.lineWidth = 2;
    scene.stroke();
  }
}

function drawShadow(view, pose) {
  const [, , depth] = view.project(pose[0], floor, pose[2]);
  scene.save();
  scene.strokeStyle = colours.shadow;
  scene.lineWidth = Math.max(7 * view.scale(depth), 1);
  scene.lineCap = scene.lineJoin = "round";
  scene.beginPath();
  data.parents.forEach((parent, joint) => {
    if (parent < 0) return;
    const seen = view.segment([pose[3 * parent], floor, pose[3 * parent + 2]], [pose[3 * joint], floor, pose[3 * joint + 2]]);
    if (seen) {
      scene.moveTo(seen[0][0], seen[0][1]);
      scene.lineTo(seen[1][0], seen[1][1]);
    }
  });
  scene.stroke();
  scene.restore();
}

function drawContacts(view, motion, pose, frame) {
  const labels = motion.contacts[Math.round(frame)];
  data.feet.forEach((joint, foot) => {
    if (labels & (1 << foot)) disc(view, pose[3 * joint], pose[3 * joint + 2], 6.5, null, colours.contact);
  });
}

/** Adds a dancer's bones and head to what will be drawn. */
function addBones(view, pose, hue, ghost, parts) {
  const at = (joint) => view.project(pose[3 * joint], pose[3 * joint + 1], pose[3 * joint + 2]);
  data.parents.forEach((parent, joint) => {
    if (parent < 0) return;
    const [a, b] = [at(parent), at(joint)];
    const depth = (a[2] + b[2]) / 2;
    if (Math.min(a[2], b[2]) < 10) return;
    parts.push({ a, b, depth, width: Math.max(thickness[joint] * view.scale(depth), 1.5), hue, ghost });
  });
  if (data.head === null) return;
  const [neck, head] = [data.parents[data.head], data.head].map((joint) => [0, 1, 2].map((axis) => pose[3 * joint + axis]));
  const length = Math.hypot(...head.map((value, axis) => value - neck[axis])) || 1;
  const centre = head.map((value, axis) => value + ((value - neck[axis]) / length) * 6);
  const seen = view.project(...centre);
  if (seen[2] > 10) parts.push({ a: seen, depth: seen[2], radius: HEAD_RADIUS * view.scale(seen[2]), hue, ghost });
}

function drawParts(parts, alpha = 1) {
  parts.sort((one, other) => other.depth - one.depth);
  scene.save();
  scene.lineCap = "round";
  for (const { a, b, width, radius, hue, ghost } of parts) {
    const [fill, edge] = [colours[hue], colours[`${hue}-edge`]];
    scene.globalAlpha = ghost ? 0.22 : alpha;
    if (radius) {
      scene.beginPath();
      scene.arc(a[0], a[1], radius, 0, 2 * Math.PI);
      scene.fillStyle = fill;
      scene.fill();
      if (!ghost) {
        scene.strokeStyle = edge;
        scene.lineWidth = 1;
        scene.stroke();
        scene.globalAlpha = 0.3 * alpha;
        scene.beginPath();
        scene.arc(a[0] - 0.3 * radius, a[1] - 0.35 * radius, 0.4 * radius, 0, 2 * Math.PI);
        scene.fillStyle = "#fff";
        scene.fill();
      }
      continue;
    }
    const bone = (colour, thick, shift) => {
      scene.strokeStyle = colour;
      scene.lineWidth = thick;
      scene.beginPath();
      scene.moveTo(a[0] - shift, a[1] - shift);
      scene.lineTo(b[0] - shift, b[1] - shift);
      scene.stroke();
    };
    if (ghost) {
      bone(fill, width * 0.6, 0);
    } else {
      bone(edge, width + 2, 0);
      bone(fill, width, 0);
      scene.globalAlpha = 0.28 * alpha;
      bone("#fff", width * 0.28, width * 0.16);
    }
  }
  scene.restore();
}

/** Draws the shown motions at a time; `look` says how they are arranged and which marks are shown. */
function drawScene(frame, look) {
  const ratio = devicePixelRatio || 1;
  const [width, height] = [sceneCanvas.clientWidth, sceneCanvas.clientHeight];
  if (sceneCanvas.width !== Math.round(width * ratio) || sceneCanvas.height !== Math.round(height * ratio)) {
    sceneCanvas.width = Math.round(width * ratio);
    sceneCanvas.height = Math.round(height * ratio);
  }
  scene.setTransform(ratio, 0, 0, ratio, 0, 0);
  scene.fillStyle = colours.page;
  scene.fillRect(0, 0, width, height);
  const shown = motions.filter((motion) => motion.shown);
  const side = look.arrangement === "side" && shown.length > 1;
  const groups = side ? shown.map((motion) => [motion]) : [shown];
  const places = side ? cells(shown.length, width, height) : [{ x: 0, y: 0, width, height }];
  let view;
  groups.forEach((group, index) => {
    const cell = places[index];
    view = projection(cell, group[0], frame);
    scene.save();
    scene.beginPath();
    scene.rect(cell.x, cell.y, cell.width, cell.height);
    scene.clip();
    drawFloor(view);
    const poses = group.map((motion) => poseAt(motion, frame, new Float32Array(JOINTS * 3)));
    poses.forEach((pose) => drawShadow(view, pose));
    if (look.paths) {
      group.forEach((motion) => drawPath(view, motion.root, frame, lineColour(motion.hue), []));
      if (data.trajectory.length) drawPath(view, data.trajectory, frame, colours.target, [5, 5]);
    }
    const parts = [];
    if (look.keyframes) {
      for (const keyframe of keyframes) {
        if (Math.abs(keyframe.frame - frame) >= 0.5) addBones(view, keyframe.positions, "keyframe", true, parts);
      }
      drawParts(parts.splice(0));
    }
    group.forEach((motion, dancer) => {
      if (look.contacts) drawContacts(view, motion, poses[dancer], frame);
      addBones(view, poses[dancer], isKeyframe(frame) ? "keyframe" : motion.hue, false, parts);
    });
    drawParts(parts, group.length > 1 ? OVERLAID : 1);
    scene.restore();
    if (side) drawLabel(cell, group[0], index);
  });
  return view ? view.perPixel : 1;
}

function drawLabel(cell, motion, index) {
  scene.font = "600 13px system-ui, sans-serif";
  scene.textBaseline = "top";
  scene.fillStyle = colours.ink;
  scene.fillText(motion.name, cell.x + 16, cell.y + 10, cell.width - 24);
  scene.fillStyle = lineColour(motion.hue);
  scene.fillRect(cell.x + 16, cell.y + 28, 22, 3);
  if (index && cell.x > 0) {
    scene.fillStyle = colours.line;
    scene.fillRect(cell.x, cell.y + 10, 1, cell.height - 20);
  }
}

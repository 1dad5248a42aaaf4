// The camera: it looks at a target from a distance that shows the whole motion, or the dancer alone where it follows.

const BODY = 108; // half of what a dancer takes up in height, cm
const EYE_LEVEL = 93; // height of the target above the floor, cm
const WIDE = 260; // half a path's width above which the camera follows the dancer, cm
const FOCAL = 1.7; // focal length in heights of the view

const camera = {
  yaw: 0.55,
  pitch: 0.16,
  zoom: 1,
  offset: [0, 0, 0],
  follow: Math.max(bounds.x[1] - bounds.x[0], bounds.z[1] - bounds.z[0]) / 2 > WIDE,
};

function resetCamera() {
  Object.assign(camera, { yaw: 0.55, pitch: 0.16, zoom: 1, offset: [0, 0, 0] });
}

/** The path that a following camera takes: the first shown dancer's, without its small movements. */
const steadied = new Map();
function steadyPath(motion) {
  if (!steadied.has(motion)) {
    const sigma = 12;
    const path = motion.root.map((_, frame) => {
      let [x, z, sum] = [0, 0, 0];
      for (let tap = -3 * sigma; tap <= 3 * sigma; tap++) {
        const weight = Math.exp(-0.5 * (tap / sigma) ** 2);
        const place = motion.root[Math.min(Math.max(frame + tap, 0), LAST)];
        x += weight * place[0];
        z += weight * place[2];
        sum += weight;
      }
      return [x / sum, z / sum];
    });
    steadied.set(motion, path);
  }
  return steadied.get(motion);
}

function cameraTarget(motion, frame) {
  let [x, z] = [(bounds.x[0] + bounds.x[1]) / 2, (bounds.z[0] + bounds.z[1]) / 2];
  if (camera.follow && motion) {
    const path = steadyPath(motion);
    const [from, to] = [path[Math.floor(frame)], path[Math.min(Math.floor(frame) + 1, LAST)]];
    const share = frame - Math.floor(frame);
    [x, z] = [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])];
  }
  return [x + camera.offset[0], floor + EYE_LEVEL + camera.offset[1], z + camera.offset[2]];
}

/** Projection into a cell of the canvas: `project(x, y, z)` gives `[right, down, depth]` in px and cm. */
function projection(cell, motion, frame) {
  const target = cameraTarget(motion, frame);
  const [sinYaw, cosYaw, sinPitch, cosPitch] = [Math.sin(camera.yaw), Math.cos(camera.yaw), Math.sin(camera.pitch), Math.cos(camera.pitch)];
  const size = Math.min(cell.width, cell.height);
  const focal = FOCAL * size;
  const across = camera.follow ? 90 : 70 + Math.hypot(bounds.x[1] - bounds.x[0], bounds.z[1] - bounds.z[0]) / 2;
  const upright = BODY + across * 0.5 * Math.abs(sinPitch);
  const fit = Math.max(upright * size / cell.height, across * size / cell.width);
  const distance = (FOCAL * fit * 2 + across * 0.4) / camera.zoom;
  const [centreX, centreY] = [cell.x + cell.width / 2, cell.y + cell.height / 2];
  const turned = (x, y, z) => {
    const [dx, dy, dz] = [x - target[0], y - target[1], z - target[2]];
    const near = sinYaw * dx + cosYaw * dz;
    return [cosYaw * dx - sinYaw * dz, cosPitch * dy - sinPitch * near, distance - sinPitch * dy - cosPitch * near];
  };
  const onScreen = ([right, up, depth]) => [centreX + (focal * right) / depth, centreY - (focal * up) / depth, depth];
  const NEAR = 10;
  return {
    project: (x, y, z) => onScreen(turned(x, y, z)),
    /** The part of a straight line that lies before the camera, or null. */
    segment(from, to) {
      let [a, b] = [turned(...from), turned(...to)];
      if (a[2] < NEAR && b[2] < NEAR) return null;
      const cut = (behind, before) => {
        const share = (NEAR - behind[2]) / (before[2] - behind[2]);
        return behind.map((value, axis) => value + share * (before[axis] - value));
      };
      if (a[2] < NEAR) a = cut(a, b);
      if (b[2] < NEAR) b = cut(b, a);
      return [onScreen(a), onScreen(b)];
    },
    /** Pixels of a centimetre at a depth. */
    scale: (depth) => focal / Math.max(depth, NEAR),
    perPixel: distance / focal,
  };
}

/** Moves the target so that the scene follows a pointer that moved by this many pixels. */
function pan(right, down, perPixel) {
  const [sinYaw, cosYaw, sinPitch, cosPitch] = [Math.sin(camera.yaw), Math.cos(camera.yaw), Math.sin(camera.pitch), Math.cos(camera.pitch)];
  const [across, up] = [-right * perPixel, down * perPixel];
  camera.offset[0] += cosYaw * across - sinYaw * sinPitch * up;
  camera.offset[1] += cosPitch * up;
  camera.offset[2] += -sinYaw * across - cosYaw * sinPitch * up;
}

function orbit(yaw, pitch) {
  camera.yaw += yaw;
  camera.pitch = Math.min(Math.max(camera.pitch + pitch, -0.1), 1.5);
}

function zoom(factor) {
  camera.zoom = Math.min(Math.max(camera.zoom * factor, 0.15), 12);
}

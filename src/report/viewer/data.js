// What the page was given: motions as arrays of world positions, cm, Y up.

const data = JSON.parse(document.getElementById("motion-data").textContent);
const JOINTS = data.parents.length;
const LAST = data.frames - 1;

/** Positions `[frames * joints * 3]` from 16-bit steps. */
function decode({ origin, step, steps }) {
  const bytes = Uint8Array.from(atob(steps), (character) => character.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  const positions = new Float32Array(bytes.length / 2);
  for (let i = 0; i < positions.length; i++) {
    positions[i] = origin[i % 3] + step * view.getInt16(2 * i, true);
  }
  return positions;
}

const others = data.motions.filter((motion) => motion.kind === "other");
const motions = data.motions.map((motion) => ({
  ...motion,
  positions: decode(motion.positions),
  hue: motion.kind === "other" ? `other${1 + (others.indexOf(motion) % 3)}` : motion.kind,
  shown: true,
}));
const keyframes = data.keyframes.map((keyframe) => ({ ...keyframe, positions: decode(keyframe.positions) }));
const isKeyframe = (frame) => keyframes.some((keyframe) => Math.abs(keyframe.frame - frame) < 0.5);

/** Joint positions of a motion at a time between frames, `[joints * 3]`, into `out`. */
function poseAt(motion, frame, out) {
  const before = Math.floor(frame);
  const share = frame - before;
  const from = before * JOINTS * 3;
  const to = Math.min(before + 1, LAST) * JOINTS * 3;
  for (let i = 0; i < JOINTS * 3; i++) {
    out[i] = motion.positions[from + i] * (1 - share) + motion.positions[to + i] * share;
  }
  return out;
}

/** The root's places of a motion, `[[x, y, z]]`. */
const rootPath = (motion) => Array.from({ length: data.frames }, (_, frame) => Array.from(motion.positions.subarray(frame * JOINTS * 3, frame * JOINTS * 3 + 3)));
motions.forEach((motion) => (motion.root = rootPath(motion)));

/** The floor: where the lowest foot of the first motion stands. */
const floor = (() => {
  const heights = [];
  const lowest = data.feet.length ? data.feet : data.parents.map((_, joint) => joint);
  for (let frame = 0; frame < data.frames; frame++) {
    heights.push(Math.min(...lowest.map((joint) => motions[0].positions[(frame * JOINTS + joint) * 3 + 1])));
  }
  heights.sort((a, b) => a - b);
  return heights[Math.floor(heights.length * 0.05)];
})();

/** Box around all roots and the target trajectory: the ends of its axes on the floor. */
const bounds = (() => {
  const places = motions.flatMap((motion) => motion.root).concat(data.trajectory);
  const span = (axis) => places.reduce(([low, high], place) => [Math.min(low, place[axis]), Math.max(high, place[axis])], [Infinity, -Infinity]);
  return { x: span(0), z: span(2) };
})();

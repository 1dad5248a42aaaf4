// BVH files that are dropped on the page, or opened from it: the page begins again with them.

/** The page as it came, before anything on it changed. */
const page = document.documentElement.outerHTML;

/** Joints (name, parent, offset, channels), seconds a frame and rows of numbers of a BVH file. */
function parseBvh(text) {
  // Behind an end-of-file mark, or where a file is filled up with zeros, is nothing.
  const whole = text.split(/[\x1a\0]/)[0];
  const words = whole.replace(/(frames|time)\s*:/gi, "$1: ").split(/\s+/).filter(Boolean);
  const joints = [];
  const open = [];
  let at = 0;
  const next = () => words[at++];
  const number = () => {
    const word = next();
    if (word === undefined) throw new Error("it ends too early");
    if (!Number.isFinite(Number(word))) throw new Error(`a number was expected, not ${word}`);
    return Number(word);
  };
  const keyword = () => next()?.toUpperCase();
  const channel = () => {
    const found = /^([xyz])(position|rotation)$/i.exec(next());
    if (!found) throw new Error(`${words[at - 1]} is no channel`);
    return found[1].toUpperCase() + found[2].toLowerCase();
  };
  if (keyword() !== "HIERARCHY") throw new Error("it does not begin with HIERARCHY");
  for (let word = keyword(); word !== "MOTION"; word = keyword()) {
    if (word === undefined) throw new Error("it has no MOTION");
    if (["ROOT", "JOINT", "END"].includes(word)) {
      const name = [];
      while (words[at] !== "{" && at < words.length) name.push(next());
      joints.push({ name: name.join(" "), parent: open.length ? open.at(-1) : -1, offset: [0, 0, 0], channels: [], isEnd: word === "END" });
    } else if (word === "{") open.push(joints.length - 1);
    else if (word === "}") open.pop();
    else if (word === "OFFSET") joints[open.at(-1)].offset = [number(), number(), number()];
    else if (word === "CHANNELS") joints[open.at(-1)].channels = Array.from({ length: number() }, channel);
    else throw new Error(`${words[at - 1]} is not understood`);
  }
  const value = (name) => {
    while (at < words.length && words[at].toUpperCase() !== name) at++;
    at++;
    return number();
  };
  const [frames, frameTime] = [value("FRAMES:"), value("TIME:")];
  if (!joints.length) throw new Error("it has no joints");
  if (!(frames > 0)) throw new Error("it has no frames");
  if (!(frameTime > 0)) throw new Error("its frame time is not above 0");
  const channels = joints.reduce((sum, joint) => sum + joint.channels.length, 0);
  const rows = Array.from({ length: frames }, () => Array.from({ length: channels }, number));
  if (at < words.length) throw new Error(`it has more numbers than its ${frames} frames`);
  return { joints, frameTime, rows };
}

const times = (a, b) => a.map((_, i) => [0, 1, 2].reduce((sum, k) => sum + a[3 * Math.floor(i / 3) + k] * b[3 * k + (i % 3)], 0));
const turned = (m, v) => [0, 3, 6].map((row) => m[row] * v[0] + m[row + 1] * v[1] + m[row + 2] * v[2]);
/** The rotation about an axis of a channel, such as `Zrotation`, by degrees; row by row. */
function rotation(channel, degrees) {
  const [c, s] = [Math.cos((degrees * Math.PI) / 180), Math.sin((degrees * Math.PI) / 180)];
  return { X: [1, 0, 0, 0, c, -s, 0, s, c], Y: [c, 0, s, 0, 1, 0, -s, 0, c], Z: [c, -s, 0, s, c, 0, 0, 0, 1] }[channel[0]];
}

/** World positions of the joints of a file, `[frames][joints]`, in its own unit and axes. */
function worldOf({ joints, rows }) {
  return rows.map((row) => {
    let column = 0;
    const world = [];
    for (const { parent, offset, channels } of joints) {
      const local = [...offset];
      let turn = [1, 0, 0, 0, 1, 0, 0, 0, 1];
      for (const channel of channels) {
        const value = row[column++];
        if (channel.endsWith("position")) local["XYZ".indexOf(channel[0])] = value;
        else turn = times(turn, rotation(channel, value));
      }
      const above = world[parent];
      const place = above ? turned(above.turn, local).map((x, axis) => x + above.place[axis]) : local;
      world.push({ place, turn: above ? times(above.turn, turn) : turn });
    }
    return world.map(({ place }) => place);
  });
}

/** What a file's lengths are in cm, by how far joints, not their ends, reach from the root: about 115 cm. */
function unitOf(joints) {
  const reach = [];
  joints.forEach(({ parent, offset, isEnd }) => reach.push(parent < 0 || isEnd ? 0 : reach[parent] + Math.hypot(...offset)));
  const from = Math.max(...reach) || 1;
  const off = ([, cm]) => Math.abs(Math.log((from * cm) / 115));
  return Object.entries({ m: 100, cm: 1, mm: 0.1, in: 2.54 }).reduce((best, unit) => (off(unit) < off(best) ? unit : best));
}

const FAR = 20; // deviation of the places of one who goes about, cm

/** Whether Z points up: whether the feet of a dancer who goes about keep to one height along it, not along Y; of one who stays, whether the head is above the root. */
function isZUp(joints, world, cm) {
  const spread = (axis) => {
    const lowest = world.map((frame) => Math.min(...frame.filter((_, joint) => !joints[joint].isEnd).map((place) => place[axis])));
    const mean = lowest.reduce((sum, height) => sum + height, 0) / lowest.length;
    return Math.sqrt(lowest.reduce((sum, height) => sum + (height - mean) ** 2, 0) / lowest.length);
  };
  const [y, z] = [spread(1), spread(2)];
  const goes = cm * Math.max(y, z) > FAR;
  if (goes && Math.min(y, z) < Math.max(y, z) / 4) return z < y;
  const head = joints.findIndex(({ name }) => /head/i.test(name));
  const above = (frame, axis) => {
    const top = head < 0 ? Math.max(...frame.map((place) => place[axis])) : frame[head][axis];
    return top - frame[0][axis];
  };
  const mean = (axis) => world.reduce((sum, frame) => sum + above(frame, axis), 0);
  return mean(2) > mean(1);
}

/** Positions as `data.js` reads them, and as `positions.rs` writes them. */
function encode(frames) {
  const places = frames.flat();
  const ends = [0, 1, 2].map((axis) => places.reduce(([low, high], place) => [Math.min(low, place[axis]), Math.max(high, place[axis])], [Infinity, -Infinity]));
  const origin = ends.map(([low, high]) => (low + high) / 2);
  const step = Math.max(1 / 64, ...ends.map(([low, high]) => (high - low) / 2 / 32767));
  const view = new DataView(new ArrayBuffer(6 * places.length));
  places.flat().forEach((value, i) => view.setInt16(2 * i, Math.round((value - origin[i % 3]) / step), true));
  const bytes = new Uint8Array(view.buffer);
  let text = "";
  for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
  return { origin, step, steps: btoa(text) };
}

/** A file's motion in cm with Y up, and what was recognised of it. */
function read(name, text) {
  const file = parseBvh(text);
  const [unit, cm] = unitOf(file.joints);
  const world = worldOf(file);
  const zUp = isZUp(file.joints, world, cm);
  const upright = ([x, y, z]) => (zUp ? [x, z, -y] : [x, y, z]).map((value) => value * cm);
  return { name, joints: file.joints, frameTime: file.frameTime, world: world.map((frame) => frame.map(upright)), about: `in ${unit}, ${zUp ? "Z" : "Y"} up` };
}

/** What the page's scripts read, of files on one skeleton, at the first one's rate. */
function dataOf(clips) {
  const [{ joints, frameTime }] = clips;
  const tree = (clip) => JSON.stringify(clip.joints.map(({ name, parent, isEnd }) => [isEnd || name, parent]));
  const stranger = clips.find((clip) => tree(clip) !== tree(clips[0]));
  if (stranger) throw new Error(`${stranger.name} and ${clips[0].name} are on different skeletons; drop one of them`);
  const atRate = ({ world, frameTime: own }) => Array.from({ length: Math.round(((world.length - 1) * own) / frameTime) + 1 }, (_, frame) => world[Math.min(Math.round((frame * frameTime) / own), world.length - 1)]);
  const worlds = clips.map(atRate);
  const frames = Math.max(...worlds.map((world) => world.length));
  const held = (world) => world.concat(Array.from({ length: frames - world.length }, () => world.at(-1)));
  const head = joints.findIndex(({ name }) => /head/i.test(name));
  const foot = (side, part) => joints.findIndex(({ name }) => new RegExp(`${side}.*${part}`, "i").test(name));
  const feet = [foot("left", "foot"), foot("left", "toe"), foot("right", "foot"), foot("right", "toe")];
  return {
    summary: `${frames} frames, ${((frames - 1) * frameTime).toFixed(1)} s at ${Math.round(1 / frameTime)} fps, ${clips[0].about}`,
    frames,
    frameTime,
    parents: joints.map(({ parent }) => parent),
    head: head < 0 ? null : head,
    feet: feet.includes(-1) ? [] : feet,
    thickness: joints.map(({ name, isEnd }) => (isEnd || /thumb|index|middle|ring|pinky|finger/i.test(name) ? 3 : 7)),
    parts: [],
    motions: clips.map(({ name }, index) => ({ name, kind: index ? "other" : "recorded", positions: encode(held(worlds[index])), contacts: new Array(frames).fill(0), factors: [] })),
    keyframes: [],
    trajectory: [],
    asked: [],
    music: null,
    picks: Math.abs(30 * frameTime - 1) < 1e-4 ? "--keyframes" : "--own-frames --keyframes",
  };
}

let newest = 0;

/** Begins the page again with these files, unless others were dropped since. */
async function openFiles(files) {
  if (!files.length) return;
  const own = ++newest;
  try {
    const readOne = async (file) => {
      try {
        return read(file.name, await file.text());
      } catch (fault) {
        throw new Error(`${file.name} is no BVH file that can be shown: ${fault.message}`);
      }
    };
    const clips = await Promise.all([...files].map(readOne));
    if (own !== newest) return;
    const next = new DOMParser().parseFromString(page, "text/html");
    const title = clips.map(({ name }) => name).join(", ");
    for (const heading of next.querySelectorAll("title, h1")) heading.textContent = title;
    // As in page.rs: no "<" that could end the element.
    next.getElementById("motion-data").textContent = JSON.stringify(dataOf(clips)).replaceAll("<", "\\u003c");
    // A link would lead to the page's own clips.
    next.getElementById("link").hidden = true;
    history.replaceState(null, "", `#theme=${root.dataset.theme}`);
    play(false);
    left = true;
    document.open();
    document.write(`<!doctype html>${next.documentElement.outerHTML}`);
    document.close();
  } catch (fault) {
    const notice = document.getElementById("failure");
    notice.hidden = false;
    notice.textContent = fault.message;
  }
}

function listenToFiles() {
  const chosen = document.getElementById("files");
  document.getElementById("open").addEventListener("click", () => chosen.click());
  chosen.addEventListener("change", () => {
    openFiles([...chosen.files]);
    chosen.value = ""; // so that the same file can be chosen again
  });
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    event.preventDefault();
    openFiles(event.dataTransfer.files);
  });
}

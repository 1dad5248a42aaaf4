// Time, controls, keyboard, pointers.

const root = document.documentElement;
const element = (id) => document.getElementById(id);
const SPEEDS = [0.1, 0.25, 0.5, 1, 2];
const HOLD = 600; // ms that the last frame stays before the motion begins again

const look = { arrangement: "side", keyframes: true, paths: true, contacts: true };
const time = { frame: 0, playing: false, speed: 1, shownAt: 0, held: 0 };
let perPixel = 1;
let scheduled = false;
let left = false; // another page has taken this one's place

/** Draws once before the next repaint. */
function refresh() {
  if (!scheduled) {
    scheduled = true;
    requestAnimationFrame(tick);
  }
}

function tick(now) {
  scheduled = false;
  if (left) return;
  if (time.playing) {
    const heard = heardFrame();
    if (heard !== null && heard < LAST) time.frame = heard;
    // A frame may have been begun before the play key was heard.
    else advance(Math.min(Math.max(now - time.shownAt, 0), 200));
    time.shownAt = now;
    refresh();
  }
  perPixel = drawScene(time.frame, look);
  drawCurves(time.frame);
  showTime();
  filmed();
}

function advance(elapsed) {
  if (time.frame >= LAST) {
    time.held += elapsed;
    if (time.held > HOLD) {
      [time.frame, time.held] = [0, 0];
      playSong(true, 0, time.speed);
    }
  } else {
    time.frame = Math.min(time.frame + (elapsed / 1000 / data.frameTime) * time.speed, LAST);
  }
}

function showTime() {
  const frame = Math.round(time.frame);
  const scrub = element("scrub");
  scrub.value = frame;
  scrub.style.setProperty("--done", `calc(${INSET}px + ${time.frame / Math.max(LAST, 1)} * (100% - ${2 * INSET}px))`);
  scrub.setAttribute("aria-valuetext", `frame ${frame} of ${LAST}${isKeyframe(frame) ? ", keyframe" : ""}`);
  const seconds = (frames) => (frames * data.frameTime).toFixed(1);
  element("counter").innerHTML = `${frame} / ${LAST}<small>${seconds(frame)} of ${seconds(LAST)} s</small>`;
  element("pick").setAttribute("aria-pressed", picked.has(frame));
  root.dataset.frame = frame;
  root.dataset.playing = time.playing;
}

function play(playing) {
  time.playing = playing && LAST > 0;
  time.shownAt = performance.now();
  if (playing && time.frame >= LAST) time.frame = 0;
  playSong(time.playing, time.frame, time.speed);
  element("play").setAttribute("aria-label", playing ? "Pause" : "Play");
  refresh();
}

function goTo(frame) {
  time.frame = Math.min(Math.max(Math.round(frame), 0), LAST);
  time.held = 0;
  refresh();
}

function stepTo(frame) {
  play(false);
  goTo(frame);
}

function setSpeed(speed) {
  time.speed = speed;
  element("speed").value = String(speed);
  if (time.playing) playSong(true, time.frame, speed);
}

function nextKeyframe(direction) {
  const frames = keyframes.map((keyframe) => keyframe.frame);
  const now = Math.round(time.frame);
  const ahead = direction > 0 ? frames.filter((frame) => frame > now) : frames.filter((frame) => frame < now).reverse();
  stepTo(ahead.length ? ahead[0] : direction > 0 ? LAST : 0);
}

function setTheme(theme) {
  root.dataset.theme = theme;
  readColours();
  describe();
  forgetStrips();
  refresh();
}

const switchTheme = () => setTheme(colours.dark ? "light" : "dark");

function arrange(arrangement) {
  look.arrangement = arrangement;
  root.dataset.arrangement = arrangement;
  for (const id of ["side", "overlay"]) element(id).setAttribute("aria-pressed", id === arrangement);
  refresh();
}

function toggleMark(mark) {
  look[mark] = !look[mark];
  element(mark).setAttribute("aria-pressed", look[mark]);
  refresh();
}

function toggleFollow() {
  camera.follow = !camera.follow;
  element("follow").setAttribute("aria-pressed", camera.follow);
  refresh();
}

function toggleMotion(index) {
  const motion = motions[index];
  if (!motion) return;
  motion.shown = !motion.shown;
  element("dancers").children[index].setAttribute("aria-pressed", motion.shown);
  describe();
  forgetStrips();
  refresh();
}

/** Says in words what the canvases show, and lists the curves. */
function describe() {
  const names = motions.filter((motion) => motion.shown).map((motion) => motion.name);
  sceneCanvas.setAttribute("aria-label", `Dancers in 3D: ${names.join(", ") || "none shown"}`);
  const legend = element("legend");
  element("factors").classList.toggle("bare", !data.parts.length);
  legend.replaceChildren("Velocity factors, cm/frame");
  const entry = (name, colour, asked) => {
    const item = document.createElement("span");
    const line = document.createElement("i");
    line.style.setProperty("--colour", colour);
    line.classList.toggle("asked", asked);
    item.append(line, name);
    legend.append(item);
  };
  if (data.asked.length) entry("asked for", "var(--target)", true);
  for (const motion of motions.filter((motion) => motion.shown)) {
    entry(motion.name, colours.dark ? `var(--${motion.hue})` : `var(--${motion.hue}-edge)`, false);
  }
}

function addDancerButtons() {
  motions.forEach((motion, index) => {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "chip";
    button.title = `Show or hide (${index + 1})`;
    button.setAttribute("aria-pressed", "true");
    const mark = document.createElement("i");
    mark.className = "mark";
    mark.style.setProperty("--colour", `var(--${motion.hue})`);
    mark.style.setProperty("--edge", `var(--${motion.hue}-edge)`);
    const key = document.createElement("kbd");
    key.textContent = index + 1;
    button.append(mark, motion.name, key);
    button.addEventListener("click", () => toggleMotion(index));
    element("dancers").append(button);
  });
}

const keys = {
  " ": () => play(!time.playing),
  ArrowLeft: (event) => stepTo(Math.round(time.frame) - (event.shiftKey ? 10 : 1)),
  ArrowRight: (event) => stepTo(Math.round(time.frame) + (event.shiftKey ? 10 : 1)),
  ArrowUp: () => nextKeyframe(-1),
  ArrowDown: () => nextKeyframe(1),
  Home: () => stepTo(0),
  End: () => stepTo(LAST),
  ",": () => setSpeed(SPEEDS[Math.max(SPEEDS.indexOf(time.speed) - 1, 0)]),
  ".": () => setSpeed(SPEEDS[Math.min(SPEEDS.indexOf(time.speed) + 1, SPEEDS.length - 1)]),
  "+": () => zoom(1.15),
  "=": () => zoom(1.15),
  "-": () => zoom(1 / 1.15),
  a: () => orbit(0.12, 0),
  d: () => orbit(-0.12, 0),
  w: () => orbit(0, 0.08),
  s: () => orbit(0, -0.08),
  o: () => arrange(look.arrangement === "side" ? "overlay" : "side"),
  k: () => toggleMark("keyframes"),
  p: () => toggleMark("paths"),
  c: () => toggleMark("contacts"),
  m: pick,
  l: link,
  f: toggleFollow,
  r: resetCamera,
  t: switchTheme,
  "?": () => element("help").showModal(),
};

function onKey(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || element("help").open) return;
  // Controls keep the keys that they use themselves.
  const control = event.target.closest("button, select, #picked");
  if (control && (event.key === " " || (control.matches("select, #picked") && event.key.startsWith("Arrow")))) return;
  const name = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  if (/^[1-9]$/.test(name)) toggleMotion(Number(name) - 1);
  else if (keys[name]) keys[name](event);
  else return;
  event.preventDefault();
  refresh();
}

/** Pointers that are down on the scene, by their id. */
const pointers = new Map();

function onPointerMove(event) {
  const before = pointers.get(event.pointerId);
  if (!before) return;
  const now = { x: event.clientX, y: event.clientY };
  const [right, down] = [now.x - before.x, now.y - before.y];
  if (pointers.size === 1) {
    if (before.pans) pan(right, down, perPixel);
    else orbit(-0.008 * right, 0.006 * down);
  } else {
    const other = [...pointers.entries()].find(([id]) => id !== event.pointerId)[1];
    const apart = (point) => Math.hypot(point.x - other.x, point.y - other.y) || 1;
    zoom(apart(now) / apart(before));
    pan(right / 2, down / 2, perPixel);
  }
  pointers.set(event.pointerId, { ...before, ...now });
  refresh();
}

function listenToPointers() {
  sceneCanvas.addEventListener("pointerdown", (event) => {
    const pans = event.button !== 0 || event.shiftKey;
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, pans });
    sceneCanvas.setPointerCapture(event.pointerId);
  });
  sceneCanvas.addEventListener("pointermove", onPointerMove);
  for (const end of ["pointerup", "pointercancel"]) sceneCanvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
  sceneCanvas.addEventListener("contextmenu", (event) => event.preventDefault());
  sceneCanvas.addEventListener("dblclick", () => {
    resetCamera();
    refresh();
  });
  const wheel = (event) => {
    event.preventDefault();
    zoom(Math.exp(-event.deltaY * (event.ctrlKey ? 0.01 : 0.0015)));
    refresh();
  };
  sceneCanvas.addEventListener("wheel", wheel, { passive: false });

  const scrubTo = (event) => stepTo(frameAt(event.offsetX, curvesCanvas.clientWidth));
  curvesCanvas.addEventListener("pointerdown", (event) => {
    curvesCanvas.setPointerCapture(event.pointerId);
    scrubTo(event);
  });
  curvesCanvas.addEventListener("pointermove", (event) => event.buttons && scrubTo(event));
}

/** The address may say how the page begins: `#frame=40&view=overlay&theme=dark&hide=3`. */
function begin() {
  const wanted = new URLSearchParams(location.hash.slice(1));
  if (["light", "dark"].includes(wanted.get("theme"))) root.dataset.theme = wanted.get("theme");
  readColours();
  addDancerButtons();
  arrange(wanted.get("view") === "overlay" ? "overlay" : "side");
  for (const index of (wanted.get("hide") || "").split(",").filter(Boolean)) toggleMotion(Number(index) - 1);
  for (const mark of ["keyframes", "paths", "contacts"]) element(mark).setAttribute("aria-pressed", look[mark]);
  element("follow").setAttribute("aria-pressed", camera.follow);
  element("scrub").max = LAST;
  element("summary").textContent = data.summary;
  describe();

  element("play").addEventListener("click", () => play(!time.playing));
  element("back").addEventListener("click", () => stepTo(Math.round(time.frame) - 1));
  element("forward").addEventListener("click", () => stepTo(Math.round(time.frame) + 1));
  element("scrub").addEventListener("input", (event) => stepTo(Number(event.target.value)));
  element("speed").addEventListener("change", (event) => setSpeed(Number(event.target.value)));
  for (const id of ["side", "overlay"]) element(id).addEventListener("click", () => arrange(id));
  for (const id of ["keyframes", "paths", "contacts"]) element(id).addEventListener("click", () => toggleMark(id));
  element("follow").addEventListener("click", toggleFollow);
  element("theme").addEventListener("click", switchTheme);
  element("ask").addEventListener("click", () => element("help").showModal());
  addEventListener("keydown", onKey);
  listenToPointers();
  listenToHandOn();
  listenToFiles();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", (event) => setTheme(event.matches ? "dark" : "light"));
  const resized = new ResizeObserver(() => {
    forgetStrips();
    refresh();
  });
  for (const canvas of [sceneCanvas, curvesCanvas]) resized.observe(canvas);

  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (wanted.has("frame")) goTo(Number(wanted.get("frame")) || 0);
  // Browsers play no sound before a click.
  else play(!still && !song);
  refresh();
}

begin();

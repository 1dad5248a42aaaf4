// Plays what #motion-data holds, once: no speed, no camera, so that all see the same.

const look = { arrangement: "side", keyframes: false, paths: false, contacts: false };
const time = { frame: 0, playing: false, shownAt: 0 };
let scheduled = 0;

/** Draws once before the next repaint. */
function refresh() {
  if (!scheduled) scheduled = requestAnimationFrame(tick);
}

function tick(now) {
  scheduled = 0;
  if (time.playing) {
    const heard = heardFrame();
    const frame = heard === null ? time.frame + Math.min(Math.max(now - time.shownAt, 0), 200) / 1000 / data.frameTime : heard;
    time.frame = Math.min(Math.max(frame, 0), LAST);
    time.shownAt = now;
    if (time.frame >= LAST) play(false);
    else refresh();
  }
  drawScene(time.frame, look);
  shown(time.frame / Math.max(LAST, 1), time.playing);
}

function play(playing) {
  if (playing && time.frame >= LAST) time.frame = 0;
  time.playing = playing;
  time.shownAt = performance.now();
  playSong(playing, time.frame, 1);
  refresh();
}

// It would follow the first dancer alone.
if (motions.length > 1) camera.follow = false;
readColours();
refresh();
return {
  play,
  toggle: () => play(!time.playing),
  refresh,
  close() {
    playSong(false, 0, 1);
    cancelAnimationFrame(scheduled);
    scheduled = -1;
  },
};

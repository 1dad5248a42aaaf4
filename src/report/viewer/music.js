// The song under the dance. While it plays, it keeps the time; where it cannot be heard, the clock does.

const song = data.music ? new Audio(data.music.source) : null;
const SONG_START = (data.music && data.music.start) || 0; // s of the song before frame 0
let audible = Boolean(song);

if (song) {
  song.preload = "auto";
  song.addEventListener("error", () => {
    audible = false;
    document.documentElement.dataset.music = "missing";
    document.getElementById("summary").textContent += `; ${data.music.name} cannot be played: keep it beside the page`;
  });
}

/** The frame that is heard, or nothing where no song plays. */
const heardFrame = () => (audible && !song.paused && !song.ended ? (song.currentTime - SONG_START) / data.frameTime : null);

/** Plays from a frame on, or stops. */
function playSong(playing, frame, speed) {
  if (!audible) return;
  song.playbackRate = speed;
  if (!playing) {
    song.pause();
    return;
  }
  song.currentTime = SONG_START + frame * data.frameTime;
  // A browser that wants a click first keeps silent until then; the clock goes on.
  song.play().catch(() => {});
}

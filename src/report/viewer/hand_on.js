// What leaves the page: frames that were picked, a link to a frame, a film.

const picked = new Set();

/** Picks the frame shown, or lets it go. */
function pick() {
  if (!data.picks) return;
  const frame = Math.round(time.frame);
  if (!picked.delete(frame)) picked.add(frame);
  const frames = [...picked].sort((one, other) => one - other);
  element("picked").value = frames.length ? `${data.picks} ${frames.join(",")}` : "";
  element("picked").hidden = element("copy").hidden = !frames.length;
  refresh();
}

/** Copies a text; a page from disk may not be let at the clipboard, then says what is to do. */
async function copy(text, button, otherwise) {
  try {
    await navigator.clipboard.writeText(text);
    button.dataset.done = "copied";
  } catch {
    button.dataset.done = otherwise;
  }
  setTimeout(() => delete button.dataset.done, 1500);
}

/** The page at this frame. */
function link() {
  if (element("link").hidden) return;
  const asked = new URLSearchParams(location.hash.slice(1));
  asked.set("frame", Math.round(time.frame));
  if (look.arrangement === "overlay") asked.set("view", "overlay");
  history.replaceState(null, "", `#${asked}`);
  copy(location.href, element("link"), "in the address bar");
}

let film = null;

/** Films the scene from the first frame to the last, as WebM; a second time ends it early. */
function record() {
  if (film) {
    film.stop();
    return;
  }
  const parts = [];
  film = new MediaRecorder(sceneCanvas.captureStream(30), { mimeType: "video/webm", videoBitsPerSecond: 8e6 });
  film.addEventListener("dataavailable", (event) => parts.push(event.data));
  film.addEventListener("stop", () => {
    film = null;
    element("record").setAttribute("aria-pressed", "false");
    play(false);
    const place = document.createElement("a");
    place.href = URL.createObjectURL(new Blob(parts, { type: "video/webm" }));
    place.download = `${document.title.replace(/[^\w.-]+/g, "_")}.webm`;
    place.click();
    URL.revokeObjectURL(place.href);
  });
  element("record").setAttribute("aria-pressed", "true");
  goTo(0);
  film.start();
  play(true);
}

/** Ends a film with the last frame. */
function filmed() {
  if (film && film.state === "recording" && time.frame >= LAST) film.stop();
}

function listenToHandOn() {
  element("pick").hidden = !data.picks;
  element("pick").addEventListener("click", pick);
  element("copy").addEventListener("click", () => {
    element("picked").select();
    copy(element("picked").value, element("copy"), "selected");
  });
  element("link").addEventListener("click", link);
  element("record").hidden = !(window.MediaRecorder && sceneCanvas.captureStream);
  element("record").addEventListener("click", record);
}

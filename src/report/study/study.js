// The course of a study: who rates, clip by clip, the ratings at the end.

const root = document.documentElement;
const element = (id) => document.getElementById(id);

/** Null before the participant is known. */
let session = null;
/** What plays, and since when it is shown. */
let viewer = null;
let openedAt = 0;

const current = () => session && session.items[session.at];

/** What a viewer's scripts read of an item. */
function dataOf({ question, clip }) {
  const heard = question.sound ? { name: "the music", source: study.songs[clip.song], start: study.skip, beats: [], downbeats: [] } : null;
  return { ...(question.pair ? clip.pair : clip.whole), music: heard };
}

function begin(participant) {
  const [items, answers] = [itemsOf(participant), keptAnswers(participant)];
  session = { participant, items, answers, at: items.length };
  element("welcome").hidden = true;
  goTo(firstUnrated());
}

/** Where there is none, the end. */
function firstUnrated() {
  const at = session.items.findIndex((item) => !session.answers[answerOf(item)]);
  return at < 0 ? session.items.length : at;
}

function goTo(at) {
  session.at = Math.min(Math.max(at, 0), session.items.length);
  show();
}

/** Shows the current item, or the end. */
function show() {
  if (viewer) viewer.close();
  viewer = null;
  delete root.dataset.music;
  element("summary").textContent = "";
  const item = current();
  element("rating").hidden = !item;
  element("end").hidden = Boolean(item);
  if (item) {
    describe(item);
    element("motion-data").textContent = JSON.stringify(dataOf(item));
    viewer = openViewer(showTime);
    openedAt = performance.now();
    element("scene").focus({ preventScroll: true });
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) viewer.play(true);
  }
  showProgress();
}

function describe({ question, order }) {
  const number = study.questions.indexOf(question) + 1;
  element("place").textContent = `Question ${number} of ${study.questions.length}, clip ${order} of ${study.clips.length}, ${question.sound ? "with sound" : "without sound"}`;
  element("question").textContent = question.text;
  element("low").textContent = question.ends[0];
  element("high").textContent = question.ends[1];
}

function showTime(share, playing) {
  element("done").style.width = `${100 * share}%`;
  element("play").setAttribute("aria-label", playing ? "Pause" : "Play");
  root.dataset.playing = playing;
}

function showProgress() {
  const { participant, items, answers, at } = session;
  const rated = items.filter((item) => answers[answerOf(item)]).length;
  const answer = at < items.length ? answers[answerOf(items[at])] : null;
  for (const button of element("scale").querySelectorAll("button")) {
    button.setAttribute("aria-pressed", Boolean(answer && answer.rating === Number(button.textContent)));
  }
  element("back").disabled = at === 0;
  element("progress").textContent = `${rated} of ${items.length} rated`;
  element("next").textContent = answer ? "Next" : "Pass over";
  element("thanks").textContent = rated === items.length ? "Everything is rated. Thank you!" : `Passed over: ${items.length - rated}. You may go back and rate what is missing.`;
  const csv = csvOf(participant, items, answers);
  for (const link of document.querySelectorAll("a.ratings")) {
    link.href = `data:text/csv;charset=utf-8,${encodeURIComponent(csv)}`;
    link.download = `ratings-${participant.replace(/[^\p{L}\p{N}_-]/gu, "_")}.csv`;
  }
  element("save").hidden = rated === 0;
  root.dataset.rated = rated;
}

function rate(rating) {
  const item = current();
  if (!item) return;
  if (item.question.sound && root.dataset.music === "missing") {
    element("summary").textContent = "The music cannot be played, so this cannot be rated. Please tell whoever sent you the page.";
    return;
  }
  const seconds = ((performance.now() - openedAt) / 1000).toFixed(1);
  session.answers[answerOf(item)] = { rating, seconds, at: new Date().toISOString() };
  const kept = keepAnswers(session.participant, session.answers);
  element("unkept").hidden = kept;
  goTo(session.at + 1);
}

const keys = {
  " ": () => viewer && viewer.toggle(),
  ArrowLeft: () => goTo(session.at - 1),
  ArrowRight: () => goTo(session.at + 1),
};

function onKey(event) {
  if (!session || event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
  // A button keeps the keys that press it.
  if (event.target.closest("button, a") && [" ", "Enter"].includes(event.key)) return;
  if (/^[1-5]$/.test(event.key)) rate(Number(event.key));
  else if (keys[event.key]) keys[event.key]();
  else return;
  event.preventDefault();
}

/** The address may name the participant: `#participant=7`. */
function prepare() {
  element("participant").value = new URLSearchParams(location.hash.slice(1)).get("participant") || "";
  element("sound").hidden = !study.questions.some((question) => question.sound);
  element("welcome").addEventListener("submit", (event) => {
    event.preventDefault();
    const participant = element("participant").value.trim();
    if (participant) begin(participant);
  });
  for (let rating = 1; rating <= 5; rating++) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = rating;
    button.addEventListener("click", () => rate(rating));
    element("scale").append(button);
  }
  element("play").addEventListener("click", () => viewer && viewer.toggle());
  element("back").addEventListener("click", () => goTo(session.at - 1));
  element("next").addEventListener("click", () => goTo(session.at + 1));
  element("again").addEventListener("click", () => goTo(Math.min(firstUnrated(), session.items.length - 1)));
  addEventListener("keydown", onKey);
  new ResizeObserver(() => viewer && viewer.refresh()).observe(element("scene"));
}

prepare();

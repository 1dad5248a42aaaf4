// The ratings of a participant: kept in this browser, and as CSV.

const COLUMNS = ["participant", "clip", "question", "rating", "order", "seconds", "rated_at"];
const placeOf = (participant) => `keydance study ${study.study} ${participant}`;
const answerOf = ({ question, clip }) => `${question.name} ${clip.id}`;

/** Those of before; none where the browser keeps nothing. */
function keptAnswers(participant) {
  try {
    return JSON.parse(localStorage.getItem(placeOf(participant))) || {};
  } catch {
    return {};
  }
}

/** Whether the browser keeps them. */
function keepAnswers(participant, answers) {
  try {
    localStorage.setItem(placeOf(participant), JSON.stringify(answers));
    return true;
  } catch {
    return false;
  }
}

const cell = (value) => (/[",\r\n]/.test(value) ? `"${String(value).replaceAll('"', '""')}"` : String(value));

/** A line for each item that is rated, in the order of the items. */
function csvOf(participant, items, answers) {
  const rated = items.filter((item) => answers[answerOf(item)]);
  const lines = rated.map((item) => {
    const { rating, seconds, at } = answers[answerOf(item)];
    return [participant, item.clip.id, item.question.name, rating, item.order, seconds, at].map(cell).join(",");
  });
  return [COLUMNS.join(","), ...lines].join("\n") + "\n";
}

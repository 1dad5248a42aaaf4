// The order in which a participant sees the clips: the same one each time that the page is opened.

/** 32 bits of a text (FNV-1a). */
function hash(text) {
  let bits = 0x811c9dc5;
  for (const byte of new TextEncoder().encode(text)) bits = Math.imul(bits ^ byte, 0x01000193);
  return bits >>> 0;
}

/** Numbers from 0 to 1 that follow from a seed (mulberry32). */
function numbers(seed) {
  return () => {
    seed = (seed + 0x6d2b79f5) | 0;
    let bits = Math.imul(seed ^ (seed >>> 15), seed | 1);
    bits ^= bits + Math.imul(bits ^ (bits >>> 7), bits | 61);
    return ((bits ^ (bits >>> 14)) >>> 0) / 2 ** 32;
  };
}

/** A permutation that follows from a text (Fisher and Yates). */
function shuffled(list, text) {
  const [order, next] = [[...list], numbers(hash(text))];
  for (let last = order.length - 1; last > 0; last--) {
    const other = Math.floor(next() * (last + 1));
    [order[last], order[other]] = [order[other], order[last]];
  }
  return order;
}

/** All that a participant is asked: one question after another, each about all clips. */
const itemsOf = (participant) =>
  study.questions.flatMap((question) =>
    shuffled(study.clips, `${study.study} ${participant} ${question.name}`).map((clip, index) => ({ question, clip, order: index + 1 })),
  );

// Velocity factors under the timeline: a strip a body part, asked for and measured, with the cursor at the present.

const curvesCanvas = document.getElementById("curves");
const curves = curvesCanvas.getContext("2d");
const INSET = 8; // half of the slider's thumb: frame 0 lies under its middle
const RULER = 22;
const GAP = 5;
const HEADROOM = 13; // for a strip's name and values

/** The strips without the cursor; drawn again when size, theme or motions change. */
let strips = null;
function forgetStrips() {
  strips = null;
}

const timeX = (frame, width) => INSET + (frame / Math.max(LAST, 1)) * (width - 2 * INSET);
const frameAt = (x, width) => ((x - INSET) / (width - 2 * INSET)) * LAST;

/** The series of a body part: each shown motion, then what was asked for, if anything. */
function seriesOf(part) {
  const column = (factors) => factors.map((frame) => frame[part]);
  const measured = motions.filter((motion) => motion.shown).map((motion) => ({ name: motion.name, hue: motion.hue, values: column(motion.factors) }));
  return data.asked.length ? [...measured, { name: "asked for", hue: "target", values: column(data.asked), asked: true }] : measured;
}

/** The value at a strip's upper end: a single frame that jumps does not flatten all the others. */
function scaleOf(series) {
  const most = ({ values }) => [...values].sort((a, b) => a - b)[Math.floor(0.98 * (values.length - 1))];
  return Math.max(0.5, ...series.map(most));
}

const seriesColour = (series) => (series.asked ? colours.target : lineColour(series.hue));

function paintStrips(width, height, ratio) {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  const ink = canvas.getContext("2d");
  ink.setTransform(ratio, 0, 0, ratio, 0, 0);
  ink.font = "11px system-ui, sans-serif";
  ink.textBaseline = "middle";
  const step = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000].find((frames) => (LAST / frames) * 56 < width) || 2000;
  ink.textAlign = "center";
  ink.fillStyle = colours.muted;
  const given = keyframes.map((keyframe) => keyframe.frame);
  for (let frame = 0; frame <= LAST; frame += step) {
    if (given.every((keyframe) => Math.abs(timeX(keyframe, width) - timeX(frame, width)) > 24)) ink.fillText(String(frame), timeX(frame, width), 10);
  }
  ink.font = "600 11px system-ui, sans-serif";
  for (const frame of given) {
    const x = timeX(frame, width);
    ink.fillStyle = colours.keyframe;
    ink.textAlign = x < 30 ? "left" : x > width - 30 ? "right" : "center";
    ink.fillText(String(frame), ink.textAlign === "center" ? x : x < 30 ? x - 3 : x + 3, 10);
    ink.globalAlpha = 0.45;
    ink.fillRect(x - 0.5, RULER, 1, height - RULER);
    ink.globalAlpha = 1;
  }
  if (data.music) {
    const mark = (frame, colour, wide) => {
      ink.fillStyle = colour;
      ink.fillRect(timeX(frame, width) - wide / 2, RULER, wide, height - RULER);
    };
    ink.globalAlpha = 0.6;
    for (const beat of data.music.beats) mark(beat, colours.line, 1);
    for (const beat of data.music.downbeats) mark(beat, colours.muted, 1.5);
    ink.globalAlpha = 1;
  }
  const tall = (height - RULER) / data.parts.length;
  data.parts.forEach((_, part) => {
    const [top, bottom] = [RULER + part * tall, RULER + (part + 1) * tall - GAP];
    const series = seriesOf(part);
    const most = scaleOf(series);
    ink.fillStyle = colours.line;
    ink.fillRect(INSET, bottom, width - 2 * INSET, 1);
    ink.save();
    ink.beginPath();
    ink.rect(0, top, width, bottom - top + 1);
    ink.clip();
    for (const line of series) {
      ink.strokeStyle = seriesColour(line);
      ink.lineWidth = line.asked ? 1.4 : 1.7;
      ink.setLineDash(line.asked ? [4, 3] : []);
      ink.lineJoin = "round";
      ink.beginPath();
      line.values.forEach((value, frame) => ink.lineTo(timeX(frame, width), bottom - (value / most) * (bottom - top - HEADROOM)));
      ink.stroke();
    }
    ink.restore();
  });
  return canvas;
}

/** A text that stays legible on the curves. */
function haloed(text, x, y, colour) {
  curves.lineWidth = 4;
  curves.lineJoin = "round";
  curves.strokeStyle = panelColour();
  curves.strokeText(text, x, y);
  curves.fillStyle = colour;
  curves.fillText(text, x, y);
}

const panelColour = () => getComputedStyle(document.documentElement).getPropertyValue("--panel").trim();

function drawCurves(frame) {
  const ratio = devicePixelRatio || 1;
  const [width, height] = [curvesCanvas.clientWidth, curvesCanvas.clientHeight];
  if (!width) return;
  if (!strips || strips.width !== Math.round(width * ratio)) {
    strips = paintStrips(width, height, ratio);
    [curvesCanvas.width, curvesCanvas.height] = [strips.width, strips.height];
  }
  curves.setTransform(1, 0, 0, 1, 0, 0);
  curves.clearRect(0, 0, strips.width, strips.height);
  curves.drawImage(strips, 0, 0);
  curves.setTransform(ratio, 0, 0, ratio, 0, 0);
  const x = timeX(frame, width);
  curves.fillStyle = colours.ink;
  curves.fillRect(x - 0.75, RULER - 2, 1.5, height - RULER + 2 - GAP);
  curves.textBaseline = "top";
  const tall = (height - RULER) / data.parts.length;
  data.parts.forEach((name, part) => {
    const top = RULER + part * tall;
    curves.font = "600 11px system-ui, sans-serif";
    curves.textAlign = "left";
    haloed(name, INSET + 2, top, colours.ink);
    curves.font = "11px system-ui, sans-serif";
    curves.textAlign = "right";
    let right = width - INSET - 2;
    for (const line of seriesOf(part).reverse()) {
      const text = line.values[Math.round(frame)].toFixed(1);
      haloed(text, right, top, seriesColour(line));
      right -= 32;
    }
  });
}

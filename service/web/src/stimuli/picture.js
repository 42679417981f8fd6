// The picture of a stimulus: motionenv/data/stimuli/making.py.

import { greyOf } from "./settings.js";

const level = (grey) => {
  const value = Math.round(255 * grey);
  return `rgb(${value} ${value} ${value})`;
};

/** Draw `dots` (of PointLights) on a canvas of the stimulus's size; `edges` connect dots of the walker if asked for. */
export function paint(context, stimulus, dots, edges) {
  const { width, height, size, lines, dot_size: dotSize, line_width: lineWidth } = stimulus;
  const scale = size * height;
  const place = ({ x, y }) => [0.5 * width + scale * x, 0.5 * height - scale * y];
  context.fillStyle = level(stimulus.background);
  context.fillRect(0, 0, width, height);
  context.fillStyle = context.strokeStyle = level(greyOf(stimulus));
  context.lineWidth = (lineWidth / 100) * scale;
  for (const [from, to] of lines ? edges : []) {
    if (!dots[from].visible || !dots[to].visible) continue;
    context.beginPath();
    context.moveTo(...place(dots[from]));
    context.lineTo(...place(dots[to]));
    context.stroke();
  }
  for (const dot of dots) {
    if (!dot.visible) continue;
    context.beginPath();
    context.arc(...place(dot), (0.5 * dotSize * scale) / 100, 0, 2 * Math.PI);
    context.fill();
  }
}

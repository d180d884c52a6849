// The board without WebGL: an artificial horizon beside a compass.

import { colour, el } from "./dom";
import type { BoardPicture } from "./board3d";
import { toAngles } from "./rotation";

export function boardIn2d(): BoardPicture {
  const canvas = el("canvas");
  let last: Parameters<BoardPicture["show"]> = [[1, 0, 0, 0, 1, 0, 0, 0, 1], 0, {}, null];

  const draw = (): void => {
    const context = canvas.getContext("2d");
    const { clientWidth: width, clientHeight: height } = canvas.parentElement ?? canvas;
    if (!context || !width || !height) return;
    canvas.width = width;
    canvas.height = height;
    const { roll, pitch, yaw } = toAngles(last[0]);
    const radius = Math.min(width / 4.6, height / 2.4), middle = height / 2;
    context.save();
    context.translate(width / 2 - radius * 1.12, middle);
    context.beginPath();
    context.arc(0, 0, radius, 0, 2 * Math.PI);
    context.clip();
    context.rotate((-pitch * Math.PI) / 180); // from the front: X to the right
    const offset = (roll / 90) * radius;
    context.fillStyle = colour("--sky");
    context.fillRect(-2 * radius, -3 * radius, 4 * radius, 3 * radius + offset);
    context.fillStyle = colour("--earth");
    context.fillRect(-2 * radius, offset, 4 * radius, 4 * radius);
    context.restore();
    context.strokeStyle = colour("--ink");
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(width / 2 - radius * 1.62, middle);
    context.lineTo(width / 2 - radius * 0.62, middle);
    context.stroke();
    context.save();
    context.translate(width / 2 + radius * 1.12, middle);
    context.beginPath();
    context.arc(0, 0, radius, 0, 2 * Math.PI);
    context.stroke();
    context.fillStyle = colour("--muted");
    context.font = "600 13px system-ui";
    context.textAlign = "center";
    context.textBaseline = "middle";
    [["N", 0], ["E", 90], ["S", 180], ["W", 270]].forEach(([name, degrees]) => {
      const angle = (Number(degrees) * Math.PI) / 180;
      context.fillText(String(name), 0.84 * radius * Math.sin(angle), -0.84 * radius * Math.cos(angle));
    });
    context.rotate((-yaw * Math.PI) / 180); // counter-clockwise from north, seen from above
    context.strokeStyle = colour("--axis-x");
    context.lineWidth = 4;
    context.beginPath();
    context.moveTo(0, 0);
    context.lineTo(0, -0.66 * radius);
    context.stroke();
    context.restore();
  };
  return {
    element: canvas, right: [1, 0, 0], towards: [0, -1, 0], restyle: draw, resize: draw,
    onMagnet: () => false,
    under: () => null,
    show(...now) {
      last = now;
      draw();
    },
  };
}

// Points in 3D on a plain canvas: turned with mouse, touch or keys, and chosen with a click.

import { PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const FIELD = 30; // vertical field of view [degrees]
const ROOM = 1.25; // share of the points' extent that is shown
const ENOUGH = 6; // points by which a body's extent is judged
const TURN = 6; // degrees a press of a key
const ZOOM = 1.1;
const STILL = 5; // pixels that a click may move
const REACH = { mouse: 14, touch: 26 }; // pixels around a dot in which a click hits it
const SQUARE = 0.5; // [m]
const SQUARES = 3; // of the floor, to each side

const radians = (angle) => (angle * Math.PI) / 180;
const degrees = (angle) => (angle * 180) / Math.PI;

/**
 * A view of points.
 *
 * `positions`: [x, y, z] [m] or null each; `names`: of the points; `heading`: where they go [degrees], or null;
 * `body`: names of points that are known to be the body's: files hold others, such as of axes.
 * `chosen(point)` is called with the name of a point that is clicked; `look(point)` returns how a point is drawn,
 * `{ side, selected, label }`; `bones()` the pairs of points to join.
 */
export class Dots {
  constructor(canvas, { positions, names, heading, body }, { chosen, look, bones }) {
    Object.assign(this, { canvas, names, heading, chosen, look, bones });
    this.places = positions.map((place) => place && new Vector3(...place));
    this.at = positions.map(() => null); // on the canvas
    this.hovered = null;
    this.labels = false;
    this.camera = new PerspectiveCamera(FIELD, 1, 0.05, 100);
    this.camera.up.set(0, 0, 1);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.enablePan = false;
    const seen = this.places.filter((place, i) => place && body.includes(names[i]));
    this.frame(seen.length >= ENOUGH ? seen : this.places.filter(Boolean));
    this.orbit.addEventListener("change", () => this.draw());
    this.listen();
    this.observer = new ResizeObserver(() => this.draw());
    this.observer.observe(canvas);
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this.dark.onchange = () => this.draw();
  }

  /** Look at places from the front, a little from the side. */
  frame(known) {
    const along = (axis) => known.map((place) => place[axis]).sort((a, b) => a - b);
    const [least, most] = [new Vector3(), new Vector3()];
    for (const axis of known.length ? ["x", "y", "z"] : []) {
      const sorted = along(axis);
      [least[axis], most[axis]] = [sorted[0], sorted.at(-1)];
    }
    this.floor = least.z;
    this.orbit.target.copy(least).add(most).multiplyScalar(0.5);
    this.size = Math.max(0.3, least.distanceTo(most));
    this.orbit.minDistance = 0.2 * this.size;
    this.orbit.maxDistance = 6 * this.size;
    this.turn((this.heading ?? 0) + 25, 12, (ROOM * this.size) / (2 * Math.tan(radians(FIELD / 2))));
  }

  /** Look from `around` (from x towards y) and `up` [degrees], `away` [m]. */
  turn(around, up, away) {
    const level = away * Math.cos(radians(up));
    const from = new Vector3(level * Math.cos(radians(around)), level * Math.sin(radians(around)), away * Math.sin(radians(up)));
    this.camera.position.copy(this.orbit.target).add(from);
    this.orbit.update();
  }

  /** Where the camera is, as `turn` takes it. */
  get view() {
    const from = this.camera.position.clone().sub(this.orbit.target);
    const away = from.length();
    return [degrees(Math.atan2(from.y, from.x)), degrees(Math.asin(from.z / away)), away];
  }

  listen() {
    const { canvas } = this;
    let down = null;
    canvas.addEventListener("pointerdown", ({ offsetX: x, offsetY: y }) => (down = [x, y]));
    canvas.addEventListener("pointerup", ({ offsetX: x, offsetY: y, pointerType }) => {
      if (!down || Math.hypot(x - down[0], y - down[1]) > STILL) return;
      const hit = this.nearest(x, y, REACH[pointerType] ?? REACH.mouse);
      if (hit !== null) this.chosen(this.names[hit]);
    });
    canvas.addEventListener("pointermove", ({ offsetX: x, offsetY: y }) => this.hover(this.nearest(x, y, REACH.mouse)));
    canvas.addEventListener("pointerleave", () => this.hover(null));
    canvas.addEventListener("keydown", (event) => {
      const [around, up, away] = this.view;
      const high = (angle) => Math.min(88, Math.max(-88, angle));
      const moves = {
        ArrowLeft: [around - TURN, up, away],
        ArrowRight: [around + TURN, up, away],
        ArrowUp: [around, high(up + TURN), away],
        ArrowDown: [around, high(up - TURN), away],
        "+": [around, up, away / ZOOM],
        "=": [around, up, away / ZOOM],
        "-": [around, up, away * ZOOM],
      };
      if (!moves[event.key]) return;
      event.preventDefault();
      this.turn(...moves[event.key]);
    });
  }

  hover(point) {
    if (point === this.hovered) return;
    this.hovered = point;
    this.canvas.style.cursor = point === null ? "" : "pointer";
    this.draw();
  }

  /** Index of the point nearest to a place on the canvas, within `reach` pixels, or null. */
  nearest(x, y, reach) {
    const far = this.at.map((at) => (at ? Math.hypot(at.x - x, at.y - y) : Infinity));
    const least = Math.min(...far);
    return least <= reach ? far.indexOf(least) : null;
  }

  /** Where a place in the world is on the canvas, and how near; null behind the camera. */
  project(place) {
    const seen = place.clone().project(this.camera);
    if (Math.abs(seen.z) > 1) return null;
    return { x: ((seen.x + 1) / 2) * this.width, y: ((1 - seen.y) / 2) * this.height, away: place.distanceTo(this.camera.position) };
  }

  draw() {
    const { canvas } = this;
    [this.width, this.height] = [canvas.clientWidth, canvas.clientHeight];
    if (!this.width || !this.height) return;
    const fine = devicePixelRatio;
    canvas.width = Math.round(this.width * fine);
    canvas.height = Math.round(this.height * fine);
    this.camera.aspect = this.width / this.height;
    this.camera.fov = this.camera.aspect < 1 ? FIELD / this.camera.aspect ** 0.5 : FIELD;
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    const style = getComputedStyle(canvas);
    this.colour = (name) => style.getPropertyValue(`--${name}`);
    this.pen = canvas.getContext("2d");
    this.pen.scale(fine, fine);
    this.pen.font = `12px ${style.fontFamily}`;
    this.at = this.places.map((place) => place && this.project(place));
    this.drawFloor();
    this.drawBones();
    this.drawDots();
  }

  line(from, to, colour, width) {
    if (!from || !to) return;
    Object.assign(this.pen, { strokeStyle: colour, lineWidth: width });
    this.pen.beginPath();
    this.pen.moveTo(from.x, from.y);
    this.pen.lineTo(to.x, to.y);
    this.pen.stroke();
  }

  /** Squares of half a metre under the points, and an arrow the way that they go. */
  drawFloor() {
    const { target } = this.orbit;
    const middle = [target.x, target.y].map((x) => SQUARE * Math.round(x / SQUARE));
    const place = (x, y) => this.project(new Vector3(x, y, this.floor));
    const wide = SQUARE * SQUARES;
    for (let i = -SQUARES; i <= SQUARES; i++) {
      const [x, y] = middle.map((at) => at + SQUARE * i);
      this.line(place(x, middle[1] - wide), place(x, middle[1] + wide), this.colour("line"), 1);
      this.line(place(middle[0] - wide, y), place(middle[0] + wide, y), this.colour("line"), 1);
    }
    if (this.heading === null) return;
    const along = (length, side) => {
      const [c, s] = [Math.cos(radians(this.heading)), Math.sin(radians(this.heading))];
      return place(target.x + c * length - s * side, target.y + s * length + c * side);
    };
    const tip = along(0.7, 0);
    for (const from of [along(0.25, 0), along(0.6, 0.07), along(0.6, -0.07)]) this.line(from, tip, this.colour("soft"), 2);
    if (tip) this.write("forwards", tip, this.colour("soft"), 8);
  }

  drawBones() {
    const at = (point) => this.at[this.names.indexOf(point)];
    for (const [from, to] of this.bones()) this.line(at(from), at(to), this.colour("track"), 2);
  }

  /** The far ones first. */
  drawDots() {
    const order = this.at.map((_, i) => i).filter((i) => this.at[i]);
    order.sort((i, j) => this.at[j].away - this.at[i].away);
    const looks = this.names.map((name) => this.look(name));
    for (const i of order) this.drawDot(this.at[i], looks[i], i === this.hovered);
    for (const i of order) {
      const { label, selected } = looks[i];
      if (!this.labels && !selected && i !== this.hovered) continue;
      const words = label && i === this.hovered ? `${this.names[i]}: ${label}` : this.names[i];
      this.write(words, this.at[i], this.colour("ink"), 11, selected);
    }
  }

  drawDot({ x, y, away }, { side, selected }, hovered) {
    const { pen } = this;
    const near = Math.min(1.4, Math.max(0.7, this.view[2] / away));
    const disc = (radius) => {
      pen.beginPath();
      pen.arc(x, y, radius, 0, 2 * Math.PI);
    };
    disc(5 * near + (hovered ? 1.5 : 0));
    pen.fillStyle = side ? this.colour(side === "middle" ? "soft" : side) : this.colour("card");
    pen.fill();
    Object.assign(pen, { strokeStyle: side ? this.colour("card") : this.colour("ink"), lineWidth: 1.5 });
    pen.stroke();
    if (!selected) return;
    disc(5 * near + 5);
    Object.assign(pen, { strokeStyle: this.colour("accent"), lineWidth: 3 });
    pen.stroke();
  }

  /** Words beside a place, with a rim that sets them off. */
  write(words, { x, y }, colour, right, bold = false) {
    const { pen } = this;
    const plain = pen.font;
    if (bold) pen.font = `600 ${plain}`;
    const left = Math.max(4, Math.min(x + right, this.width - pen.measureText(words).width - 4));
    Object.assign(pen, { strokeStyle: this.colour("paper"), lineWidth: 4, lineJoin: "round", fillStyle: colour });
    pen.strokeText(words, left, y + 4);
    pen.fillText(words, left, y + 4);
    pen.font = plain;
  }

  /** Stop listening. */
  close() {
    this.orbit.dispose();
    this.observer.disconnect();
    this.dark.onchange = null;
  }
}

// The scene: ground, camera, and one walker or two side by side.

import {
  Color,
  Mesh,
  PerspectiveCamera,
  PlaneGeometry,
  Scene,
  ShaderMaterial,
  Spherical,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const NEAR = [2.2, 14]; // [m] range of the camera's distance
const USUAL = [45, 8, 5.6]; // degrees around (0 from the side, 90 from the front), degrees up, metres away
const FLOOR = 15; // [m] half a side of the ground
const FIELD = 22; // vertical field of view [degrees]
const NARROW = 0.55; // aspect ratio below which the field of view grows, so that arms and steps fit

const GROUND = {
  vertexShader: `varying vec2 at;
    void main() { at = position.xy; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`,
  // Squares of half a metre, averaged over a pixel (box filter of the checker's integral), fading out with distance.
  fragmentShader: `varying vec2 at; uniform vec2 moved; uniform vec3 bright; uniform vec3 dark; uniform float reach;
    vec2 ramp(vec2 x) { return abs(fract(x * 0.5) - 0.5) * 2.0; }
    void main() {
      vec2 p = (at + moved) / 0.5, w = max(fwidth(p), 1e-4);
      vec2 k = (ramp(p - 0.5 * w) - ramp(p + 0.5 * w)) / w;
      float share = 0.5 - 0.5 * clamp(k.x, -1.0, 1.0) * clamp(k.y, -1.0, 1.0);
      float near = 1.0 - smoothstep(0.25, 1.0, length(at) / reach);
      gl_FragColor = vec4(mix(dark, bright, share), near);
    }`,
};

/** The scene on a canvas. Throws without WebGL. */
export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, alpha: true, stencil: true, powerPreference: "high-performance" });
    this.renderer.setPixelRatio(fineness(this.renderer.getContext()));
    this.renderer.setScissorTest(true);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(FIELD, 1, 0.1, 60);
    this.camera.up.set(0, 0, 1);
    this.figures = [];
    this.changed = true; // whether a paused scene must be drawn again
    this.floor();
    this.orbit();
    this.resize();
    new ResizeObserver(() => this.resize()).observe(canvas);
  }

  floor() {
    const uniforms = {
      moved: { value: new Vector2() },
      bright: { value: new Color() },
      dark: { value: new Color() },
      reach: { value: FLOOR },
    };
    const material = new ShaderMaterial({ ...GROUND, uniforms, transparent: true, depthWrite: false });
    this.ground = new Mesh(new PlaneGeometry(2 * FLOOR, 2 * FLOOR), material);
    this.ground.renderOrder = -1; // before the shadows on it
    this.scene.add(this.ground);
  }

  /** Light or dark ground. */
  theme(dark) {
    this.changed = true;
    const { bright, dark: deep } = this.ground.material.uniforms;
    bright.value.set(dark ? "#3a4149" : "#dcdddc").convertLinearToSRGB(); // mixed as the screen shows them
    deep.value.set(dark ? "#30363d" : "#c6c8c8").convertLinearToSRGB();
  }

  orbit() {
    const orbit = new OrbitControls(this.camera, this.canvas);
    orbit.target.set(0, 0, 0.9);
    [orbit.minDistance, orbit.maxDistance] = NEAR;
    orbit.maxPolarAngle = Math.PI * 0.53;
    orbit.enablePan = false;
    orbit.enableDamping = true;
    orbit.addEventListener("change", () => (this.changed = true));
    this.controls = orbit;
    this.look(USUAL);
  }

  /** Where the camera is: degrees around, degrees up, metres away. */
  get view() {
    const from = new Spherical().setFromVector3(turned(this.camera.position.clone().sub(this.controls.target)));
    const degrees = (r) => (r * 180) / Math.PI;
    return [degrees(from.theta), 90 - degrees(from.phi), from.radius];
  }

  /** Look from `around` and `up` [degrees], `away` [m]. */
  look([around, up, away]) {
    const radians = (d) => (d * Math.PI) / 180;
    const sphere = new Spherical(away, radians(90 - up), radians(around));
    this.camera.position.copy(unturned(new Vector3().setFromSpherical(sphere)).add(this.controls.target));
    this.controls.update();
  }

  /** Change some of the view's coordinates; null keeps one. */
  move({ around = null, up = null, away = null }) {
    const now = this.view;
    const high = Math.min(85, Math.max(-4, up ?? now[1]));
    this.look([around ?? now[0], high, Math.min(NEAR[1], Math.max(NEAR[0], away ?? now[2]))]);
  }

  /** Point the camera at the middle of a figure of this height [m]. */
  aim(height) {
    const middle = 0.51 * height;
    this.camera.position.z += middle - this.controls.target.z;
    this.controls.target.z = middle;
  }

  /** Show these figures, and no others. */
  show(figures) {
    for (const figure of this.figures) figure.dispose();
    this.figures = figures;
    for (const figure of figures) this.scene.add(figure.group);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width && height && (width !== this.size?.[0] || height !== this.size?.[1])) {
      this.renderer.setSize(width, height, false); // which clears the picture
      this.size = [width, height];
      this.changed = true;
    }
    const { top, bottom } = this.canvas.getBoundingClientRect();
    const edge = (selector, side, none) => document.querySelector(selector)?.getBoundingClientRect()[side] ?? none;
    const above = Math.max(edge(".stage header", "bottom", top), edge("#names", "bottom", top));
    this.covered = [above - top, bottom - edge(".looks", "top", bottom)];
  }

  /** Set up the camera so that its target is in the middle of the part that no controls cover. */
  frameFor(width, height) {
    const [top, bottom] = this.covered;
    const free = Math.max(0.5 * height, height - top - bottom);
    const degrees = FIELD * Math.max(1, NARROW / (width / free)) * (height / free);
    this.camera.aspect = width / height;
    this.camera.fov = Math.min(80, degrees);
    this.camera.setViewOffset(width, height, 0, (bottom - top) / 2, width, height);
  }

  /** Draw; `bare` leaves the ground out. */
  draw(bare) {
    this.changed = false;
    this.ground.visible = !bare;
    const { clientWidth, clientHeight: height } = this.canvas;
    const width = clientWidth / this.figures.length;
    this.frameFor(width, height);
    this.figures.forEach((figure, i) => {
      for (const other of this.figures) other.group.visible = other === figure;
      this.ground.material.uniforms.moved.value.fromArray(figure.walker.ground);
      this.renderer.setViewport(i * width, 0, width, height);
      this.renderer.setScissor(i * width, 0, width, height);
      this.renderer.render(this.scene, this.camera);
    });
  }
}

/**
 * Pixel ratio. Supersampling by 2 smooths edges, but would double the time of software rendering.
 */
function fineness(gl) {
  const told = gl.getExtension("WEBGL_debug_renderer_info");
  const name = told ? gl.getParameter(told.UNMASKED_RENDERER_WEBGL) : "";
  return /swiftshader|llvmpipe|software|basic render/i.test(name) ? Math.min(devicePixelRatio, 2) : 2;
}

/** From z up, with angles counted from the walker's right side towards its front, to three's y up; and back. */
const turned = (v) => v.set(v.x, v.z, -v.y);
const unturned = (v) => v.set(v.x, -v.z, v.y);

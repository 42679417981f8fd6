// A walker in 3D: tapered cylinders, a stick figure or point lights.

import {
  Color,
  CylinderGeometry,
  Group,
  InstancedMesh,
  LatheGeometry,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  Quaternion,
  SphereGeometry,
  SRGBColorSpace,
  Vector2,
  Vector3,
} from "three";
import { Cloud } from "./cloud.js";
import { arranged } from "./point_lights.js";
import { FALL, lit, shadow } from "./lighting.js";

const FINE = [18, 4]; // faces around a limb, and from its equator to its pole
const FINEST = [48, 16]; // of a head and its hair, which meet in a thin line
const SMOOTH = ["head", "hair"];
const BEHIND = 0.12; // [m] by which a body that hides dots is set back, so that none hides the dots inside it
const COARSE = [10, 2]; // of its shadow
const DOT = 0.017; // radii, shares of the height
const JOINT = 0.019;
const STICK = 0.009;
const LINE = 0.0028;
const UP = new Vector3(0, 1, 0);
const NOTHING = new Matrix4().makeScale(0, 0, 0); // of dots and lines that are unknown
const LEFT = "#b42318"; // as in reports
const RIGHT = "#175cd3";
const MIDDLE = "#8a929c";
const SECOND = [0.76, 0.42, 0.24]; // the shirt of walker B

/** The outline of a rounded cone along y: two spheres and the cone that touches both (motionenv.body.rounded_cone). */
function outline(length, start, end, cap) {
  const touch = Math.abs(start - end) < length ? Math.asin((start - end) / length) : Math.PI / 2;
  const points = [];
  const arc = (from, to, radius, centre) => {
    for (let i = 0; i <= cap; i++) {
      const latitude = from + ((to - from) * i) / cap;
      points.push(new Vector2(Math.max(0, radius * Math.cos(latitude)), centre + radius * Math.sin(latitude)));
    }
  };
  arc(-Math.PI / 2, touch, start, 0);
  arc(touch, Math.PI / 2, end, length);
  return points;
}

/** The material of a body that isn't seen and hides the dots behind it. */
function mask() {
  const material = new MeshBasicMaterial({ colorWrite: false });
  material.onBeforeCompile = (shader) => {
    const back = `gl_Position = projectionMatrix * vec4(mvPosition.xyz * (1.0 + ${BEHIND} / length(mvPosition.xyz)), 1.0);`;
    shader.vertexShader = shader.vertexShader.replace("#include <project_vertex>", `#include <project_vertex>\n${back}`);
  };
  return material;
}

const colour = (rgb) => new Color().setRGB(...rgb, SRGBColorSpace);

/** The meshes of a walker; `second` gives it another shirt. */
export class Figure {
  constructor(walker, second) {
    const { parameters } = walker;
    this.walker = walker;
    this.edges = parameters.edges;
    this.group = new Group();
    this.body = new Group();
    this.bodyShadow = new Group();
    this.group.add(this.body, this.bodyShadow);
    this.shadow = shadow();
    this.a = new Vector3();
    this.b = new Vector3();
    this.turn = new Quaternion();
    this.size = new Vector3();
    this.matrix = new Matrix4();
    this.places = new Float64Array(45);
    this.limbs = this.limbMeshes(parameters, second);
    this.lit = lit();
    this.mask = mask();
    this.plain = new MeshBasicMaterial();
    this.joints = this.instances(new SphereGeometry(1, 18, 12), parameters.markers.length);
    this.lines = this.instances(new CylinderGeometry(1, 1, 1, 10, 1), this.edges.length);
    this.cloud = walker.points ? new Cloud(walker) : null;
    if (this.cloud) this.group.add(this.cloud.mesh);
    this.tints = parameters.markers.map(sided);
    this.edgeTints = this.edges.map(([, far]) => sided(parameters.markers[far]));
  }

  limbMeshes(parameters, second) {
    const { walker } = this;
    walker.stand();
    this.builtFor = walker.body.height;
    return parameters.clothes.map((clothes, limb) => {
      const length = this.ends(limb);
      const rgb = second && clothes === "shirt" ? SECOND : parameters.colours[clothes];
      const material = lit(colour(rgb));
      const mesh = new Mesh(undefined, material);
      mesh.userData.length = length;
      mesh.userData.material = material;
      mesh.renderOrder = -1; // before the dots that it may hide
      this.body.add(mesh);
      this.bodyShadow.add(this.shadowOf(mesh, undefined));
      return mesh;
    });
  }

  /** Make the limbs as thick as the walker's body. */
  thicken() {
    const { radii } = this.walker.built ?? this.walker.body;
    const { parameters } = this.walker;
    if (radii === this.thickness) return;
    this.thickness = radii;
    this.limbs.forEach((mesh, limb) => {
      const [start, end] = radii.subarray(2 * limb, 2 * limb + 2).map((r) => r * this.builtFor);
      const shape = ([around, cap]) => new LatheGeometry(outline(mesh.userData.length, start, end, cap), around);
      const seen = SMOOTH.includes(parameters.limbs[limb]) ? FINEST : FINE;
      for (const [part, fine] of [[mesh, seen], [mesh.userData.shadow, COARSE]]) {
        part.geometry.dispose();
        part.geometry = shape(fine);
      }
    });
  }

  instances(geometry, count) {
    const mesh = new InstancedMesh(geometry, this.lit, count);
    const flat = new InstancedMesh(geometry, this.shadow, count);
    flat.instanceMatrix = mesh.instanceMatrix;
    flat.matrixAutoUpdate = false;
    flat.matrix.copy(FALL);
    mesh.userData.shadow = flat;
    mesh.frustumCulled = flat.frustumCulled = false;
    this.group.add(mesh, flat);
    return mesh;
  }

  /** The shadow of a limb, projected on the ground. */
  shadowOf(mesh, geometry) {
    const flat = new Mesh(geometry, this.shadow);
    flat.matrixAutoUpdate = false;
    flat.frustumCulled = false;
    mesh.userData.shadow = flat;
    return flat;
  }

  /** Set `a` and `b` to the ends of a limb; returns their distance. */
  ends(limb) {
    this.a.fromArray(this.walker.limbs, 6 * limb);
    this.b.fromArray(this.walker.limbs, 6 * limb + 3);
    return this.a.distanceTo(this.b);
  }

  /** Set the appearance: "body", "stick" or "points", with or without lines. */
  look({ figure, lines, inverted, scattered, hiding, markers }, moves) {
    const points = figure === "points";
    if (this.cloud) this.cloud.mesh.visible = markers && !points;
    this.moves = points && scattered ? moves : null;
    this.inverted = points && inverted;
    this.bodyShadow.visible = figure === "body";
    const hides = points && hiding && !inverted && !scattered; // a body is where its dots are only as they walked
    this.body.visible = figure === "body" || hides;
    for (const mesh of this.limbs) mesh.material = hides ? this.mask : mesh.userData.material;
    this.joints.visible = figure !== "body";
    this.lines.visible = figure === "stick" || (points && lines);
    for (const mesh of [this.joints, this.lines]) mesh.userData.shadow.visible = figure === "stick";
    this.radii = points ? [DOT, LINE] : [JOINT, STICK];
    for (const [mesh, tints] of [
      [this.joints, this.tints],
      [this.lines, this.edgeTints],
    ]) {
      mesh.material = points ? this.plain : this.lit;
      tints.forEach((tint, i) => mesh.setColorAt(i, points ? WHITE : tint));
      mesh.instanceColor.needsUpdate = true;
    }
  }

  /** Update the meshes from the walker. */
  update() {
    if (this.body.visible) this.updateBody();
    if (this.joints.visible) this.updateDots();
    if (this.cloud?.mesh.visible) this.cloud.update();
  }

  updateBody() {
    this.thicken();
    const wide = this.walker.body.height / this.builtFor;
    this.limbs.forEach((mesh, limb) => {
      const length = this.ends(limb);
      mesh.visible = mesh.userData.shadow.visible = Number.isFinite(length); // unknown limbs are NaN
      if (!mesh.visible) return;
      mesh.position.copy(this.a);
      mesh.quaternion.setFromUnitVectors(UP, this.b.sub(this.a).divideScalar(length));
      mesh.scale.set(wide, length / mesh.userData.length, wide);
      mesh.updateMatrix();
      mesh.userData.shadow.matrix.multiplyMatrices(FALL, mesh.matrix);
    });
  }

  updateDots() {
    const { height } = this.walker.body;
    const [dot, line] = this.radii.map((r) => r * height);
    const at = arranged(this.walker.markers, this.moves, this.inverted, height, this.places);
    this.turn.identity();
    this.size.setScalar(dot);
    for (let i = 0; i < this.tints.length; i++) {
      this.matrix.compose(this.a.fromArray(at, 3 * i), this.turn, this.size);
      this.joints.setMatrixAt(i, Number.isFinite(at[3 * i]) ? this.matrix : NOTHING);
    }
    this.joints.instanceMatrix.needsUpdate = true;
    if (!this.lines.visible) return;
    this.edges.forEach(([from, to], i) => {
      this.a.fromArray(at, 3 * from);
      this.b.fromArray(at, 3 * to);
      const length = this.a.distanceTo(this.b);
      if (!Number.isFinite(length)) {
        this.lines.setMatrixAt(i, NOTHING);
        return;
      }
      const middle = this.a.clone().lerp(this.b, 0.5);
      this.turn.setFromUnitVectors(UP, this.b.sub(this.a).divideScalar(length));
      this.lines.setMatrixAt(i, this.matrix.compose(middle, this.turn, this.size.set(line, length, line)));
    });
    this.lines.instanceMatrix.needsUpdate = true;
  }

  /** Free GPU resources. */
  dispose() {
    this.group.removeFromParent();
    this.group.traverse((part) => {
      part.geometry?.dispose();
      part.material?.dispose();
    });
    for (const mesh of this.limbs) mesh.userData.material.dispose();
    this.mask.dispose();
    this.lit.dispose();
    this.plain.dispose();
    this.shadow.dispose();
  }
}

const WHITE = new Color("#ffffff");
const TINTS = { left: new Color(LEFT), right: new Color(RIGHT), other: new Color(MIDDLE) };

function sided(name) {
  return TINTS[name.split("_")[0]] ?? TINTS.other;
}

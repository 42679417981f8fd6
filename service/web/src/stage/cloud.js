// The captured points over the body, also where it hides them.

import { InstancedMesh, Matrix4, MeshBasicMaterial, SphereGeometry } from "three";

const SIZE = 0.007; // radius, a share of the height
const COLOUR = "#d6246e";
const NOTHING = new Matrix4().makeScale(0, 0, 0); // of points in gaps

/** A sphere for each of a walker's `points`, NaN in gaps. */
export class Cloud {
  constructor(walker) {
    this.walker = walker;
    const material = new MeshBasicMaterial({ color: COLOUR, depthTest: false, transparent: true });
    this.mesh = new InstancedMesh(new SphereGeometry(1, 10, 6), material, walker.points.length / 3);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 1;
    this.matrix = new Matrix4();
  }

  /** Move the spheres to the points. */
  update() {
    const { points, body } = this.walker;
    const size = SIZE * body.height;
    for (let i = 0; i < points.length / 3; i++) {
      const [x, y, z] = points.subarray(3 * i, 3 * i + 3);
      this.matrix.makeScale(size, size, size).setPosition(x, y, z);
      this.mesh.setMatrixAt(i, Number.isFinite(x) ? this.matrix : NOTHING);
    }
    this.mesh.instanceMatrix.needsUpdate = true;
  }
}

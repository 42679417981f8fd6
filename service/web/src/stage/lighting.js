// Lighting: sky, ground and one sun, computed per vertex. Meshes are fine enough for that, and without a graphics card it
// takes half the time of lighting each pixel.

import {
  Color,
  Matrix4,
  MeshBasicMaterial,
  NotEqualStencilFunc,
  ReplaceStencilOp,
  ShaderMaterial,
  Vector3,
} from "three";

const SUN = new Vector3(2.2, -2.4, 5).normalize();

const LIT = {
  vertexShader: `uniform vec3 colour; uniform vec3 sun; uniform vec3 sunlight; uniform vec3 sky; uniform vec3 earth;
    varying vec3 shade;
    void main() {
      mat4 place = modelMatrix;
      vec3 tint = colour;
      #ifdef USE_INSTANCING
        place = modelMatrix * instanceMatrix;
      #endif
      #ifdef USE_INSTANCING_COLOR
        tint = instanceColor;
      #endif
      mat3 m = mat3(place);
      vec3 n = normalize(m * (normal / vec3(dot(m[0], m[0]), dot(m[1], m[1]), dot(m[2], m[2]))));
      vec3 light = tint * (mix(earth, sky, 0.5 * n.z + 0.5) + max(dot(n, sun), 0.0) * sunlight);
      shade = mix(1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, 12.92 * light, vec3(lessThan(light, vec3(0.0031308))));
      gl_Position = projectionMatrix * viewMatrix * place * vec4(position, 1.0);
    }`,
  fragmentShader: `varying vec3 shade;
    void main() { gl_FragColor = vec4(shade, 1.0); }`,
};

/** A lit material. */
export function lit(colour = new Color("#ffffff")) {
  const uniforms = {
    colour: { value: colour },
    sun: { value: SUN },
    sunlight: { value: new Color("#fff6ea").multiplyScalar(0.76) },
    sky: { value: new Color("#f3f7fb").multiplyScalar(0.67) },
    earth: { value: new Color("#8d8a86").multiplyScalar(0.67) },
  };
  return new ShaderMaterial({ ...LIT, uniforms });
}

/** Projection along the sunlight to just above the ground. */
export const FALL = new Matrix4().set(1, 0, -SUN.x / SUN.z, 0, 0, 1, -SUN.y / SUN.z, 0, 0, 0, 0, 0.002, 0, 0, 0, 1);

/** The material of shadows: overlapping ones are drawn once (stencil). */
export function shadow() {
  return new MeshBasicMaterial({
    color: "#000000",
    transparent: true,
    opacity: 0.24,
    depthWrite: false,
    stencilWrite: true,
    stencilRef: 1,
    stencilFunc: NotEqualStencilFunc,
    stencilZPass: ReplaceStencilOp,
  });
}

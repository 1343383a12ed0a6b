// How faces, lines and points look: flat shading, colours from a map, thin lines along the sides of faces.

import {
  ClampToEdgeWrapping,
  Color,
  DataTexture,
  DoubleSide,
  LinearFilter,
  NearestFilter,
  RGBAFormat,
  ShaderMaterial,
  UnsignedByteType,
  Vector2,
} from "three";

const VERTEX = `
attribute float value;
attribute vec4 rim;
varying vec3 place;
varying float shade;
varying vec4 side;
void main() {
  vec4 seen = modelViewMatrix * vec4(position, 1.0);
  place = seen.xyz;
  shade = value;
  side = rim;
  gl_Position = projectionMatrix * seen;
}`;

const FRAGMENT = `
uniform sampler2D map;
uniform vec2 range;
uniform vec3 plain;
uniform vec3 ink;
uniform vec3 folded;
uniform float marksFolded;
uniform float edges;
uniform float opacity;
uniform float width;
varying vec3 place;
varying float shade;
varying vec4 side;
void main() {
  vec3 colour = plain;
#ifndef PLAIN
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float light = 0.62 + 0.32 * abs(normal.z) + 0.12 * max(dot(normal, vec3(-0.45, 0.7, 0.55)), 0.0);
  float t = (shade - range.x) / max(range.y - range.x, 1e-30);
  if (shade > -9e29) colour = texture2D(map, vec2(clamp(t, 0.001, 0.999), 0.5)).rgb;
  if (marksFolded > 0.5 && shade <= 0.0 && shade > -9e29) colour = folded;
  colour *= light;
#endif
  if (edges > 0.0) {
    vec4 pixel = fwidth(side) * width;
    vec4 far = side / max(pixel, vec4(1e-6));
    float nearest = min(min(far.x, far.y), min(far.z, far.w));
    float line = 1.0 - smoothstep(0.2, 1.0, nearest);
    float tiny = max(max(pixel.x, pixel.y), max(pixel.z, pixel.w));
    line *= 1.0 - smoothstep(0.1, 0.45, tiny); // cells of a few pixels would be all line
    colour = mix(colour, ink, line * edges);
  }
  gl_FragColor = vec4(colour, opacity);
}`;

/** A material for faces; see its uniforms. One that one can see through has one colour, and is not lit. */
export function faceMaterial({ opacity = 1, edges = 0.62, offset = 1 } = {}) {
  return new ShaderMaterial({
    defines: opacity < 1 ? { PLAIN: 1 } : {},
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    side: DoubleSide,
    transparent: opacity < 1,
    depthWrite: opacity === 1,
    polygonOffset: true,
    polygonOffsetFactor: offset,
    polygonOffsetUnits: offset,
    uniforms: {
      map: { value: null },
      range: { value: new Vector2(0, 1) },
      plain: { value: new Color("#9aa7b0") },
      ink: { value: new Color("#20262e") },
      folded: { value: new Color("#7b1fa2") },
      marksFolded: { value: 0 },
      edges: { value: edges },
      opacity: { value: opacity },
      width: { value: 1 },
    },
  });
}

/** A material for round points of so many pixels. */
export function pointMaterial(size) {
  return new ShaderMaterial({
    vertexShader: `uniform float size;
      void main() {
        gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
        gl_Position.z -= 0.0005 * gl_Position.w;
        gl_PointSize = size;
      }`,
    fragmentShader: `uniform vec3 ink;
      void main() {
        if (length(gl_PointCoord - 0.5) > 0.5) discard;
        gl_FragColor = vec4(ink, 1.0);
      }`,
    uniforms: { ink: { value: new Color("#20262e") }, size: { value: size } },
  });
}

/** A colour map as a texture, from its (k, 3) bytes; `steps`: colours of regions, not blended. */
export function mapTexture(bytes, steps = false) {
  const count = bytes.length / 3;
  const data = new Uint8Array(4 * count).fill(255);
  for (let k = 0; k < count; k += 1) data.set(bytes.slice(3 * k, 3 * k + 3), 4 * k);
  const texture = new DataTexture(data, count, 1, RGBAFormat, UnsignedByteType);
  texture.magFilter = steps ? NearestFilter : LinearFilter;
  texture.minFilter = steps ? NearestFilter : LinearFilter;
  texture.wrapS = ClampToEdgeWrapping;
  texture.needsUpdate = true;
  return texture;
}

// Materials of the scene. Lines have widths and least and largest lengths in pixels, so they stay legible at any zoom.
import * as THREE from '/three/build/three.module.js';

const COMMON = `
  uniform vec2 viewport;
  uniform float pixels;   // per unit at distance one
  uniform float size;     // length of an axis
  vec3 turned(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
  // The length of an axis at a place: as in the world, but from 5 to 54 pixels.
  float lengthAt(vec3 place) {
    float unit = pixels / max(1e-9, -(viewMatrix * vec4(place, 1.0)).z);
    return clamp(size * unit, 5.0, 54.0) / unit;
  }
  // A corner of the line between two places.
  vec4 line(vec3 from, vec3 to, float end, float side, float width) {
    vec4 a = projectionMatrix * viewMatrix * vec4(from, 1.0);
    vec4 b = projectionMatrix * viewMatrix * vec4(to, 1.0);
    const float near = 1e-6;
    if (a.w < near && b.w > near) a = mix(b, a, 0.999 * (b.w - near) / (b.w - a.w));
    if (b.w < near && a.w > near) b = mix(a, b, 0.999 * (a.w - near) / (a.w - b.w));
    vec2 along = (b.xy / b.w - a.xy / a.w) * viewport;
    vec2 across = length(along) > 1e-4 ? normalize(vec2(-along.y, along.x)) : vec2(0.0, 1.0);
    vec4 place = mix(a, b, end);
    place.xy += across * side * width / viewport * place.w;
    return place;
  }`;

function material(uniforms, vertexShader, fragmentShader, options = {}) {
  return new THREE.ShaderMaterial({
    uniforms: { viewport: { value: new THREE.Vector2(1, 1) }, pixels: { value: 1 }, size: { value: 1 }, ...uniforms },
    vertexShader: COMMON + vertexShader,
    fragmentShader,
    transparent: true,
    depthWrite: false,
    side: THREE.DoubleSide,
    ...options,
  });
}

const axisColours = () => ({
  axisX: { value: new THREE.Color() }, axisY: { value: new THREE.Color() }, axisZ: { value: new THREE.Color() } });

export function linkMaterial() {
  return material({}, `
    attribute vec3 corner; attribute vec3 from; attribute vec3 to; attribute vec4 colour;
    varying vec4 shade; varying float across;
    void main() {
      shade = colour;
      across = corner.z;
      gl_Position = line(from, to, corner.y, corner.z, colour.a > 0.99 ? 4.5 : 2.6);
    }`, `
    varying vec4 shade; varying float across;
    void main() { gl_FragColor = vec4(shade.rgb, shade.a * smoothstep(1.0, 0.45, abs(across))); }`);
}

export function axesMaterial() {
  return material(axisColours(), `
    attribute vec3 corner; attribute vec3 origin; attribute vec4 quaternion; attribute vec2 look;
    uniform vec3 axisX; uniform vec3 axisY; uniform vec3 axisZ;
    varying vec4 shade; varying float across;
    void main() {
      vec3 axis = corner.x < 0.5 ? vec3(1, 0, 0) : corner.x < 1.5 ? vec3(0, 1, 0) : vec3(0, 0, 1);
      vec3 base = corner.x < 0.5 ? axisX : corner.x < 1.5 ? axisY : axisZ;
      float grey = dot(base, vec3(0.3, 0.5, 0.2));
      shade = vec4(look.y < 0.0 ? vec3(mix(grey, 0.5, 0.6)) : base, abs(look.y));
      across = corner.z;
      vec3 tip = origin + turned(quaternion, axis) * lengthAt(origin) * look.x;
      bool small = size * pixels < -24.0 * (viewMatrix * vec4(origin, 1.0)).z;
      gl_Position = line(origin, tip, corner.y, corner.z, look.x > 1.0 ? 5.0 : small ? 2.6 : 3.6);
    }`, `
    varying vec4 shade; varying float across;
    void main() { gl_FragColor = vec4(shade.rgb, shade.a * smoothstep(1.0, 0.5, abs(across))); }`);
}

export function pointMaterial() {
  return material({}, `
    attribute vec3 corner; attribute vec3 origin; attribute vec4 colour;
    varying vec4 shade; varying vec2 at;
    void main() {
      shade = colour;
      at = vec2(2.0 * corner.y - 1.0, corner.z);
      gl_Position = projectionMatrix * viewMatrix * vec4(origin, 1.0);
      gl_Position.xy += at * (colour.a > 1.5 ? 13.0 : 7.0) / viewport * gl_Position.w;
    }`, `
    varying vec4 shade; varying vec2 at;
    void main() {
      float r = length(at);
      float alpha = smoothstep(1.0, 0.8, r);
      if (shade.a > 1.5) alpha *= r > 0.62 || r < 0.42 ? 1.0 : 0.15;
      gl_FragColor = vec4(shade.rgb, alpha);
    }`);
}

// The tip of an axis e moves to Exp(δθ) e. The ring has δθ at k standard deviations in the plane across e: errors are
// expressed in the frame itself, so their covariance there is a block of the given one.
export function coneMaterial() {
  return material({ k: { value: 3 }, ...axisColours() }, `
    attribute vec3 corner; attribute vec3 origin; attribute vec4 quaternion;
    attribute vec3 sigmaDiagonal; attribute vec3 sigmaOff; attribute vec4 colour;
    uniform float k; uniform vec3 axisX; uniform vec3 axisY; uniform vec3 axisZ;
    varying vec4 shade; varying float rim; varying float unknown;
    void main() {
      vec3 e = vec3(1, 0, 0), u = vec3(0, 1, 0), v = vec3(0, 0, 1), base = axisX;
      vec3 block = vec3(sigmaDiagonal.y, sigmaOff.z, sigmaDiagonal.z);
      if (corner.x > 1.5) {
        e = vec3(0, 0, 1); u = vec3(1, 0, 0); v = vec3(0, 1, 0); base = axisZ;
        block = vec3(sigmaDiagonal.x, sigmaOff.x, sigmaDiagonal.y);
      } else if (corner.x > 0.5) {
        e = vec3(0, 1, 0); u = vec3(0, 0, 1); v = vec3(1, 0, 0); base = axisY;
        block = vec3(sigmaDiagonal.z, sigmaOff.y, sigmaDiagonal.x);
      }
      float a = sqrt(max(block.x, 0.0));
      float b = a > 0.0 ? block.y / a : 0.0;
      float c = sqrt(max(block.z - b * b, 0.0));
      float mean = 0.5 * (block.x + block.z);
      float largest = mean + sqrt(max(0.0, mean * mean - block.x * block.z + block.y * block.y));
      unknown = 3.0 * sqrt(max(0.0, largest)) > 3.14159 ? 1.0 : 0.0;
      vec2 around = vec2(cos(corner.y), sin(corner.y));
      vec3 turn = k * (a * around.x * u + (b * around.x + c * around.y) * v);
      float angle = min(length(turn), 3.14159);
      vec3 tip = e;
      if (angle > 1e-6) {
        vec3 about = normalize(turn);
        tip = e * cos(angle) + cross(about, e) * sin(angle) + about * dot(about, e) * (1.0 - cos(angle));
      }
      if (unknown > 0.5) tip = around.x * u + around.y * v;
      rim = corner.z;
      shade = vec4(base, colour.a);
      vec3 place = origin + corner.z * turned(quaternion, tip) * lengthAt(origin) * colour.r;
      gl_Position = projectionMatrix * viewMatrix * vec4(place, 1.0);
    }`, `
    varying vec4 shade; varying float rim; varying float unknown;
    void main() {
      float alpha = rim > 0.94 ? 0.75 : 0.08 + 0.3 * rim * rim;
      // If 3 standard deviations are half a turn, the axis may point anywhere: a hatched disc across it.
      if (unknown > 0.5) alpha = mod(gl_FragCoord.x + gl_FragCoord.y, 7.0) < 2.0 ? 0.6 : 0.05;
      gl_FragColor = vec4(shade.rgb, shade.a * alpha);
    }`);
}

// The unit sphere times a matrix. Its columns need not be the principal axes: any A with A·Aᵀ = k²Σ gives the same
// surface. Normals are transformed by the matrix of cofactors, which is right if an axis has no length, too.
export function ellipsoidMaterial() {
  return material({}, `
    attribute vec3 origin; attribute vec3 axis0; attribute vec3 axis1; attribute vec3 axis2; attribute vec4 colour;
    varying vec4 shade; varying vec3 normalSeen; varying vec3 eye;
    void main() {
      // At least a pixel, so that what is flat or tiny can still be seen.
      float least = 0.75 / pixels * max(1e-9, -(viewMatrix * vec4(origin, 1.0)).z);
      vec3 place = axis0 * position.x + axis1 * position.y + axis2 * position.z;
      vec3 n = cross(axis1, axis2) * position.x + cross(axis2, axis0) * position.y + cross(axis0, axis1) * position.z;
      float flatness = length(n);
      n = flatness > 1e-30 ? n / flatness : position;
      vec4 seen = viewMatrix * vec4(origin + place + n * least, 1.0);
      normalSeen = mat3(viewMatrix) * n;
      eye = -seen.xyz;
      shade = colour;
      gl_Position = projectionMatrix * seen;
    }`, `
    varying vec4 shade; varying vec3 normalSeen; varying vec3 eye;
    void main() {
      float facing = abs(dot(normalize(normalSeen), normalize(eye)));
      float rim = pow(1.0 - facing, 2.0);
      vec3 lit = mix(shade.rgb, vec3(1.0), 0.18 * rim);
      gl_FragColor = vec4(lit, shade.a * (0.15 + 0.62 * rim));
    }`, { side: THREE.FrontSide });
}

"use strict";
// Materials: one shader for cells, surfaces and cards, so that a colour means the same everywhere.
const MG = {};

MG.colours = null; // of the page, from its first model

MG.rgb = (hex) => new THREE.Vector3(...[1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255));

// Class of a cell: 0 by its value, 1 invalid, 2 degenerate, 3 without a value.
MG.shade = (value, poor) => {
  const usual = MG.colours.poorBelow; // where the scale of the colours has it
  if (poor === usual || !(value >= 0)) return value;
  return value < poor ? (value * usual) / poor : 1 - ((1 - value) * (1 - usual)) / (1 - poor);
};

MG.classOf = (value, status) => status.class || (Number.isNaN(value) ? 3 : 0);

const VERTEX = `
in vec3 aBary;
out vec3 vBary;
out vec3 vView;
out vec3 vModel;
flat out float vShade;
flat out float vClass;
flat out float vPicked;
flat out float vId;
#ifdef CELLS
in float aCell;
uniform highp sampler2D uCells;
uniform float uLimit, uShrink, uPickedCell;
uniform int uFiltered;
uniform vec4 uPlane;
#else
in float aCell;
in vec2 aData;
#endif
void main() {
  vec3 place = position;
  vId = aCell;
  vPicked = 0.0;
#ifdef CELLS
  int at = 2 * int(aCell + 0.5);
  int width = textureSize(uCells, 0).x;
  vec4 one = texelFetch(uCells, ivec2(at % width, at / width), 0);
  vec4 two = texelFetch(uCells, ivec2((at + 1) % width, (at + 1) / width), 0);
  float value = one.w;
  vShade = two.z;
  vClass = two.x;
  place = mix(place, one.xyz, uShrink);
  vPicked = abs(uPickedCell - aCell) < 0.5 ? 1.0 : 0.0;
  bool shown = uFiltered == 1 ? two.y > 0.5 : (value < uLimit || uLimit >= 1.0 || vClass > 0.5);
  if (dot(uPlane.xyz, one.xyz) > uPlane.w) shown = false;
  if (!shown) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return;
  }
#else
  vShade = aData.x;
  vClass = aData.y;
#endif
  vBary = aBary;
  vModel = place;
  vec4 view = modelViewMatrix * vec4(place, 1.0);
  vView = view.xyz;
  gl_Position = projectionMatrix * view;
}`;

const FRAGMENT = `
precision highp float;
in vec3 vBary;
in vec3 vView;
in vec3 vModel;
flat in float vShade;
flat in float vClass;
flat in float vPicked;
flat in float vId;
out vec4 colour;
uniform vec3 uStops[6];
uniform float uAt[6];
uniform vec3 uInvalid, uDegenerate, uUnknown, uGhost, uLine;
uniform float uPixel, uOpacity, uEdge, uEdgeOpacity;
uniform int uPick, uStyle; // style 0: by quality, 1: ghost
#ifndef CELLS
uniform vec4 uPlane;
#else
uniform highp sampler3D uHollows;
uniform vec3 uHollowsLow, uHollowsScale;
uniform float uHollowsBox, uDark;
#endif
vec3 scale(float v) {
  vec3 c = uStops[0];
  for (int i = 1; i < 6; i++) c = mix(c, uStops[i], clamp((v - uAt[i - 1]) / (uAt[i] - uAt[i - 1]), 0.0, 1.0));
  return c;
}
void main() {
#ifndef CELLS
  if (dot(uPlane.xyz, vModel) > uPlane.w) discard;
#endif
  if (uPick == 1) {
    float id = vId + 1.0;
    colour = vec4(mod(id, 256.0), mod(floor(id / 256.0), 256.0), floor(id / 65536.0), 255.0) / 255.0;
    return;
  }
  vec3 n = normalize(cross(dFdx(vView), dFdy(vView)));
  float side = n.z < 0.0 ? -1.0 : 1.0;
  n *= side;
  vec3 thin = fwidth(vBary);
  vec3 line = 1.0 - smoothstep(thin * max(uEdge - 0.5, 0.0), thin * (uEdge + 0.7), vBary);
  // Lines of triangles that are hardly larger than a pixel would only make the surface grey.
  float edge = max(line.x, max(line.y, line.z)) * (1.0 - smoothstep(0.2, 0.6, max(thin.x, max(thin.y, thin.z))));
  if (uStyle == 1) {
    float rim = pow(1.0 - abs(dot(n, normalize(-vView))), 2.5);
    colour = vec4(mix(uGhost, uLine, edge * 0.6), uOpacity * (0.35 + 2.2 * rim) + edge * uEdgeOpacity);
    return;
  }
  vec3 base = scale(vShade);
  if (vClass > 0.5) {
    base = vClass < 1.5 ? uInvalid : vClass < 2.5 ? uDegenerate : uUnknown;
    float stripe = abs(fract((gl_FragCoord.x + gl_FragCoord.y) / (10.0 * uPixel)) - 0.5);
    base = mix(base, vec3(1.0), smoothstep(0.36, 0.40, stripe));
  }
  float light = 0.70 + 0.30 * max(dot(n, normalize(vec3(-0.45, 0.7, 0.75))), 0.0) + 0.10 * max(dot(n, normalize(vec3(0.8, -0.1, 0.5))), 0.0);
#ifdef CELLS
  if (uDark > 0.0) {
    vec3 outward = side * normalize(cross(dFdx(vModel), dFdy(vModel)));
    vec3 at = (vModel - uHollowsLow) * uHollowsScale;
    vec3 ahead = outward * uHollowsBox * uHollowsScale;
    // So far that what lies behind the face itself is not seen there.
    float full = 0.3 * texture(uHollows, at + 4.0 * ahead).r + 0.3 * texture(uHollows, at + 6.0 * ahead).g + 0.4 * texture(uHollows, at + 10.0 * ahead).b;
    light *= 1.0 - uDark * min(1.6 * full, 1.0);
  }
#endif
  vec3 lit = base * light;
  vec3 edged = mix(lit, vPicked > 0.5 ? vec3(0.0) : lit * 0.35, edge * (vPicked > 0.5 ? 1.0 : uEdgeOpacity));
  colour = vec4(edged, uOpacity + edge * (1.0 - uOpacity) * 0.8);
}`;

const MARK_VERTEX = `
in float aClass;
in vec2 aOf; // how far its cells reach about it, and how many they are
uniform float uPixel, uSize;
uniform vec4 uPlane;
flat out float vClass;
flat out float vSize;
void main() {
  vClass = aClass;
  vSize = uSize * (1.0 + 0.16 * log2(max(aOf.y, 1.0)) / 2.0);
  vec4 place = modelViewMatrix * vec4(position, 1.0);
  gl_Position = projectionMatrix * place;
  // Its own cells do not hide it, those before them do.
  vec4 front = projectionMatrix * vec4(place.xy, place.z + aOf.x, 1.0);
  if (front.w > 0.0) gl_Position.z = front.z / front.w * gl_Position.w;
  gl_PointSize = vSize * uPixel;
  if (dot(uPlane.xyz, position) > uPlane.w) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}`;

// A cross for a cell that is not valid, a ring for a node or for the cell that was picked.
const MARK_FRAGMENT = `
precision highp float;
flat in float vClass;
flat in float vSize;
out vec4 colour;
uniform vec3 uInvalid, uDegenerate, uUnknown, uHalo, uInk;
uniform float uPixel;
uniform int uRing;
void main() {
  vec2 p = (gl_PointCoord - 0.5) * vSize;
  float d;
  vec3 ink = vClass < 1.5 ? uInvalid : vClass < 2.5 ? uDegenerate : uUnknown;
  if (uRing == 1) {
    d = min(abs(length(p) - vSize * 0.34), length(p) - 1.0);
    ink = uInk;
  } else {
    float reach = vSize * 0.23;
    vec2 q = abs(p);
    d = abs(q.x - q.y) * 0.7071 + max(max(q.x, q.y) - reach, 0.0);
  }
  float body = 1.0 - smoothstep(1.1, 1.8, d);
  // The cross is on a white disc with a rim, the ring has a white seam: seen on any ground.
  float disc = vSize * 0.5 - 0.5 - length(p);
  float halo = uRing == 1 ? 1.0 - smoothstep(2.2, 3.2, d) : smoothstep(0.0, 1.0, disc);
  if (uRing == 0) body = max(body, (1.0 - smoothstep(1.0, 1.8, disc)) * halo);
  if (halo < 0.01) discard;
  colour = vec4(mix(uHalo, ink, body), max(body * halo, halo * 0.95));
}`;

MG.NO_PLANE = () => new THREE.Vector4(0, 0, 0, 1);

MG.paint = () => {
  const c = MG.colours;
  return {
    uStops: { value: c.stops.map((stop) => MG.rgb(stop[1])) },
    uAt: { value: c.stops.map((stop) => stop[0]) },
    uInvalid: { value: MG.rgb(c.invalid) },
    uDegenerate: { value: MG.rgb(c.degenerate) },
    uUnknown: { value: MG.rgb(c.unknown) },
  };
};

MG.material = ({ cells = false, style = 0, opacity = 1, edge = 0.6, edgeOpacity = 0.75, plane, texture, side, depthWrite }) =>
  new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3,
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    defines: cells ? { CELLS: 1 } : {},
    side: side === undefined ? THREE.DoubleSide : side,
    transparent: opacity < 1,
    depthWrite: depthWrite === undefined ? opacity >= 1 : depthWrite,
    polygonOffset: style === 1 || !cells,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
    uniforms: {
      ...MG.paint(),
      uGhost: { value: MG.rgb(MG.colours.ghost) },
      uLine: { value: MG.rgb(MG.colours.edge) },
      uPixel: { value: 1 },
      uOpacity: { value: opacity },
      uEdge: { value: edge },
      uEdgeOpacity: { value: edgeOpacity },
      uPick: { value: 0 },
      uStyle: { value: style },
      uPlane: { value: plane || MG.NO_PLANE() },
      uCells: { value: texture || null },
      uLimit: { value: 1 },
      uShrink: { value: 0 },
      uPickedCell: { value: -1 },
      uFiltered: { value: 0 },
      uHollows: { value: null },
      uHollowsLow: { value: new THREE.Vector3() },
      uHollowsScale: { value: new THREE.Vector3(1, 1, 1) },
      uHollowsBox: { value: 0 },
      uDark: { value: 0 },
    },
  });

MG.markMaterial = ({ size, ring = 0, plane }) =>
  new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3,
    vertexShader: MARK_VERTEX,
    fragmentShader: MARK_FRAGMENT,
    transparent: true,
    depthTest: !ring,
    depthWrite: false,
    uniforms: {
      ...MG.paint(),
      uHalo: { value: new THREE.Vector3(1, 1, 1) },
      uInk: { value: new THREE.Vector3(0.05, 0.05, 0.08) },
      uPixel: { value: 1 },
      uSize: { value: size },
      uRing: { value: ring },
      uPlane: { value: plane || MG.NO_PLANE() },
    },
  });

// What the page uses of three.js; `build.sh` bundles it. Only what is named here is shipped.
export {
  BufferAttribute,
  BufferGeometry,
  Data3DTexture,
  DataTexture,
  DoubleSide,
  FloatType,
  GLSL3,
  LinearFilter,
  Mesh,
  PerspectiveCamera,
  Points,
  RGBAFormat,
  Scene,
  ShaderMaterial,
  Vector3,
  Vector4,
  WebGLRenderer,
  WebGLRenderTarget,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
export { gunzipSync } from "three/examples/jsm/libs/fflate.module.js";

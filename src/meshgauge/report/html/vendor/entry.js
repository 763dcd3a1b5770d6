// What the page uses of three.js; `build.sh` bundles it. Only what is named here is shipped.
export {
  AmbientLight,
  BufferAttribute,
  BufferGeometry,
  Color,
  DataTexture,
  DoubleSide,
  FloatType,
  GLSL3,
  LineSegments,
  Mesh,
  NearestFilter,
  OrthographicCamera,
  PerspectiveCamera,
  Points,
  RGBAFormat,
  Scene,
  ShaderMaterial,
  Vector2,
  Vector3,
  Vector4,
  WebGLRenderer,
  WebGLRenderTarget,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
export { gunzipSync } from "three/examples/jsm/libs/fflate.module.js";

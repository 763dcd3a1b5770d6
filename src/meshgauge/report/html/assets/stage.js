// One WebGL context draws every picture of the page: browsers allow few, and a copy on an ordinary canvas can be printed.

MG.stage = (() => {
  let renderer;
  let target;
  let width = 0;
  let height = 0;
  const make = () => {
    if (renderer === undefined) {
      try {
        renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, powerPreference: "high-performance" });
        renderer.setPixelRatio(1);
        renderer.setClearColor(0x000000, 0);
        renderer.outputColorSpace = "srgb-linear"; // our shaders write what is to be seen
        renderer.autoClear = false;
      } catch {
        renderer = null;
      }
    }
    return renderer;
  };
  return {
    get works() {
      return Boolean(make());
    },
    draw(scene, camera, canvas) {
      const gl = make();
      if (canvas.width > width || canvas.height > height) {
        width = Math.max(width, canvas.width);
        height = Math.max(height, canvas.height);
        gl.setSize(width, height, false);
      }
      gl.setRenderTarget(null);
      gl.setViewport(0, 0, canvas.width, canvas.height);
      gl.setScissor(0, 0, canvas.width, canvas.height);
      gl.setScissorTest(true);
      gl.clear();
      gl.render(scene, camera);
      const flat = canvas.getContext("2d");
      flat.clearRect(0, 0, canvas.width, canvas.height);
      flat.drawImage(gl.domElement, 0, height - canvas.height, canvas.width, canvas.height, 0, 0, canvas.width, canvas.height);
      return flat;
    },
    // The id that is drawn at a place of the canvas, -1 for none.
    pick(scene, camera, canvas, x, y) {
      const gl = make();
      target = target || new THREE.WebGLRenderTarget(1, 1);
      camera.setViewOffset(canvas.width, canvas.height, x, y, 1, 1);
      gl.setScissorTest(false);
      gl.setRenderTarget(target);
      gl.setViewport(0, 0, 1, 1);
      gl.clear();
      gl.render(scene, camera);
      const pixel = new Uint8Array(4);
      gl.readRenderTargetPixels(target, 0, 0, 1, 1, pixel);
      gl.setRenderTarget(null);
      camera.clearViewOffset();
      return pixel[0] + 256 * pixel[1] + 65536 * pixel[2] - 1;
    },
  };
})();

// A canvas with a scene that can be turned. It is drawn when something changed and it is in sight.
class View {
  // `distance` from the target, or `around`: the corners of a box that the picture is to hold.
  constructor(canvas, { distance, around, from, zooms }) {
    this.canvas = canvas;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(30, 1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.home = { target: new THREE.Vector3(), from: new THREE.Vector3(...from).normalize(), distance, around };
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.enableZoom = zooms;
    this.controls.zoomToCursor = true;
    this.controls.addEventListener("change", () => this.request());
    canvas.style.touchAction = "pan-y";
    this.isSeen = false;
    this.reset();
    new IntersectionObserver((entries) => {
      this.isSeen = entries[entries.length - 1].isIntersecting;
      if (this.isSeen) this.request();
    }, { rootMargin: "200px" }).observe(canvas);
    this.controls.addEventListener("start", () => (this.isHome = false));
    new ResizeObserver(() => (this.isHome && !this.home.distance ? this.reset() : this.request())).observe(canvas);
    canvas.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("beforeprint", () => this.draw());
  }
  reset() {
    this.controls.target.copy(this.home.target);
    this.camera.position.copy(this.home.target).addScaledVector(this.home.from, this.home.distance || this.fitting());
    this.controls.update();
    this.isHome = true;
    this.request();
  }
  // The distance from which the box just fills the picture.
  fitting() {
    const { from, around } = this.home;
    const right = new THREE.Vector3().crossVectors(this.camera.up, from).normalize();
    const up = new THREE.Vector3().crossVectors(from, right);
    const slope = Math.tan(Math.PI / 12) * 0.88;
    const aspect = this.canvas.clientWidth / this.canvas.clientHeight || 1;
    const [wide, high] = aspect < 1 ? [slope, slope / aspect] : [slope * aspect, slope];
    return Math.max(
      ...around.map((corner) => {
        const place = new THREE.Vector3(...corner);
        return place.dot(from) + Math.max(Math.abs(place.dot(right)) / wide, Math.abs(place.dot(up)) / high);
      }),
    );
  }
  // Look at a place from the present side.
  goTo(place, distance) {
    this.isHome = false;
    const offset = this.camera.position.clone().sub(this.controls.target).setLength(distance);
    this.controls.target.copy(place);
    this.camera.position.copy(place).add(offset);
    this.controls.update();
    this.request();
  }
  turn(around, up) {
    this.isHome = false;
    const offset = this.camera.position.clone().sub(this.controls.target);
    const length = offset.length();
    let polar = Math.acos(offset.z / length) + up;
    const azimuth = Math.atan2(offset.y, offset.x) + around;
    polar = Math.min(Math.max(polar, 0.02), Math.PI - 0.02);
    offset.set(Math.sin(polar) * Math.cos(azimuth), Math.sin(polar) * Math.sin(azimuth), Math.cos(polar)).multiplyScalar(length);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.request();
  }
  zoom(factor) {
    this.isHome = false;
    this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
    this.controls.update();
    this.request();
  }
  key(event) {
    const step = 0.12;
    const does = {
      ArrowLeft: () => this.turn(-step, 0),
      ArrowRight: () => this.turn(step, 0),
      ArrowUp: () => this.turn(0, -step),
      ArrowDown: () => this.turn(0, step),
      "+": () => this.zoom(0.85),
      "=": () => this.zoom(0.85),
      "-": () => this.zoom(1 / 0.85),
      0: () => this.reset(),
    }[event.key];
    if (!does || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    does();
  }
  request() {
    if (this.isWaiting || !this.isSeen) return;
    this.isWaiting = true;
    requestAnimationFrame(() => {
      this.isWaiting = false;
      this.draw();
    });
  }
  fit() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [w, h] = [Math.round(this.canvas.clientWidth * ratio), Math.round(this.canvas.clientHeight * ratio)];
    if (w && h && (this.canvas.width !== w || this.canvas.height !== h)) {
      this.canvas.width = w;
      this.canvas.height = h;
    }
    const distance = this.camera.position.distanceTo(this.controls.target);
    const aspect = this.canvas.width / this.canvas.height;
    this.camera.aspect = aspect;
    // A narrow picture shows as much from side to side as a square one does.
    this.camera.fov = aspect < 1 ? (360 / Math.PI) * Math.atan(Math.tan(Math.PI / 12) / aspect) : 30;
    this.camera.near = distance * 0.02;
    this.camera.far = distance + 8;
    this.camera.updateProjectionMatrix();
    this.scene.traverse((item) => {
      if (item.material && item.material.uniforms) item.material.uniforms.uPixel.value = ratio;
    });
    return ratio;
  }
  draw() {
    if (!this.canvas.clientWidth) return;
    const ratio = this.fit();
    if (this.before) this.before();
    const flat = MG.stage.draw(this.scene, this.camera, this.canvas);
    if (this.hasAxes) this.axes(flat, ratio);
    this.canvas.dataset.drawn = String(Number(this.canvas.dataset.drawn || 0) + 1);
  }
  axes(flat, ratio) {
    const style = getComputedStyle(this.canvas);
    const [x, y, length] = [34 * ratio, this.canvas.height - 34 * ratio, 22 * ratio];
    flat.fillStyle = style.getPropertyValue("--card");
    flat.globalAlpha = 0.78;
    flat.beginPath();
    flat.arc(x, y, 31 * ratio, 0, 2 * Math.PI);
    flat.fill();
    flat.globalAlpha = 1;
    flat.font = `600 ${11 * ratio}px system-ui, sans-serif`;
    flat.textAlign = "center";
    flat.textBaseline = "middle";
    flat.lineWidth = 1.5 * ratio;
    flat.strokeStyle = flat.fillStyle = style.color;
    const back = this.camera.quaternion.clone().invert();
    "XYZ".split("").forEach((name, k) => {
      const axis = new THREE.Vector3(Number(k === 0), Number(k === 1), Number(k === 2)).applyQuaternion(back);
      flat.globalAlpha = 0.55 + 0.4 * Math.max(axis.z, 0);
      flat.beginPath();
      flat.moveTo(x, y);
      flat.lineTo(x + axis.x * length, y - axis.y * length);
      flat.stroke();
      flat.fillText(name, x + axis.x * length * 1.42, y - axis.y * length * 1.42);
    });
    flat.globalAlpha = 1;
  }
}
MG.View = View;

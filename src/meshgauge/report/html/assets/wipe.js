// Two meshes in one scene, one at each side of a line that can be moved. Their sections draw them too, with more controls.

MG.wipe = (root, meshes) => {
  const canvases = [...root.querySelectorAll("canvas")];
  root.hidden = false; // before the pictures are measured
  const views = canvases.map((canvas, i) => {
    const mesh = meshes[i];
    const view = new MG.View(canvas, { around: meshes[0].view.home.around, from: [0.75, -1.5, 0.85], zooms: false });
    view.scene = mesh.view.scene;
    view.hasAxes = i === 0;
    view.before = mesh.view.before;
    const own = mesh.view.request.bind(mesh.view);
    mesh.view.request = () => {
      own();
      view.request();
    };
    canvas.addEventListener("focus", () => (view.controls.enableZoom = true));
    canvas.addEventListener("blur", () => (view.controls.enableZoom = false));
    return view;
  });
  let follows = false; // a camera that is moved by the other moves nothing
  views.forEach((view, i) =>
    view.controls.addEventListener("change", () => {
      if (follows) return;
      follows = true;
      const other = views[1 - i];
      other.camera.position.copy(view.camera.position);
      other.controls.target.copy(view.controls.target);
      other.isHome = view.isHome;
      other.controls.update();
      other.request();
      follows = false;
    }),
  );
  const line = root.querySelector("[data-edge]");
  const slider = root.querySelector("[data-wipe-at]");
  const place = () => {
    const at = 100 * Number(slider.value);
    canvases[0].style.clipPath = `inset(0 ${100 - at}% 0 0)`;
    canvases[1].style.clipPath = `inset(0 0 0 ${at}%)`;
    line.style.left = `${at}%`;
  };
  slider.addEventListener("input", place);
  place();
  // One limit for both: what is below it in one of them may be nothing in the other.
  const common = Math.min(...meshes.map((mesh) => mesh.starts.after));
  const each = (act) => meshes.forEach(act);
  each((mesh) => {
    mesh.starts.after = mesh.limit = common;
    mesh.update();
  });
  const buttons = [...root.querySelectorAll("[data-wipe-mode]")];
  for (const button of buttons) {
    button.addEventListener("click", () => {
      for (const other of buttons) other.setAttribute("aria-pressed", String(other === button));
      each((mesh) => mesh.setMode(button.dataset.wipeMode));
    });
  }
  root.querySelector("[data-wipe-reset]").addEventListener("click", () => views[0].reset());
  return views;
};

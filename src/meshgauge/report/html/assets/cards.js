// The worst cells, each in a picture of its own.

MG.card = (canvas, model) => {
  const xyz = new Float32Array(model.points.flat());
  const bad = model.points[model.bad];
  const view = new MG.View(canvas, { distance: 5.4, from: model.from, zooms: false });
  const count = (cells) => cells.reduce((sum, cell) => sum + cell.faces.reduce((s, face) => s + Math.max(face.length - 2, 0), 0), 0);
  const built = (cells) => {
    const triangles = new MG.Triangles(count(cells));
    cells.forEach((cell, i) => cell.faces.forEach((face) => triangles.face(xyz, face, 0, face.length, i)));
    return triangles.geometry((i) => [cells[i].shade === null ? NaN : cells[i].shade, cells[i].class]);
  };
  const add = (item, order) => {
    item.frustumCulled = false;
    item.renderOrder = order;
    view.scene.add(item);
  };
  const [cell, ...around] = model.cells;
  const own = built([cell]);
  add(new THREE.Mesh(own, MG.material({ opacity: 0.9, edge: 1.1, edgeOpacity: 1, depthWrite: true })), 1);
  if (around.length) {
    add(new THREE.Mesh(built(around), MG.material({ style: 1, opacity: 0.09, edge: 0.5, edgeOpacity: 0.3 })), 2);
  }
  const spot = new THREE.BufferGeometry();
  spot.setAttribute("position", new THREE.BufferAttribute(new Float32Array(bad), 3));
  spot.setAttribute("aOf", new THREE.BufferAttribute(new Float32Array([0, 1]), 2));
  spot.setAttribute("aClass", new THREE.BufferAttribute(new Float32Array([1]), 1));
  add(new THREE.Points(spot, MG.markMaterial({ size: 26, ring: 1 })), 3);
  return view;
};

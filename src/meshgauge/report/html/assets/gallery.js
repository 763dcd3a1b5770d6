// The worst cells, each in a picture of its own.

// Where to look at a cell from: the worst node is towards the eye, and a flat cell is not seen from its edge.
MG.side = (model) => {
  const point = (p) => new THREE.Vector3(...model.points[p]);
  const areas = [];
  for (const face of model.cells[0].faces) {
    for (let t = 1; t + 1 < face.length; t++) {
      const corner = point(face[0]);
      areas.push(point(face[t]).sub(corner).cross(point(face[t + 1]).sub(corner)));
    }
  }
  const total = areas.reduce((sum, area) => sum + area.length(), 0) || 1;
  const bad = point(model.bad);
  if (bad.length() > 0) bad.normalize();
  let best = null;
  for (let turn = 0; turn < 24; turn++) {
    for (const height of [-0.25, 0.3, 0.7]) {
      const angle = (turn * Math.PI) / 12 + 0.13;
      const side = new THREE.Vector3(Math.cos(angle), Math.sin(angle), height).normalize();
      const seen = areas.reduce((sum, area) => sum + Math.abs(area.dot(side)), 0) / total;
      // No flat face straight from the front either: it would hide all behind it.
      const score = Math.min(seen, 0.6) + 0.3 * side.dot(bad) + 0.05 * height;
      if (!best || score > best.score) best = { score, side };
    }
  }
  return best.side.toArray();
};

MG.card = (canvas, model) => {
  const xyz = new Float32Array(model.points.flat());
  const bad = model.points[model.bad];
  const view = new MG.View(canvas, { distance: 5.4, from: MG.side(model), zooms: false });
  const count = (cells) => cells.reduce((sum, cell) => sum + cell.faces.reduce((s, face) => s + Math.max(face.length - 2, 0), 0), 0);
  const built = (cells) => {
    const triangles = new MG.Triangles(count(cells));
    cells.forEach((cell, i) => cell.faces.forEach((face) => triangles.face(xyz, face, 0, face.length, i)));
    return triangles.geometry((i) => [cells[i].value === null ? NaN : cells[i].value, cells[i].invalid ? (cells[i].value === 0 ? 2 : 1) : 0]);
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
  spot.setAttribute("aClass", new THREE.BufferAttribute(new Float32Array([1]), 1));
  add(new THREE.Points(spot, MG.markMaterial({ size: 26, ring: 1 })), 3);
  return view;
};

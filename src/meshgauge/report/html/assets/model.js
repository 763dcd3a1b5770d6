// Unpacks the arrays of a mesh and makes triangles of them.

MG.bytes = (text) => {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return bytes;
};

MG.gunzip = async (bytes) => {
  if (typeof DecompressionStream !== "undefined") {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }
  return THREE.gunzipSync(bytes); // browsers before 2023
};

const TYPES = { Uint8Array, Uint16Array, Uint32Array, Float32Array, Float64Array };

// The bytes of each array are transposed (see pack.py); put them back.
MG.unpack = async (text, layout) => {
  const bytes = await MG.gunzip(MG.bytes(text.trim()));
  const arrays = {};
  let at = 0;
  for (const { name, type, n } of layout) {
    const Type = TYPES[type];
    const size = Type.BYTES_PER_ELEMENT;
    const own = new Uint8Array(n * size);
    for (let b = 0; b < size; b++) for (let i = 0; i < n; i++) own[i * size + b] = bytes[at++];
    arrays[name] = new Type(own.buffer);
  }
  return arrays;
};

// The corner of a face that is re-entrant the most, from which a fan of triangles stays inside; the first if none is.
const reentrant = (xyz, corners, from, size) => {
  const at = (m, k) => xyz[3 * corners[from + (m + size) % size] + k];
  const cross = (o, p, q) => [0, 1, 2].map((k) => {
    const i = (k + 1) % 3;
    const j = (k + 2) % 3;
    return (at(p, i) - at(o, i)) * (at(q, j) - at(o, j)) - (at(p, j) - at(o, j)) * (at(q, i) - at(o, i));
  });
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  let normal = [0, 0, 0];
  for (let m = 1; m + 1 < size; m++) normal = cross(0, m, m + 1).map((value, k) => value + normal[k]);
  let least = 0;
  let found = 0;
  for (let m = 0; m < size; m++) {
    const area = dot(cross(m, m + 1, m - 1), normal);
    if (area < least) [least, found] = [area, m];
  }
  return found;
};

// Gathers triangles of faces. Of the barycentric coordinates, the one opposite to an edge that is no edge of the face
// is 1 at all corners, so that no line is drawn there.
class Triangles {
  constructor(n) {
    this.position = new Float32Array(9 * n);
    this.bary = new Uint8Array(9 * n);
    this.owner = new Float32Array(3 * n);
    this.n = 0;
  }
  face(xyz, corners, from, size, owner) {
    const turn = size > 3 ? reentrant(xyz, corners, from, size) : 0;
    const at = (m) => corners[from + (m + turn) % size];
    for (let t = 1; t + 1 < size; t++) {
      const first = 3 * this.n;
      const points = [at(0), at(t), at(t + 1)];
      const inner = [0, t + 2 < size ? 255 : 0, t > 1 ? 255 : 0]; // opposite to each corner: is that edge inside the face?
      for (let c = 0; c < 3; c++) {
        const v = first + c;
        for (let k = 0; k < 3; k++) {
          this.position[3 * v + k] = xyz[3 * points[c] + k];
          this.bary[3 * v + k] = k === c ? 255 : inner[k];
        }
        this.owner[v] = owner;
      }
      this.n++;
    }
  }
  geometry(data) {
    const made = new THREE.BufferGeometry();
    made.setAttribute("position", new THREE.BufferAttribute(this.position.subarray(0, 9 * this.n), 3));
    made.setAttribute("aBary", new THREE.BufferAttribute(this.bary.subarray(0, 9 * this.n), 3, true));
    made.setAttribute("aCell", new THREE.BufferAttribute(this.owner.subarray(0, 3 * this.n), 1));
    if (data) {
      const each = new Float32Array(6 * this.n);
      for (let v = 0; v < 3 * this.n; v++) each.set(data(this.owner[v]), 2 * v);
      made.setAttribute("aData", new THREE.BufferAttribute(each, 2));
    }
    return made;
  }
}
MG.Triangles = Triangles;

// Single faces, each with its points, shade and class.
MG.facesGeometry = (faces) => {
  const xyz = new Float32Array(faces.flatMap((face) => face.points.flat()));
  const triangles = new MG.Triangles(faces.reduce((sum, face) => sum + Math.max(face.points.length - 2, 0), 0));
  let first = 0;
  faces.forEach((face, i) => {
    triangles.face(xyz, face.points.map((_, m) => first + m), 0, face.points.length, i);
    first += face.points.length;
  });
  return triangles.geometry((i) => [faces[i].shade, faces[i].class]);
};

// Where the nodes and faces of each cell are.
MG.index = (model, a) => {
  const n = a.id.length;
  const start = new Uint32Array(n + 1);
  const ownFace = a.polyFaces ? new Uint32Array(n + 1) : null; // first face, for polyhedra
  let poly = 0;
  let faces = 0;
  for (let i = 0; i < n; i++) {
    const kind = model.kinds[a.kind[i]];
    if (ownFace) ownFace[i] = faces;
    if (kind.faces) {
      start[i + 1] = start[i] + kind.n;
    } else {
      start[i + 1] = start[i] + a.polyNodes[poly];
      faces += a.polyFaces[poly++];
    }
  }
  if (ownFace) ownFace[n] = faces;
  const faceStart = a.faceSize ? new Uint32Array(a.faceSize.length + 1) : null;
  if (faceStart) for (let f = 0; f < a.faceSize.length; f++) faceStart[f + 1] = faceStart[f] + a.faceSize[f];
  return { start, ownFace, faceStart };
};

// Calls back with the points of each face of a cell: (array, first, number).
MG.eachFace = (model, a, where, i, call) => {
  const kind = model.kinds[a.kind[i]];
  if (kind.faces) {
    for (const face of kind.faces) call(face.map((m) => a.nodes[where.start[i] + m]), 0, face.length);
    return;
  }
  for (let f = where.ownFace[i]; f < where.ownFace[i + 1]; f++) call(a.facePoint, where.faceStart[f], a.faceSize[f]);
};

MG.cellGeometry = (model, a, where) => {
  let n = 0;
  for (const kind of model.kinds) kind.triangles = kind.faces ? kind.faces.reduce((sum, face) => sum + face.length - 2, 0) : 0;
  for (let i = 0; i < a.id.length; i++) n += model.kinds[a.kind[i]].triangles;
  if (a.faceSize) for (const size of a.faceSize) n += Math.max(size - 2, 0);
  const triangles = new Triangles(n);
  for (let i = 0; i < a.id.length; i++) {
    MG.eachFace(model, a, where, i, (points, from, size) => triangles.face(a.xyz, points, from, size, i));
  }
  return triangles.geometry();
};

MG.surfaceGeometry = (model, a) => {
  const xyz = new Float32Array(a.surfaceXyz.length);
  for (let i = 0; i < xyz.length; i++) xyz[i] = a.surfaceXyz[i] / 32767.5 - 1;
  let n = 0;
  for (const size of a.surfaceSize) n += Math.max(size - 2, 0);
  const triangles = new Triangles(n);
  let from = 0;
  a.surfaceSize.forEach((size, f) => {
    triangles.face(xyz, a.surfacePoint, from, size, f);
    from += size;
  });
  const data = a.surfaceValue
    ? (f) => [MG.shade(a.surfaceValue[f], a.surfacePoor ? a.surfacePoor[f] : model.poorBelow), MG.classOf(a.surfaceValue[f], model.statuses[a.surfaceStatus[f]])]
    : () => [0.9, 0];
  return triangles.geometry(data);
};

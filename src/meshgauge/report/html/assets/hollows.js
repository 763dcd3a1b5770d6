// How full space is of the cells that are shown: hollows are drawn darker (ambient occlusion), which makes cuts readable.
// A coarse grid in a texture; what a place sees before it is looked up there by the shader, near and farther away.

MG.REACHES = [1, 2, 4]; // boxes to either side of a mean that is taken twice; one channel each

class Hollows {
  // `low` and `high`: corners of the box about all cells; `usual`: volume of one of them.
  constructor(low, high, usual) {
    const longest = Math.max(...[0, 1, 2].map((k) => high[k] - low[k]));
    this.box = Math.max(longest / 44, 0.5 * Math.cbrt(usual), 1e-6);
    const rim = 2 + 2 * MG.REACHES[2] + 1; // so that the outermost boxes are empty
    this.low = low.map((x) => x - (rim + 0.5) * this.box);
    this.counts = [0, 1, 2].map((k) => Math.ceil((high[k] - low[k]) / this.box) + 1 + 2 * rim);
    this.n = this.counts[0] * this.counts[1] * this.counts[2];
    this.sums = new Float32Array(this.n);
    this.texture = new THREE.Data3DTexture(new Uint8Array(4 * this.n), ...this.counts);
    this.texture.minFilter = this.texture.magFilter = THREE.LinearFilter;
  }
  clear() {
    this.sums.fill(0);
  }
  add(x, y, z, volume) {
    const { low, box, counts } = this;
    const i = Math.floor((x - low[0]) / box);
    const j = Math.floor((y - low[1]) / box);
    const k = Math.floor((z - low[2]) / box);
    const isIn = i >= 0 && i < counts[0] && j >= 0 && j < counts[1] && k >= 0 && k < counts[2];
    if (isIn) this.sums[i + counts[0] * (j + counts[1] * k)] += volume / (box * box * box);
  }
  finish() {
    const filled = this.spread(this.sums, 1);
    for (let i = 0; i < this.n; i++) if (filled[i] > 1) filled[i] = 1;
    const { data } = this.texture.image;
    MG.REACHES.forEach((reach, channel) => {
      const full = this.spread(filled, reach);
      for (let i = 0; i < this.n; i++) data[4 * i + channel] = 255 * full[i] + 0.5;
    });
    this.texture.needsUpdate = true;
  }
  // The mean of each box and those about it, along each axis, twice.
  spread(values, reach) {
    let [from, to] = [Float32Array.from(values), new Float32Array(this.n)];
    const strides = [1, this.counts[0], this.counts[0] * this.counts[1]];
    for (let pass = 0; pass < 2; pass++) {
      for (let axis = 0; axis < 3; axis++) {
        const [step, length] = [strides[axis], this.counts[axis]];
        const [a, b] = [0, 1, 2].filter((k) => k !== axis);
        for (let q = 0; q < this.counts[b]; q++) {
          for (let p = 0; p < this.counts[a]; p++) {
            const first = p * strides[a] + q * strides[b];
            let sum = 0;
            for (let i = 0; i < reach; i++) sum += from[first + i * step];
            for (let i = 0; i < length; i++) {
              if (i + reach < length) sum += from[first + (i + reach) * step];
              if (i > reach) sum -= from[first + (i - reach - 1) * step];
              to[first + i * step] = sum / (2 * reach + 1);
            }
          }
        }
        [from, to] = [to, from];
      }
    }
    return from;
  }
}
MG.Hollows = Hollows;

// Volumes of cells, from the pyramids between their middle and their faces.
MG.volumes = (model, a, where, centre) => {
  const out = new Float32Array(a.id.length);
  const corner = (c, p) => [0, 1, 2].map((k) => a.xyz[3 * p + k] - c[k]);
  for (let i = 0; i < out.length; i++) {
    const c = centre(i);
    let sum = 0;
    MG.eachFace(model, a, where, i, (points, from, size) => {
      const u = corner(c, points[from]);
      for (let t = 1; t + 1 < size; t++) {
        const [v, w] = [corner(c, points[from + t]), corner(c, points[from + t + 1])];
        sum += u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) + u[2] * (v[0] * w[1] - v[1] * w[0]);
      }
    });
    out[i] = Math.abs(sum) / 6 || 0;
  }
  return out;
};

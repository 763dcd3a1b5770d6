// The picture of a whole mesh and its controls, and the histograms that are linked with it.

MG.MARKS = 150; // more would hide the mesh

class MeshView {
  constructor(root, model, arrays) {
    this.root = root;
    this.model = model;
    this.a = arrays;
    this.where = MG.index(model, arrays);
    this.starts = { before: model.startBefore ?? model.start, after: model.start };
    this.limit = model.start;
    this.bins = new Map(); // what is selected: "group bin" → number of cells
    this.plane = MG.NO_PLANE();
    this.$ = (name) => root.querySelector(`[data-${name}]`);
    this.state = "after";
    this.after = { ...arrays }; // of two states of a mesh the later one
    this.build();
    this.fill();
    this.bind();
    this.setMode("through");
  }

  // Show the mesh as it was before an improvement, or after.
  setState(state) {
    if (!this.model.before || state === this.state) return;
    const was = this.state;
    this.state = state;
    for (const name of Object.keys(this.after)) {
      if (`${name}Before` in this.after) this.a[name] = this.after[state === "before" ? `${name}Before` : name];
    }
    for (const button of this.root.querySelectorAll("[data-state]")) button.setAttribute("aria-pressed", String(button.dataset.state === state));
    this.fill();
    this.unpick();
    // What is below the limit of one state may be nothing in the other.
    if (this.limit === this.starts[was]) this.limit = this.starts[state];
    this.update();
  }

  build() {
    const { a, model } = this;
    const n = a.id.length;
    const width = Math.min(2048, Math.max(2, 2 * n));
    const height = Math.ceil((2 * n) / width) || 1;
    this.table = new Float32Array(4 * width * height);
    this.texture = new THREE.DataTexture(this.table, width, height, THREE.RGBAFormat, THREE.FloatType);
    const geometry = MG.surfaceGeometry(model, a);
    geometry.computeBoundingBox();
    const { min, max } = geometry.boundingBox;
    this.extent = { low: min.toArray(), high: max.toArray() };
    const around = [0, 1, 2, 3, 4, 5, 6, 7].map((c) => [0, 1, 2].map((k) => ((c >> k) & 1 ? this.extent.high : this.extent.low)[k]));
    this.view = new MG.View(this.$("canvas"), { around, from: model.from, zooms: false });
    this.view.hasAxes = true;
    this.view.before = () => this.shade();
    this.isShown = new Uint8Array(n);
    const add = (item, order) => {
      item.frustumCulled = false;
      item.renderOrder = order;
      this.view.scene.add(item);
      return item;
    };
    const plane = this.plane;
    const none = new THREE.BufferGeometry();
    this.cells = add(new THREE.Mesh(none, MG.material({ cells: true, plane, texture: this.texture })), 0);
    this.skin = add(new THREE.Mesh(none, MG.material({ plane, edgeOpacity: model.coarse ? 0 : 0.6 })), 0);
    this.ghost = add(new THREE.Mesh(none, MG.material({ style: 1, opacity: 0.1, edgeOpacity: model.coarse ? 0 : 0.06, plane })), 1);
    this.marks = add(new THREE.Points(none, MG.markMaterial({ size: 19, plane })), 2);
    const spot = new THREE.BufferGeometry();
    spot.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3), 3));
    spot.setAttribute("aOf", new THREE.BufferAttribute(new Float32Array([0, 1]), 2));
    spot.setAttribute("aClass", new THREE.BufferAttribute(new Float32Array([1]), 1));
    this.ring = add(new THREE.Points(spot, MG.markMaterial({ size: 34, ring: 1 })), 3);
    this.ring.visible = false;
    // The worst faces for finite volumes, over everything: each is hidden inside of the mesh.
    this.faces = model.faces || [];
    this.hard = add(new THREE.Mesh(this.faces.length ? MG.facesGeometry(this.faces) : none, MG.material({ edge: 1.2, edgeOpacity: 1 })), 3);
    this.hard.material.depthTest = false;
    this.hard.visible = false;
  }

  // The triangles, values and marks of the state that is shown.
  fill() {
    const { a, model } = this;
    const n = a.id.length;
    this.classes = new Uint8Array(n);
    const marks = [];
    for (let i = 0; i < n; i++) {
      const [from, to] = [this.where.start[i], this.where.start[i + 1]];
      const centre = [0, 0, 0];
      for (let m = from; m < to; m++) for (let k = 0; k < 3; k++) centre[k] += a.xyz[3 * a.nodes[m] + k] / (to - from);
      this.classes[i] = MG.classOf(a.value[i], model.statuses[a.status[i]]);
      this.table.set([...centre, Number.isNaN(a.value[i]) ? 2 : a.value[i], this.classes[i], 0, MG.shade(a.value[i], model.kinds[a.kind[i]].poorBelow), 0], 8 * i);
      if (this.classes[i]) marks.push(i);
    }
    this.texture.needsUpdate = true;
    for (const item of [this.cells, this.skin, this.marks]) item.geometry.dispose();
    this.cells.geometry = MG.cellGeometry(model, a, this.where);
    this.skin.geometry = this.ghost.geometry = MG.surfaceGeometry(model, a);
    const drawn = this.clusters(marks);
    const places = new THREE.BufferGeometry();
    const array = (name, size, get) => places.setAttribute(name, new THREE.BufferAttribute(new Float32Array(drawn.flatMap(get)), size));
    array("position", 3, (one) => one.at);
    array("aClass", 1, (one) => [one.class]);
    array("aOf", 2, (one) => [one.reach, one.n]);
    this.marks.geometry = places;
    this.marks.material.uniforms.uSize.value = drawn.length < 100 ? 19 : 15;
    this.nMarks = drawn.length;
    this.volume = MG.volumes(model, a, this.where, (i) => this.centre(i));
    const sorted = this.volume.filter((v) => v > 0).sort();
    if (sorted.length) {
      this.hollows = new MG.Hollows(this.extent.low, this.extent.high, sorted[sorted.length >> 1]);
      const { uniforms } = this.cells.material;
      uniforms.uHollows.value?.dispose();
      uniforms.uHollows.value = this.hollows.texture;
      uniforms.uHollowsLow.value.set(...this.hollows.low);
      uniforms.uHollowsScale.value.set(...this.hollows.counts.map((n) => 1 / (n * this.hollows.box)));
      uniforms.uHollowsBox.value = this.hollows.box;
    }
    this.$("mark-text").textContent = drawn.length < marks.length ? `(${marks.length.toLocaleString("en")}, in ${drawn.length} marks)` : "";
  }

  // Marks of some cells: one each, or of those that are in one box of a grid, so that there are few.
  clusters(cells) {
    const { a } = this;
    const gather = (boxes) => {
      const found = new Map();
      for (const i of cells) {
        const at = [...this.centre(i)];
        const key = boxes ? at.map((x) => Math.min(boxes - 1, Math.floor(((x + 1) / 2) * boxes))).join(" ") : i;
        if (!found.has(key)) found.set(key, []);
        found.get(key).push(i);
      }
      return [...found.values()];
    };
    let groups = cells.length <= MG.MARKS ? gather(0) : [];
    for (let boxes = 12; !groups.length && cells.length; boxes--) {
      const some = gather(boxes);
      if (some.length <= MG.MARKS || boxes === 1) groups = some;
    }
    return groups.map((group) => {
      const at = [0, 1, 2].map((k) => group.reduce((sum, i) => sum + this.centre(i)[k], 0) / group.length);
      let reach = 0;
      for (const i of group) {
        for (let m = this.where.start[i]; m < this.where.start[i + 1]; m++) {
          reach = Math.max(reach, Math.hypot(...[0, 1, 2].map((k) => a.xyz[3 * a.nodes[m] + k] - at[k])));
        }
      }
      return { at, reach: 1.05 * reach, n: group.length, class: Math.min(...group.map((i) => this.classes[i])) };
    });
  }

  // Before it is drawn: how full space is of what is shown now.
  shade() {
    if (!this.isStale) return;
    this.isStale = false;
    const { uniforms } = this.cells.material;
    const isOn = Boolean(this.hollows) && this.$("hollows").checked;
    uniforms.uDark.value = isOn ? 0.7 : 0;
    if (!isOn) return;
    const { a, hollows } = this;
    const left = (1 - uniforms.uShrink.value) ** 3;
    hollows.clear();
    for (let i = 0; i < a.id.length; i++) {
      if (!this.isShown[i] || !(this.volume[i] > 0)) continue;
      const [from, to] = [this.where.start[i], this.where.start[i + 1]];
      const [x, y, z] = [this.table[8 * i], this.table[8 * i + 1], this.table[8 * i + 2]];
      const part = (left * this.volume[i]) / (2 * (to - from));
      for (let m = from; m < to; m++) {
        const p = 3 * a.nodes[m];
        for (let t = 0.35; t < 1; t += 0.4) hollows.add(x + t * (a.xyz[p] - x), y + t * (a.xyz[p + 1] - y), z + t * (a.xyz[p + 2] - z), part);
      }
    }
    hollows.finish();
  }

  centre(i) {
    return this.table.subarray(8 * i, 8 * i + 3);
  }

  bind() {
    const $ = this.$;
    $("message").hidden = true;
    $("controls").hidden = false;
    const press = (attribute, act) => {
      const buttons = [...this.root.querySelectorAll(`[data-${attribute}]`)];
      for (const button of buttons) button.addEventListener("click", () => act(button.dataset[attribute]));
    };
    press("state", (state) => this.setState(state));
    press("mode", (mode) => this.setMode(mode));
    press("slice", (axis) => this.setSlice(axis));
    press("locate", (cell) => this.locate(Number(cell)));
    press("face", (face) => this.locateFace(Number(face)));
    for (const button of this.root.querySelectorAll("[data-face]")) button.hidden = !this.faces[Number(button.dataset.face)];
    for (const button of this.root.querySelectorAll("[data-locate]")) {
      button.hidden = this.a.id.indexOf(Number(button.dataset.locate)) < 0;
    }
    $("limit").addEventListener("input", (event) => {
      this.clear();
      this.limit = Number(event.target.value);
      this.update();
    });
    $("shrink").addEventListener("input", (event) => {
      this.cells.material.uniforms.uShrink.value = Number(event.target.value);
      this.isStale = true;
      this.view.request();
    });
    for (const name of ["position", "flip"]) $(name).addEventListener("input", () => this.slice());
    $("marks").addEventListener("change", (event) => {
      this.marks.visible = event.target.checked;
      this.view.request();
    });
    $("hollows").addEventListener("change", () => {
      this.isStale = true;
      this.view.request();
    });
    $("reset").addEventListener("click", () => {
      this.hard.visible = false;
      this.view.reset();
    });
    $("clear").addEventListener("click", () => {
      this.clear();
      this.update();
    });
    const canvas = $("canvas");
    // The wheel scrolls the page until the picture is used.
    canvas.addEventListener("focus", () => (this.view.controls.enableZoom = true));
    canvas.addEventListener("blur", () => (this.view.controls.enableZoom = false));
    let down = null;
    canvas.addEventListener("pointerdown", (event) => {
      down = [event.clientX, event.clientY];
      canvas.focus({ preventScroll: true });
    });
    canvas.addEventListener("pointerup", (event) => {
      if (down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) < 4) this.pickAt(event);
      down = null;
    });
  }

  setMode(mode) {
    const whole = mode === "whole";
    for (const button of this.root.querySelectorAll("[data-mode]")) button.setAttribute("aria-pressed", String(button.dataset.mode === mode));
    // A mesh that is here whole is shown by its cells, so that a slice shows what is inside.
    this.ghost.visible = !whole;
    this.skin.visible = whole && !this.model.whole;
    this.clear();
    this.limit = whole && this.model.whole ? 1 : this.starts[this.state];
    this.update();
  }

  setSlice(axis) {
    for (const button of this.root.querySelectorAll("[data-slice]")) button.setAttribute("aria-pressed", String(button.dataset.slice === axis));
    this.axis = axis;
    for (const name of ["position", "flip"]) this.$(name).disabled = axis === "";
    this.slice();
  }

  slice() {
    if (!this.axis) {
      this.plane.set(0, 0, 0, 1);
    } else {
      const k = Number(this.axis);
      const at = this.extent.low[k] + (this.extent.high[k] - this.extent.low[k]) * Number(this.$("position").value);
      const sign = this.$("flip").checked ? -1 : 1;
      this.plane.set(k === 0 ? sign : 0, k === 1 ? sign : 0, k === 2 ? sign : 0, sign * at);
    }
    this.update();
  }

  // Whether the slice leaves a cell.
  isKept(i) {
    const [x, y, z] = this.centre(i);
    return this.plane.x * x + this.plane.y * y + this.plane.z * z <= this.plane.w;
  }

  // Which cells are shown, and how many.
  update() {
    const { a, limit } = this;
    const filtered = this.bins.size > 0;
    let shown = 0;
    let here = 0; // selected, behind the slice or not
    for (let i = 0; i < a.id.length; i++) {
      const selected = filtered && (this.bins.has(`all ${a.bin[i]}`) || this.bins.has(`${this.model.kinds[a.kind[i]].type} ${a.bin[i]}`));
      this.table[8 * i + 5] = Number(selected);
      const passes = filtered ? selected : a.value[i] < limit || limit >= 1 || this.classes[i] > 0;
      here += Number(passes);
      this.isShown[i] = Number(passes && this.isKept(i));
      shown += this.isShown[i];
    }
    this.isStale = true;
    this.texture.needsUpdate = true;
    const uniforms = this.cells.material.uniforms;
    uniforms.uLimit.value = limit;
    uniforms.uFiltered.value = Number(filtered);
    this.$("limit").value = limit;
    this.$("limit-text").textContent = limit.toFixed(Math.abs(limit * 100 - Math.round(limit * 100)) > 0.01 ? 3 : 2);
    const count = (n) => n.toLocaleString("en");
    const cells = (n) => `${count(n)} cell${n === 1 ? "" : "s"}`;
    this.shown = shown;
    const some = shown === 1 && this.model.total === 1 ? "Shows the one cell." : shown === this.model.total ? `Shows all ${cells(shown)}.` : `Shows ${count(shown)} of ${cells(this.model.total)}.`;
    const cut = this.axis ? `, cut, and ${cells(shown)} behind the slice.` : ".";
    this.$("shown").textContent = this.skin.visible ? `Shows the surface of all ${cells(this.model.total)}${cut}` : filtered && !this.axis ? "" : some;
    this.$("chip").hidden = !filtered;
    if (filtered) this.$("chip-text").textContent = this.selection(here);
    this.view.request();
  }

  selection(shown) {
    const edges = this.model.edges;
    const number = (x) => String(Number(x.toFixed(4)));
    const parts = [...this.bins.keys()].map((key) => {
      const at = key.lastIndexOf(" ");
      const bin = Number(key.slice(at + 1));
      const group = key.slice(0, at);
      return `${group === "all" ? "" : `${group} `}${number(edges[bin])} to ${number(edges[bin + 1])}`;
    });
    const total = [...this.bins.values()].reduce((sum, n) => sum + n, 0);
    const groups = new Set([...this.bins.keys()].map((key) => key.slice(0, key.lastIndexOf(" "))));
    const first = [];
    for (let i = 0; i < this.a.id.length && first.length < 8; i++) if (this.table[8 * i + 5]) first.push(this.a.id[i]);
    const n = groups.has("all") && groups.size > 1 ? shown : total;
    const here = shown < n ? ` (${shown.toLocaleString("en")} of them in this page)` : "";
    const ids = first.length ? `: ${first.join(", ")}${shown > first.length ? ", …" : ""}` : "";
    return `Selected ${parts.join(", ")}: ${n.toLocaleString("en")} cell${n === 1 ? "" : "s"}${here}${ids}`;
  }

  clear() {
    this.bins.clear();
    for (const bar of this.root.querySelectorAll(".bar[aria-pressed=true]")) bar.setAttribute("aria-pressed", "false");
  }

  toggle(group, bar, adds, state) {
    if (state && state !== this.state) {
      this.clear();
      this.setState(state);
    }
    const key = `${group} ${bar.dataset.bin}`;
    const was = this.bins.has(key);
    if (!adds) this.clear();
    if (was) this.bins.delete(key);
    else this.bins.set(key, Number(bar.dataset.n));
    bar.setAttribute("aria-pressed", String(!was));
    this.update();
  }

  pickAt(event) {
    const canvas = this.$("canvas");
    const box = canvas.getBoundingClientRect();
    const x = Math.floor(((event.clientX - box.left) / box.width) * canvas.width);
    const y = Math.floor(((event.clientY - box.top) / box.height) * canvas.height);
    this.view.fit();
    const items = [this.cells, this.skin, this.ghost, this.marks, this.ring];
    const seen = items.map((item) => item.visible);
    const alone = (item) => {
      for (const other of items) other.visible = other === item;
      item.material.uniforms.uPick.value = 1;
      const id = MG.stage.pick(this.view.scene, this.view.camera, canvas, x, y);
      item.material.uniforms.uPick.value = 0;
      return id;
    };
    let cell = alone(this.cells);
    let face = -1;
    if (cell < 0 && seen[1]) {
      face = alone(this.skin);
      if (face >= 0 && this.a.surfaceCell) {
        cell = this.a.id.indexOf(this.a.surfaceCell[face]);
        if (cell >= 0) face = -1;
      }
    }
    items.forEach((item, i) => (item.visible = seen[i]));
    if (cell >= 0) this.show(cell);
    else if (face >= 0 && this.a.surfaceCell) this.showFace(face);
    else this.unpick();
  }

  unpick() {
    this.cells.material.uniforms.uPickedCell.value = -1;
    this.ring.visible = false;
    this.view.request();
  }

  value(x) {
    if (Number.isNaN(x)) return "-";
    if (x === 0) return "0";
    // As the tables have it: 5e-05, not 5e-5.
    return Math.abs(x) < 5e-4 ? x.toExponential(0).replace(/e-(\d)$/, "e-0$1") : x.toFixed(3);
  }

  show(i) {
    const { a, model } = this;
    const make = (tag, text, parent, name) => {
      const item = document.createElement(tag);
      if (text !== "") item.textContent = text;
      if (name) item.className = name;
      parent.append(item);
      return item;
    };
    const panel = this.$("picked");
    panel.replaceChildren();
    panel.dataset.cell = a.id[i];
    const kind = model.kinds[a.kind[i]];
    const status = model.statuses[a.status[i]];
    const region = model.regions.length > 1 ? ` · ${model.regions[a.region[i]]}` : "";
    const head = make("h4", `${kind.type} ${this.entry("element", "cell", a.id[i], a.label?.[i])} `, panel);
    const bad = this.classes[i] ? "invalid" : a.value[i] < kind.poorBelow ? "poor" : "";
    make("span", this.value(a.value[i]), head, `v ${bad}`);
    const name = status.name === "ok" ? "" : `${status.name.replaceAll("_", " ")}: `;
    make("p", `${name}${status.text}${region}`, panel);
    const table = make("table", "", make("div", "", panel, "scroll"), "numbers");
    const row = make("tr", "", make("thead", "", table));
    for (const name of ["node", "point", "J_ENS"]) make("th", name, row).scope = "col";
    const body = make("tbody", "", table);
    const [from, to] = [this.where.start[i], this.where.start[i + 1]];
    let worst = from;
    for (let m = from; m < to; m++) if (a.nodeValue[m] < a.nodeValue[worst] || Number.isNaN(a.nodeValue[worst])) worst = m;
    const { centre, half } = model.frame;
    for (let m = from; m < to; m++) {
      const line = make("tr", "", body, m === worst ? "worst" : "");
      const p = a.nodes[m];
      make("td", m - from, line);
      make("td", this.entry("node", "point", a.point[p], a.pointLabel?.[p]), line);
      make("td", `${this.value(a.nodeValue[m])}${m === worst ? " ◀" : ""}`, line);
    }
    const place = [0, 1, 2].map((k) => Number((a.xyz[3 * a.nodes[worst] + k] * half + centre[k]).toPrecision(this.digits(from, to))));
    make("p", `The worst node is at ${place.join(", ")}.`, panel, "hint");
    this.cells.material.uniforms.uPickedCell.value = i;
    const ring = this.ring.geometry.getAttribute("position");
    ring.array.set(this.centre(i));
    ring.needsUpdate = true;
    this.ring.visible = true;
    this.view.request();
  }

  // A position, or the number of the file with the position beside.
  entry(noun, place, position, label) {
    return label >= 0 ? `${noun} ${label} (${place} ${position})` : position;
  }

  // As many digits as tell the nodes of a cell apart, six at least; no more than single precision has of the frame.
  digits(from, to) {
    const { a } = this;
    const { centre, half } = this.model.frame;
    let least = Infinity;
    for (let m = from; m < to; m++) {
      for (let n = from; n < m; n++) {
        const d = Math.hypot(...[0, 1, 2].map((k) => a.xyz[3 * a.nodes[m] + k] - a.xyz[3 * a.nodes[n] + k])) * half;
        if (d > 0 && d < least) least = d;
      }
    }
    const largest = Math.max(...centre.map(Math.abs)) + half;
    if (!(least < Infinity) || !(largest > 0)) return 6;
    return Math.min(15, Math.max(6, 2 + Math.ceil(Math.log10(largest)) - Math.floor(Math.log10(least))));
  }

  showFace(face) {
    const panel = this.$("picked");
    const text = document.createElement("p");
    text.textContent = `Cell ${this.a.surfaceCell[face]}: quality ${this.value(this.a.surfaceValue[face])}. Its shape is not in this page.`;
    panel.replaceChildren(text);
    panel.dataset.cell = this.a.surfaceCell[face];
    this.unpick();
  }

  // Go to one of the listed faces; all of them are drawn then.
  locateFace(at) {
    const { points, text } = this.faces[at];
    this.setState("after");
    this.setMode("through");
    this.unpick();
    const about = document.createElement("p");
    about.textContent = text;
    this.$("picked").replaceChildren(about);
    delete this.$("picked").dataset.cell;
    const centre = new THREE.Vector3();
    for (const point of points) centre.addScaledVector(new THREE.Vector3(...point), 1 / points.length);
    const radius = Math.max(...points.map((point) => centre.distanceTo(new THREE.Vector3(...point))));
    this.hard.visible = true;
    this.ring.geometry.attributes.position.copyArray(centre.toArray());
    this.ring.geometry.attributes.position.needsUpdate = true;
    this.ring.visible = true;
    this.view.goTo(centre, Math.max(radius * 20, 1e-4));
    this.$("canvas").scrollIntoView({ block: "center" });
    this.$("canvas").focus({ preventScroll: true });
  }

  // Go to a cell by its number in the file.
  locate(id) {
    const i = this.a.id.indexOf(id);
    if (i < 0) return;
    this.setState("after");
    this.setMode("through");
    this.limit = Math.max(this.limit, Math.min(this.model.reach, Math.floor(this.a.value[i] * 100 + 1) / 100));
    this.update();
    const centre = new THREE.Vector3(...this.centre(i));
    let radius = 0;
    for (let m = this.where.start[i]; m < this.where.start[i + 1]; m++) {
      const p = 3 * this.a.nodes[m];
      radius = Math.max(radius, centre.distanceTo(new THREE.Vector3(this.a.xyz[p], this.a.xyz[p + 1], this.a.xyz[p + 2])));
    }
    this.view.goTo(centre, Math.max(radius * 14, 1e-4));
    this.show(i);
    this.$("canvas").scrollIntoView({ block: "center" });
    this.$("canvas").focus({ preventScroll: true });
  }
}
MG.MeshView = MeshView;

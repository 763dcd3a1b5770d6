/* Pieces of pages that can be moved: a cell with a corner to drag, and a cell that is inside out in its middle.

   Types of cells and colours come from the program, as JSON in the page. A test holds `quality` against it. */
(() => {
  "use strict";

  const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const unit = (a) => { const n = Math.hypot(...a); return n ? a.map((x) => x / n) : [0, 0, 0]; };
  const det = (a, b, c) =>
    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]);

  /* How corners become a cell: the least if all are positive, else the mildest negative one. */
  function fold(values) {
    const negative = values.filter((x) => x < 0);
    if (negative.length) return Math.max(...negative);
    return Math.min(...values) || 0;
  }

  /* J_S brought to the scale on which the ideal corner has 1. */
  function scaled(js, k) {
    if (js > k) return 1 + k - js;
    return js < -k ? -(1 + k) - js : js / k;
  }

  /* J_S and J_ENS of the nodes of a cell, and of the cell. */
  function quality(shape, points) {
    const js = points.map(() => []);
    for (const [a, ...ends] of shape.triples) {
      js[a].push(det(...ends.map((n) => unit(minus(points[n], points[a])))));
    }
    const nodesJs = js.map(fold);
    const nodes = nodesJs.map((x) => scaled(x, shape.k));
    return { nodesJs, nodes, js: fold(nodesJs), jens: fold(nodes) };
  }

  const text = (x) => (Math.abs(x) < 5e-4 ? "0" : x.toFixed(3).replace("-", "−"));
  const theme = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  /* A canvas with as many pixels as the screen has there; `draw` gets a context in CSS pixels. */
  function sheet(canvas, draw) {
    const again = () => {
      const box = canvas.getBoundingClientRect();
      if (!box.width) return;
      const ratio = window.devicePixelRatio || 1;
      canvas.width = Math.round(box.width * ratio);
      canvas.height = Math.round(box.height * ratio);
      const pen = canvas.getContext("2d");
      pen.scale(ratio, ratio);
      draw(pen, box.width, box.height);
    };
    new ResizeObserver(again).observe(canvas);
    new MutationObserver(again).observe(document.documentElement, { attributeFilter: ["data-theme"] });
    return again;
  }

  /* Two axes of the screen in space, for a view turned by these angles. */
  function view(turn, lift) {
    const right = [Math.cos(turn), Math.sin(turn), 0];
    const up = [-Math.sin(turn) * Math.sin(lift), Math.cos(turn) * Math.sin(lift), Math.cos(lift)];
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    return { right, up, flat: (p) => [dot(p, right), -dot(p, up)] };
  }

  function line(pen, ...points) {
    pen.beginPath();
    points.forEach((p, n) => (n ? pen.lineTo(...p) : pen.moveTo(...p)));
  }

  function corner(figure, data) {
    const canvas = figure.querySelector("canvas");
    const choice = figure.querySelector("select");
    const rows = figure.querySelector("tbody");
    const verdict = figure.querySelector("[data-verdict]");
    let shape, points, chosen, turn = -0.65, lift = 0.4, place = () => [0, 0], scale = 1;

    const colour = (x) => data.colours[x < 0 ? "invalid" : x === 0 ? "degenerate" : x < data.poor ? "poor" : "good"];

    function reset() {
      shape = data.shapes[choice.value];
      points = shape.points.map((p) => [...p]);
      chosen = shape.faces[shape.faces.length - 1].length > 3 ? shape.faces[0].length + 2 : points.length - 1;
      show();
    }

    const redraw = sheet(canvas, (pen, width, height) => {
      const eye = view(turn, lift);
      const middle = [0, 1, 2].map((c) => shape.points.reduce((s, p) => s + p[c], 0) / shape.points.length);
      const size = Math.max(...shape.points.map((p) => Math.hypot(...minus(p, middle))));
      scale = (0.36 * Math.min(width, height)) / size;
      place = (p) => {
        const [x, y] = eye.flat(minus(p, middle));
        return [width / 2 + scale * x, height / 2 + scale * y];
      };
      const now = quality(shape, points);
      for (const face of shape.faces) {
        line(pen, ...face.map((n) => place(points[n])));
        pen.closePath();
        pen.fillStyle = `${data.colours[now.jens < 0 ? "invalid" : "good"]}1c`;
        pen.fill();
      }
      for (const [a, b] of shape.edges) {
        line(pen, place(points[a]), place(points[b]));
        pen.strokeStyle = theme("--pst-color-text-muted");
        pen.lineWidth = a === chosen || b === chosen ? 2.5 : 1.2;
        pen.stroke();
      }
      points.forEach((p, n) => {
        const [x, y] = place(p);
        pen.beginPath();
        pen.arc(x, y, n === chosen ? 12 : 9, 0, 7);
        pen.fillStyle = colour(now.nodes[n]);
        pen.fill();
        if (n === chosen) {
          pen.strokeStyle = theme("--pst-color-text-base");
          pen.lineWidth = 2.5;
          pen.stroke();
        }
        pen.fillStyle = now.nodes[n] >= 0 && now.nodes[n] < data.poor ? "#000" : "#fff";
        pen.font = "600 12px sans-serif";
        pen.textAlign = "center";
        pen.textBaseline = "middle";
        pen.fillText(n, x, y + 0.5);
      });
    });

    function show() {
      const now = quality(shape, points);
      rows.replaceChildren(...now.nodes.map((value, n) => {
        const row = document.createElement("tr");
        if (n === chosen) row.className = "chosen";
        for (const cell of [n, text(now.nodesJs[n]), text(value)]) row.insertCell().textContent = cell;
        return row;
      }));
      const least = now.nodes.indexOf(now.jens);
      const why = now.jens < 0 ? `the mildest of the negative nodes (${least}) speaks for the cell: inverted`
        : now.jens === 0 ? "flat at a node: degenerate"
          : `the least of its nodes (${least}): ${now.jens < data.poor ? "poor" : "good"}`;
      verdict.textContent = `Cell: J_S ${text(now.js)}, J_ENS ${text(now.jens)}, ${why}.`;
      redraw();
    }

    function shift(x, y) {
      const eye = view(turn, lift);
      points[chosen] = points[chosen].map((v, c) => v + x * eye.right[c] - y * eye.up[c]);
      show();
    }

    canvas.addEventListener("pointerdown", (event) => {
      const near = points.map((p) => Math.hypot(...[0, 1].map((c) => place(p)[c] - [event.offsetX, event.offsetY][c])));
      const nearest = near.indexOf(Math.min(...near));
      const is_node = near[nearest] < 24;
      if (is_node) chosen = nearest;
      let from = [event.clientX, event.clientY];
      canvas.setPointerCapture(event.pointerId);
      const move = (e) => {
        const [x, y] = [e.clientX - from[0], e.clientY - from[1]];
        from = [e.clientX, e.clientY];
        if (is_node) return shift(x / scale, y / scale);
        turn -= x / 150;
        lift = Math.max(-1.5, Math.min(1.5, lift + y / 150));
        return redraw();
      };
      canvas.addEventListener("pointermove", move);
      canvas.addEventListener("pointerup", () => canvas.removeEventListener("pointermove", move), { once: true });
      show();
    });
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      if (step) {
        if (event.shiftKey) { turn -= 0.1 * step[0]; lift += 0.1 * step[1]; redraw(); } else shift(0.05 * step[0], 0.05 * step[1]);
      } else if (/^[0-9]$/.test(event.key) && Number(event.key) < points.length) {
        chosen = Number(event.key);
        show();
      } else return;
      event.preventDefault();
    });
    choice.addEventListener("change", reset);
    figure.querySelector("button").addEventListener("click", reset);
    reset();
    shift(0.25, 0.3); // something to see before anything is touched
  }

  /* A square below and its image, wider and mirrored twice, above: the section at t is 1 - 3t wide, and 1 - 5t deep. */
  function crossed(figure, data) {
    const [solid, chart] = figure.querySelectorAll("canvas");
    const slider = figure.querySelector("input");
    const verdict = figure.querySelector("[data-verdict]");
    const height = 20;
    const at = () => Number(slider.value) / 100;
    const determinant = (t) => 4 * height * (1 - 3 * t) * (1 - 5 * t);
    const section = (t) => [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([x, y]) => [x * (1 - 3 * t), y * (1 - 5 * t), 8 * t]);
    const sign = (t) => data.colours[determinant(t) < 0 ? "invalid" : "good"];

    const drawSolid = sheet(solid, (pen, width, high) => {
      const eye = view(0.5, 0.35);
      const scale = Math.min(width / 11, high / 11.5);
      const place = (p) => { const [x, y] = eye.flat(p); return [width / 2 + scale * x, high * 0.84 + scale * y]; };
      pen.lineWidth = 1.2;
      pen.strokeStyle = theme("--pst-color-text-muted");
      for (const t of [0, 1]) { line(pen, ...section(t).map(place)); pen.closePath(); pen.stroke(); }
      for (let n = 0; n < 4; n += 1) { line(pen, place(section(0)[n]), place(section(1)[n])); pen.stroke(); }
      line(pen, ...section(at()).map(place));
      pen.closePath();
      pen.fillStyle = `${sign(at())}88`;
      pen.fill();
      pen.strokeStyle = sign(at());
      pen.lineWidth = 2.5;
      pen.stroke();
    });

    const drawChart = sheet(chart, (pen, width, high) => {
      const x = (d) => 16 + ((width - 32) * (d + 10)) / 100;
      const y = (t) => high - 26 - (high - 52) * t;
      const ink = theme("--pst-color-text-base");
      pen.fillStyle = `${data.colours.invalid}33`;
      pen.fillRect(0, y(1 / 3), width, y(1 / 5) - y(1 / 3));
      pen.strokeStyle = theme("--pst-color-text-muted");
      pen.lineWidth = 1;
      line(pen, [x(0), y(0)], [x(0), y(1)]);
      pen.stroke();
      const curve = [];
      for (let t = 0; t <= 0.62; t += 0.005) curve.push([x(determinant(t)), y(t)]);
      line(pen, ...curve.filter(([right]) => right < width - 8));
      pen.strokeStyle = ink;
      pen.lineWidth = 2;
      pen.stroke();
      pen.fillStyle = ink;
      pen.font = "12px sans-serif";
      pen.textAlign = "right";
      pen.fillText("negative here", width - 10, (y(1 / 3) + y(1 / 5)) / 2 + 4);
      pen.textAlign = "center";
      pen.fillText("0", x(0), high - 8);
      pen.fillText("80", x(80), high - 8);
      pen.fillText("det, over the height", width / 2, 14);
      const d = determinant(at());
      pen.beginPath();
      pen.arc(Math.min(x(d), width - 12), y(at()), 7, 0, 7);
      pen.fillStyle = sign(at());
      pen.fill();
    });

    function show() {
      const t = at();
      const d = determinant(t);
      verdict.textContent = `At ${slider.value} % of the height the section is ${text(1 - 3 * t)} wide and ${text(1 - 5 * t)} deep `
        + `(1 at the bottom; a negative one is mirrored), and det = ${text(d)}${d < 0 ? ": inside out" : ""}.`;
      drawSolid();
      drawChart();
    }
    slider.addEventListener("input", show);
    show();
  }

  window.meshgaugeLive = { quality };
  const pieces = { corner, crossed };
  document.addEventListener("DOMContentLoaded", () => {
    for (const figure of document.querySelectorAll("[data-live]")) {
      pieces[figure.dataset.live](figure, JSON.parse(figure.querySelector("script").textContent));
      figure.classList.add("ready");
    }
  });
})();

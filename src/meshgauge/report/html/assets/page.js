// Starts what is on the page: theme, histograms, pictures.

(() => {
  const root = document.documentElement;
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => (root.dataset.theme ? root.dataset.theme === "dark" : dark.matches);
  const toggle = document.querySelector("[data-theme-toggle]");
  const name = () => (toggle.textContent = isDark() ? "Light" : "Dark");
  toggle.hidden = false;
  toggle.setAttribute("aria-label", "Change between light and dark");
  const views = [];
  MG.views = views;
  const redraw = () => views.forEach((view) => view.request());
  toggle.addEventListener("click", () => {
    root.dataset.theme = isDark() ? "light" : "dark";
    name();
    redraw();
  });
  dark.addEventListener("change", () => {
    name();
    redraw();
  });
  name();
  window.addEventListener("beforeprint", () => {
    for (const item of document.querySelectorAll("main details")) item.open = true;
  });

  const json = (id) => {
    const element = document.getElementById(id);
    return element ? JSON.parse(element.textContent) : null;
  };

  const charts = (section, mesh) => {
    const box = section.querySelector("[data-charts]");
    if (!box) return;
    box.querySelector("[data-tools]").hidden = false;
    const figures = [...box.querySelectorAll("figure")];
    const buttons = [...box.querySelectorAll("[data-show]")];
    for (const button of buttons) {
      button.addEventListener("click", () => {
        for (const other of buttons) other.setAttribute("aria-pressed", String(other === button));
        for (const figure of figures) figure.hidden = figure.dataset.group !== button.dataset.show;
      });
    }
    box.querySelector("[data-log]").addEventListener("change", (event) => {
      for (const bar of box.querySelectorAll(".bar")) {
        const text = bar.querySelector(".n");
        const [whole, ...layers] = bar.querySelectorAll(".fill");
        const base = Number(whole.getAttribute("y")) + Number(whole.getAttribute("height"));
        for (const fill of [whole, ...layers]) {
          const height = Number(event.target.checked ? fill.dataset.log : fill.dataset.linear);
          fill.setAttribute("y", base - height);
          fill.setAttribute("height", height);
          if (text && fill === whole) text.setAttribute("y", base - height - 5);
        }
      }
    });
    for (const figure of figures) {
      const bars = [...figure.querySelectorAll(".bar")];
      bars.forEach((bar, i) => {
        const select = (adds) => mesh() && mesh().toggle(figure.dataset.group, bar, adds, figure.dataset.of);
        bar.addEventListener("click", (event) => select(event.ctrlKey || event.metaKey || event.shiftKey));
        bar.addEventListener("keydown", (event) => {
          const to = { ArrowRight: i + 1, ArrowLeft: i - 1, Home: 0, End: bars.length - 1 }[event.key];
          if (event.key === "Enter" || event.key === " ") select(event.ctrlKey || event.shiftKey);
          else if (to === undefined || !bars[to]) return;
          else {
            bar.tabIndex = -1;
            bars[to].tabIndex = 0;
            bars[to].focus();
          }
          event.preventDefault();
        });
      });
    }
  };

  const gallery = (section, at) => {
    const models = json(`cards-${at}`);
    if (!models) return;
    section.querySelector("[data-turns]").hidden = false;
    for (const canvas of section.querySelectorAll("[data-card]")) {
      canvas.previousElementSibling.remove(); // the flat drawing
      canvas.hidden = false;
      views.push(MG.card(canvas, models[Number(canvas.dataset.card)]));
    }
  };

  const start = async (section) => {
    const at = section.dataset.mesh;
    let mesh = null;
    charts(section, () => mesh);
    const message = section.querySelector("[data-message]");
    if (typeof THREE === "undefined" || !MG.stage.works) {
      return;
    }
    const model = json(`model-${at}`);
    if (model) MG.colours = model.colours;
    gallery(section, at);
    if (!model) return;
    message.textContent = "Unpacking …";
    await new Promise((resolve) => setTimeout(resolve)); // the tables are painted first
    try {
      const arrays = await MG.unpack(document.getElementById(`geometry-${at}`).textContent, model.layout);
      section.querySelector("[data-viewer]").classList.add("live");
      mesh = new MG.MeshView(section, model, arrays);
      views.push(mesh.view);
      section.meshView = mesh;
      for (const hint of section.querySelectorAll("[data-linked]")) hint.hidden = false;
      section.dataset.ready = "true";
    } catch (error) {
      section.querySelector("[data-viewer]").classList.remove("live");
      message.textContent = `The picture cannot be drawn: ${error.message}`;
      throw error;
    }
  };

  (async () => {
    for (const section of document.querySelectorAll("[data-mesh]")) await start(section);
    const wipe = document.querySelector("[data-wipe]");
    const shown = [...document.querySelectorAll("[data-mesh]")].map((section) => section.meshView).slice(0, 2);
    if (wipe && shown.length === 2 && shown.every(Boolean)) views.push(...MG.wipe(wipe, shown));
    root.dataset.ready = "true";
  })();
})();

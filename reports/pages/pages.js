// The script of the pages: hands the charts of a page to plotly.js in the page's colours; moves the arrows of the scene.
"use strict";

function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
}

// "@blue" is the colour that the style sheet calls --blue, light or dark.
function coloured(value) {
  if (typeof value === "string") {
    return value.startsWith("@") ? colour(value.slice(1)) : value;
  }
  if (Array.isArray(value)) {
    return value.map(coloured);
  }
  if (value !== null && typeof value === "object") {
    return Object.fromEntries(Object.entries(value).map(([key, element]) => [key, coloured(element)]));
  }
  return value;
}

// A name from outside as plotly.js shows it as it was typed, without reading markup in it.
function plain(text) {
  return String(text).replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;").replaceAll("%", "&#37;");
}

// plotly.js empties the style attributes of a scale of colours, which our policy refuses as it refuses any that is set;
// to remove one does the same.
const setAttribute = Element.prototype.setAttribute;
Element.prototype.setAttribute = function (name, value) {
  return name === "style" && value === "" ? this.removeAttribute(name) : setAttribute.call(this, name, value);
};

function read(id) {
  const element = document.getElementById(id);
  return element === null ? null : JSON.parse(element.textContent);
}

const SETTINGS = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["toImage", "lasso2d", "select2d"] };

// The offset from UTC of the run nearest to a moment: the axis shows the shop's clock.
function offsetAt(canvas, time) {
  const times = canvas.data.flatMap((trace) => trace.x).filter((at) => /T.*([+-]\d\d:\d\d|Z)$/.test(at));
  const apart = (at) => Math.abs(Date.parse(at.slice(0, 16)) - Date.parse(time.replace(" ", "T").slice(0, 16)));
  const nearest = times.reduce((best, at) => (best === "" || apart(at) < apart(best) ? at : best), "");
  return nearest === "" ? "Z" : nearest.match(/([+-]\d\d:\d\d|Z)$/)[0];
}

// A click between the runs of a trend puts its time into the form of an event; a drag zooms, and is none, and a double
// click takes the zoom back.
function takeTimes(canvas) {
  const at = document.querySelector('form[action="/machine/event"] input[name="at"]');
  if (at === null || canvas.dataset.takesTimes) {
    return;
  }
  canvas.dataset.takesTimes = "1";
  let clicked = 0;
  canvas.addEventListener("click", (event) => {
    const pad = event.target.closest(".nsewdrag");
    if (pad === null) {
      return;
    }
    clearTimeout(clicked);
    if (event.detail > 1) {
      return;
    }
    const time = String(canvas._fullLayout.xaxis.p2d(event.clientX - pad.getBoundingClientRect().left));
    clicked = setTimeout(() => {
      at.value = time.replace(" ", "T").padEnd(16, "T00:00").slice(0, 16) + offsetAt(canvas, time);
      const text = at.form.querySelector('input[name="text"]');
      text.focus({ preventScroll: true });
      text.scrollIntoView({ block: "nearest" });
    }, 350);
  });
}

// In a narrow picture the names of the axes would be cut off at its sides: it is looked at from farther away, and moved
// towards the scale of colours; fewer numbers on the axes do not lie over each other.
function fitted(layout, canvas) {
  const camera = layout.scene?.camera;
  if (!camera || canvas.clientWidth >= 480) {
    return layout;
  }
  const eye = Object.fromEntries(Object.entries(camera.eye).map(([axis, at]) => [axis, 1.5 * at]));
  const center = { ...camera.center, x: camera.center.x - 0.04, y: camera.center.y - 0.035 };
  const axes = Object.fromEntries(["xaxis", "yaxis", "zaxis"].map((axis) => [axis, { nticks: 5, ...layout.scene[axis] }]));
  return { ...layout, scene: { ...layout.scene, ...axes, camera: { ...camera, eye, center } } };
}

// The buttons of a chart are one stop of the Tab key, as a toolbar is; the arrow keys go from one to the next.
function oneStop(canvas) {
  const settle = () => canvas.querySelectorAll(".modebar-btn").forEach((button, index) => { button.tabIndex = index === 0 ? 0 : -1; });
  settle();
  if (canvas.dataset.oneStop) {
    return;
  }
  canvas.dataset.oneStop = "1";
  canvas.on("plotly_afterplot", settle);
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    const buttons = [...canvas.querySelectorAll(".modebar-btn")];
    const at = buttons.indexOf(event.target);
    if (step && at >= 0) {
      event.preventDefault();
      buttons[(at + step + buttons.length) % buttons.length].focus();
    }
  });
}

function draw(figure) {
  const chart = JSON.parse(figure.querySelector("script.figure").textContent);
  const canvas = figure.querySelector(".canvas");
  if (figure.dataset.key === "scene") {
    drawScene(canvas, chart);
  } else {
    canvas.style.height = chart.layout.height + "px"; // what the style sheet has no rule for
    Plotly.react(canvas, coloured(chart.data), fitted(coloured(chart.layout), canvas), SETTINGS).then(() => {
      canvas.dataset.drawn = "1";
      oneStop(canvas);
      if (figure.dataset.key === "trend") {
        takeTimes(canvas);
      }
    });
  }
}

// Means of the vectors of the probings that are shown, place by place; probings that were left out take no part.
function arrows(vectors, list, run, pose) {
  const places = new Map();
  vectors.place.forEach((place, row) => {
    if (vectors.left_out[row] || (run !== "" && String(vectors.run[row]) !== run) || (pose !== "" && String(vectors.pose[row]) !== pose)) {
      return;
    }
    const key = vectors.pose[row] + " " + place.map((number) => Math.round(number)).join(" ");
    const sum = places.get(key) || { place: [0, 0, 0], vector: [0, 0, 0], count: 0, target: vectors.target[row] };
    for (let axis = 0; axis < 3; axis += 1) {
      sum.place[axis] += place[axis];
      sum.vector[axis] += list[row][axis];
    }
    sum.count += 1;
    places.set(key, sum);
  });
  return [...places.values()].map((sum) => ({
    target: sum.target,
    place: sum.place.map((number) => number / sum.count),
    vector: sum.vector.map((number) => number / sum.count),
  }));
}

// Lines from each place along its vector, with a cone as the head; the line and its head are shown and hidden together.
function traces(list, magnification, name, shade, visible) {
  const line = { type: "scatter3d", mode: "lines", name, legendgroup: name, visible, line: { color: shade, width: 5 }, x: [], y: [], z: [], hoverinfo: "skip" };
  const head = { type: "cone", name, legendgroup: name, visible: visible === true, x: [], y: [], z: [], u: [], v: [], w: [], text: [], anchor: "tip",
    showscale: false, sizemode: "raw", sizeref: 0.45, colorscale: [[0, shade], [1, shade]], hovertemplate: "%{text}<extra>" + name + "</extra>" };
  for (const { target, place, vector } of list) {
    const end = place.map((number, axis) => number + magnification * vector[axis]);
    ["x", "y", "z"].forEach((axis, index) => {
      line[axis].push(place[index], end[index], null);
      head[axis].push(end[index]);
    });
    ["u", "v", "w"].forEach((axis, index) => head[axis].push(magnification * vector[index]));
    head.text.push(plain(target) + ": " + Math.hypot(...vector).toFixed(2) + " µm");
  }
  return [line, head];
}

// What is drawn over the residuals: the effect that is pointed at, else the one that the page tries.
const scene = { vectors: null, effect: null, answers: new Map() };

function chosen(id) {
  const element = document.getElementById(id);
  return element === null ? "" : element.value;
}

function drawScene(canvas, chart) {
  const vectors = scene.vectors;
  const step = read("scene-magnifications")[Number(chosen("magnification"))];
  const run = chosen("scene-run");
  const pose = chosen("scene-pose");
  document.getElementById("magnified").textContent = "1 µm is drawn as " + step + " mm";
  const effect = scene.effect;
  // The axis whose error it is lights up.
  let data = coloured(chart.data).map((trace) => effect === null || trace.meta !== effect.axis || !trace.meta ? trace
    : trace.type === "mesh3d" ? { ...trace, color: colour("orange") }
      : { ...trace, line: { ...trace.line, color: colour("orange"), width: 9 }, textfont: { color: colour("orange"), size: 17 } });
  data = data.concat(traces(arrows(vectors, vectors.residual, run, pose), step, "left by the model", colour("blue"), true));
  if (effect !== null && effect.motion) {
    chart.data.filter((trace) => trace.type !== "mesh3d" && effect.motion.axes.includes(trace.meta)).forEach((trace) => data.push({
      ...trace, ...displaced(trace, effect.motion, 1), mode: "lines", text: undefined, hoverinfo: "skip", showlegend: false, meta: undefined,
      line: { color: colour("orange"), width: 4, dash: "dash" },
    }));
  }
  if (effect !== null) {
    data = data.concat(traces(arrows(vectors, effect.explained, run, pose), step, "explained by " + plain(effect.effect), colour("orange"), true));
    data = data.concat(traces(arrows(vectors, effect.remaining, run, pose), step, "left with " + plain(effect.effect), colour("teal"), "legendonly"));
  }
  return Plotly.react(canvas, data, fitted(coloured(chart.layout), canvas), SETTINGS).then(() => {
    canvas.dataset.drawn = "1";
    oneStop(canvas);
    if (effect !== null && scene.swung !== effect) {
      scene.swung = effect;
      swing(canvas, coloured(chart.data), effect);
    }
  });
}

// The points of a line of the machine, moved by a share of an effect's motion; a turn is small and drawn as its first order.
function displaced(trace, motion, share) {
  const moved = { x: [], y: [], z: [] };
  trace.x.forEach((_, index) => {
    const arm = [trace.x[index], trace.y[index], trace.z[index]];
    const from = arm.map((number, axis) => number - motion.about[axis]);
    ["x", "y", "z"].forEach((name, axis) => {
      const [second, third] = [(axis + 1) % 3, (axis + 2) % 3];
      const turned = motion.turn[second] * from[third] - motion.turn[third] * from[second];
      moved[name].push(arm[axis] === null ? null : arm[axis] + share * (motion.shift[axis] + turned));
    });
  });
  return moved;
}

// What an effect moves swings twice and stands still again; whoever asked for less motion sees the end of it, dashed.
function swing(canvas, lines, effect) {
  cancelAnimationFrame(scene.frame);
  const motion = effect.motion;
  if (!motion || window.matchMedia("(prefers-reduced-motion: reduce)").matches) {
    return;
  }
  const rows = lines.map((_, row) => row).filter((row) => motion.axes.includes(lines[row].meta));
  const begin = performance.now();
  let drawing = false;
  const step = (now) => {
    if (scene.effect !== effect) {
      return;
    }
    const seconds = (now - begin) / 1000;
    const share = seconds < 3.2 ? Math.sin(2 * Math.PI * seconds / 1.6) : 0;
    if (!drawing) {
      drawing = true;
      const moved = rows.map((row) => displaced(lines[row], motion, share));
      const update = Object.fromEntries(["x", "y", "z"].map((name) => [name, moved.map((line) => line[name])]));
      Plotly.restyle(canvas, update, rows).then(() => { drawing = false; canvas.dataset.swung = String(Number(canvas.dataset.swung || 0) + 1); });
      if (share === 0 && seconds >= 3.2) {
        return;
      }
    }
    scene.frame = requestAnimationFrame(step);
  };
  scene.frame = requestAnimationFrame(step);
}

function soon() {
  return new Promise((then) => { setTimeout(then, 500); });
}

// The arrows of an effect, asked for once; while they are computed the server is asked again.
function explained(effect) {
  if (!scene.answers.has(effect)) {
    const address = read("scene-asked") + "&effect=" + encodeURIComponent(effect);
    const ask = () => fetch(address, { credentials: "same-origin" }).then((answer) => {
      if (answer.status === 202) {
        return soon().then(ask);
      }
      return answer.ok ? answer.json() : null;
    });
    scene.answers.set(effect, ask());
  }
  return scene.answers.get(effect);
}

function pointAt(effect, redraw) {
  const status = document.getElementById("scene-effect");
  scene.pointed = effect;
  if (effect === null) {
    scene.effect = scene.vectors.tried;
    scene.swung = scene.effect;
    redraw();
    return;
  }
  status.textContent = "what " + effect + " explains is being computed";
  explained(effect).then((answer) => {
    if (scene.pointed !== effect) {
      return;
    }
    status.textContent = answer === null ? effect + " cannot be tried in this model"
      : "Orange: what " + effect + " explains. Blue: what the model leaves. Where the arrows agree, it explains the residual." +
        (answer.motion ? " " + answer.motion.sentence + "; the motion is drawn far larger than it is." : "");
    if (answer !== null) {
      scene.effect = answer;
      redraw();
    }
  });
}

function drawAll() {
  if (typeof Plotly !== "undefined") {
    document.querySelectorAll("figure.chart").forEach(draw);
  }
}

// A chart is as wide as the window it was drawn in: on paper its right side would be cut off.
const PAPER_PX = 680;

function drawForPaper() {
  document.querySelectorAll(".js-plotly-plot").forEach((canvas) => {
    if (canvas.clientWidth > PAPER_PX) {
      Plotly.relayout(canvas, { width: PAPER_PX });
    }
  });
}

function drawForWindow() {
  document.querySelectorAll(".js-plotly-plot").forEach((canvas) => Plotly.relayout(canvas, { width: null, autosize: true }));
}

function prepareScene() {
  scene.vectors = read("scene-vectors");
  if (scene.vectors === null) {
    return;
  }
  scene.effect = scene.vectors.tried;
  const select = document.getElementById("scene-run");
  [...new Set(scene.vectors.run)].forEach((run) => select.add(new Option("run " + run, String(run))));
  const redraw = () => draw(document.querySelector('figure.chart[data-key="scene"]'));
  ["scene-run", "scene-pose"].forEach((id) => document.getElementById(id)?.addEventListener("change", redraw));
  document.getElementById("magnification").addEventListener("input", redraw);
  const cards = [...document.querySelectorAll("article.effect[data-effect]")];
  cards.forEach((card) => {
    const effect = card.dataset.effect;
    ["mouseenter", "focusin"].forEach((kind) => card.addEventListener(kind, () => {
      if (scene.pointed !== effect) {
        pointAt(effect, redraw);
      }
    }));
    card.addEventListener("mouseleave", () => { if (!card.contains(document.activeElement)) { pointAt(null, redraw); } });
    card.addEventListener("focusout", (event) => { if (!card.contains(event.relatedTarget)) { pointAt(null, redraw); } });
  });
  // The first is what most people point at: it is there when they do.
  if (cards.length > 0) {
    explained(cards[0].dataset.effect);
  }
}

// The table of all parameters is asked for when somebody scrolls to it; while it is computed the server is asked again.
function fillLater(section) {
  const ask = () => fetch(section.dataset.later, { credentials: "same-origin" }).then((answer) => {
    if (answer.status === 202) {
      return soon().then(ask);
    }
    return answer.ok ? answer.text() : null;
  });
  const note = section.querySelector("p");
  note.className = "waiting";
  note.textContent = "◔ The table of all parameters is being computed.";
  ask().then((table) => {
    if (table === null) {
      note.className = "quiet";
      note.textContent = "The table of all parameters could not be had: load the page again.";
    } else {
      note.outerHTML = table;
    }
  });
}

function watchLater(section) {
  const watcher = new IntersectionObserver((entries) => {
    if (entries.some((entry) => entry.isIntersecting)) {
      watcher.disconnect();
      fillLater(section);
    }
  });
  watcher.observe(section);
}

// The server is asked before a page loads itself again: while it is away the browser would show its own page of errors.
function loadAgain() {
  setTimeout(() => fetch("/work/state?number=0", { credentials: "same-origin" }).then(() => location.reload(), () => {
    document.querySelectorAll(".so-far").forEach((words) => { words.textContent = "The server does not answer now; this page waits for it."; });
    loadAgain();
  }), 2000);
}

// A page that waits loads itself again once that is computed: to make and draw it anew takes the time of what it waits for.
function waitFor(note) {
  let waited = false;
  const ask = () => fetch("/work/state?number=" + note.dataset.number, { credentials: "same-origin" }).then((answer) => {
    if (answer.status !== 202) {
      // What was there at once is loaded no faster than by a page that does not ask.
      (waited ? () => location.reload() : loadAgain)();
      return null;
    }
    waited = true;
    return answer.json().then((work) => {
      note.querySelector(".so-far").textContent = work.so_far;
      if (work.at) {
        note.querySelector(".at").textContent = work.at;
        note.querySelector("progress")?.setAttribute("value", work.done);
      }
      return ask();
    });
  });
  ask().catch(loadAgain);
}

// In the browser's own way an address that ends in #scene would not be loaded anew.
document.querySelectorAll(".waiting, [data-waits]").forEach((note) => (note.dataset.number ? waitFor(note) : loadAgain()));
document.querySelectorAll("[data-later]").forEach(watchLater);
prepareScene();
drawAll();
window.addEventListener("beforeprint", drawForPaper);
window.addEventListener("afterprint", drawForWindow);
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);

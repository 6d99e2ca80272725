// The script of the pages: hands the charts of a page to plotly.js in the page's colours, and moves the arrows of the scene.
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

function read(id) {
  const element = document.getElementById(id);
  return element === null ? null : JSON.parse(element.textContent);
}

const SETTINGS = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["toImage", "lasso2d", "select2d"] };

function draw(figure) {
  const chart = JSON.parse(figure.querySelector("script.figure").textContent);
  const canvas = figure.querySelector(".canvas");
  if (figure.dataset.key === "scene") {
    drawScene(canvas, chart);
  } else {
    Plotly.react(canvas, coloured(chart.data), coloured(chart.layout), SETTINGS).then(() => { canvas.dataset.drawn = "1"; });
  }
}

// Means of the vectors of the runs at the same place, or those of one run; probings that were left out take no part.
function arrows(vectors, which, run) {
  const places = new Map();
  vectors.place.forEach((place, row) => {
    if (vectors.left_out[row] || (run !== "" && String(vectors.run[row]) !== run)) {
      return;
    }
    const key = place.map((number) => Math.round(number)).join(" ");
    const sum = places.get(key) || { place: [0, 0, 0], vector: [0, 0, 0], count: 0, target: vectors.target[row] };
    for (let axis = 0; axis < 3; axis += 1) {
      sum.place[axis] += place[axis];
      sum.vector[axis] += vectors[which][row][axis];
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

// Lines from each place along its vector, with a cone as the head.
function traces(list, magnification, name, shade) {
  const line = { type: "scatter3d", mode: "lines", name, line: { color: shade, width: 4 }, x: [], y: [], z: [], hoverinfo: "skip" };
  const head = { type: "cone", name, x: [], y: [], z: [], u: [], v: [], w: [], text: [], anchor: "tip", showscale: false,
    sizemode: "raw", sizeref: 0.3, colorscale: [[0, shade], [1, shade]], hovertemplate: "%{text}<extra>" + name + "</extra>" };
  for (const { target, place, vector } of list) {
    const end = place.map((number, axis) => number + magnification * vector[axis]);
    ["x", "y", "z"].forEach((axis, index) => {
      line[axis].push(place[index], end[index], null);
      head[axis].push(end[index]);
    });
    ["u", "v", "w"].forEach((axis, index) => head[axis].push(magnification * vector[index]));
    head.text.push(target + ": " + Math.hypot(...vector).toFixed(2) + " µm");
  }
  return [line, head];
}

// The directions of the machine's linear axes, at the corner of what was probed.
function frame(vectors) {
  const low = [0, 1, 2].map((axis) => Math.min(...vectors.place.map((place) => place[axis])));
  const high = [0, 1, 2].map((axis) => Math.max(...vectors.place.map((place) => place[axis])));
  const reach = 0.3 * Math.max(...high.map((number, axis) => number - low[axis]), 1);
  return vectors.axes.map((name) => {
    const end = low.slice();
    end["XYZ".indexOf(name[0])] += reach;
    return { type: "scatter3d", mode: "lines+text", x: [low[0], end[0]], y: [low[1], end[1]], z: [low[2], end[2]], text: ["", name],
      line: { color: colour("mid"), width: 6 }, textfont: { color: colour("ink"), size: 14 }, hoverinfo: "skip", showlegend: false };
  });
}

function drawScene(canvas, chart) {
  const vectors = read("scene-vectors");
  const step = read("scene-magnifications")[Number(document.getElementById("magnification").value)];
  const run = document.getElementById("scene-run").value;
  document.getElementById("magnified").textContent = "1 µm is drawn as " + step + " mm";
  let data = frame(vectors).concat(traces(arrows(vectors, "residual", run), step, "left by the model", colour("blue")));
  if (vectors.with_effect) {
    data = data.concat(traces(arrows(vectors, "with_effect", run), step, "with " + vectors.effect, colour("orange")));
  }
  Plotly.react(canvas, data, coloured(chart.layout), SETTINGS).then(() => { canvas.dataset.drawn = "1"; });
}

function drawAll() {
  if (typeof Plotly !== "undefined") {
    document.querySelectorAll("figure.chart").forEach(draw);
  }
}

function prepareScene() {
  const vectors = read("scene-vectors");
  if (vectors === null) {
    return;
  }
  const select = document.getElementById("scene-run");
  [...new Set(vectors.run)].forEach((run) => select.add(new Option("run " + run, String(run))));
  const redraw = () => draw(document.querySelector('figure.chart[data-key="scene"]'));
  select.addEventListener("change", redraw);
  document.getElementById("magnification").addEventListener("input", redraw);
}

prepareScene();
drawAll();
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);

"use strict";

// Films: poses that can be played, turned and stepped through.

const MISSING = -32768;
const COLOURS = { l: "#9a9a9a", r: "#1c1c1c", "-": "#1c1c1c" };
const FORCE = "#009E73", MARKER = "#0072B2", FLOOR = "#d4d4d4";
const TURN_PER_PIXEL = 0.01;
const MARGIN = 0.06;
const OBLIQUE = [-2.4, 0.25]; // yaw and pitch: from the front, from their right and above
const STEP = 0.1; // of an arrow key [rad]
const TILE = 500, TILES = 3;

function unpack(film) {
  const bytes = Uint8Array.from(atob(film.positions), (letter) => letter.charCodeAt(0));
  const numbers = new Int16Array(bytes.buffer);
  const width = numbers.length / film.frames;
  return (frame) => {
    const row = numbers.subarray(frame * width, (frame + 1) * width);
    let next = 0;
    const take = (count) => {
      const points = [];
      for (let k = 0; k < count; k++, next += 3) points.push(row.subarray(next, next + 3));
      return points;
    };
    const bones = take(2 * film.bones);
    const [head] = take(1);
    const markers = take(film.markers);
    const [foot, tip] = take(2);
    return { bones, head, markers, foot, tip };
  };
}

// Where a point is seen, to the right and up. The person looks along x, y points to their right, z up;
// yaw 0 is from behind, a positive pitch from above.
function projected([x, y, z], { yaw, pitch }) {
  const across = -Math.sin(yaw) * x + Math.cos(yaw) * y;
  const away = Math.cos(yaw) * x + Math.sin(yaw) * y;
  return [across, Math.cos(pitch) * z + Math.sin(pitch) * away];
}

// How far a film's poses reach from their own pelvis, and how high.
function reach(film, poseAt) {
  let wide = 500, high = 1000;
  for (let k = 0; k < film.frames; k++) {
    const pose = poseAt(k), [px, py] = pose.bones[0];
    for (const [x, y, z] of [...pose.bones, pose.head, pose.tip]) {
      if (x === MISSING) continue;
      wide = Math.max(wide, Math.hypot(x - px, y - py));
      high = Math.max(high, z + film.head_mm);
    }
  }
  return { wide, high };
}

function player(canvas) {
  const film = JSON.parse(canvas.dataset.film);
  const poseAt = unpack(film);
  const { wide, high } = reach(film, poseAt);
  const pen = canvas.getContext("2d");
  const room = 1 - 2 * MARGIN;
  const scale = Math.min(canvas.height * room / Math.hypot(high, wide), canvas.width * room / (2 * wide));
  const state = { frame: 0, yaw: OBLIQUE[0], pitch: OBLIQUE[1], pelvis: [0, 0], playing: false, from: 0, started: null };

  // The view follows the pelvis.
  function seen([x, y, z]) {
    const [across, up] = projected([x - state.pelvis[0], y - state.pelvis[1], z - high / 2], state);
    return [canvas.width / 2 + scale * across, canvas.height / 2 - scale * up];
  }

  function line(a, b, colour, width) {
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.beginPath();
    pen.moveTo(...seen(a));
    pen.lineTo(...seen(b));
    pen.stroke();
  }

  function floor() {
    const [cx, cy] = state.pelvis.map((place) => Math.round(place / TILE));
    const half = TILES * TILE;
    for (let k = -TILES; k <= TILES; k++) {
      const x = TILE * (cx + k), y = TILE * (cy + k);
      line([x, TILE * cy - half, 0], [x, TILE * cy + half, 0], FLOOR, 1);
      line([TILE * cx - half, y, 0], [TILE * cx + half, y, 0], FLOOR, 1);
    }
  }

  function circle(centre, radius, colour) {
    pen.strokeStyle = colour;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(...seen(centre), radius, 0, 2 * Math.PI);
    pen.stroke();
  }

  function arrow(foot, tip) {
    line(foot, tip, FORCE, 4);
    const [x0, y0] = seen(foot), [x1, y1] = seen(tip);
    const angle = Math.atan2(y1 - y0, x1 - x0);
    pen.fillStyle = FORCE;
    pen.beginPath();
    pen.moveTo(x1, y1);
    for (const side of [-0.4, 0.4]) pen.lineTo(x1 - 16 * Math.cos(angle + side), y1 - 16 * Math.sin(angle + side));
    pen.fill();
  }

  function draw() {
    const pose = poseAt(state.frame);
    state.pelvis = [pose.bones[0][0], pose.bones[0][1]];
    pen.clearRect(0, 0, canvas.width, canvas.height);
    pen.lineCap = "round";
    floor();
    for (let k = 0; k < film.bones; k++) line(pose.bones[2 * k], pose.bones[2 * k + 1], COLOURS[film.sides[k]], 5);
    circle(pose.head, scale * film.head_mm, COLOURS["-"]);
    for (const marker of pose.markers) circle(marker, 3, MARKER);
    if (pose.tip[0] !== MISSING) arrow(pose.foot, pose.tip);
    slider.value = state.frame;
    time.textContent = (film.times_ms[state.frame] / 1000).toFixed(2) + " s";
    slider.setAttribute("aria-valuetext", time.textContent);
  }

  function step(now) {
    if (!state.playing) return;
    state.started ??= now;
    const at = state.from + now - state.started;
    const later = film.times_ms.findIndex((t) => t > at);
    state.frame = later < 0 ? film.frames - 1 : Math.max(0, later - 1);
    draw();
    if (later < 0) stop();
    else requestAnimationFrame(step);
  }

  function stop() {
    state.playing = false;
    button.textContent = "Play";
  }

  function play() {
    if (state.frame === film.frames - 1) state.frame = 0;
    state.playing = true;
    state.from = film.times_ms[state.frame];
    state.started = null;
    button.textContent = "Pause";
    requestAnimationFrame(step);
  }

  function element(name, values) {
    return Object.assign(document.createElement(name), values);
  }

  const button = element("button", { type: "button", textContent: "Play" });
  const slider = element("input", { type: "range", min: 0, max: film.frames - 1, value: 0 });
  const time = element("span", {});
  const views = { "From the side": [-Math.PI / 2, 0], "From behind": [0, 0], Oblique: OBLIQUE };
  slider.setAttribute("aria-label", "time");
  button.onclick = () => (state.playing ? stop() : play());
  slider.oninput = () => {
    stop();
    state.frame = Number(slider.value);
    draw();
  };
  const controls = element("div", { className: "controls" });
  controls.append(button, slider, time);
  for (const [name, [yaw, pitch]] of Object.entries(views)) {
    const view = element("button", { type: "button", textContent: name });
    view.onclick = () => {
      Object.assign(state, { yaw, pitch });
      draw();
    };
    controls.append(view);
  }
  canvas.after(controls);

  function turn(yaw, pitch) {
    state.yaw -= yaw;
    state.pitch = Math.max(-0.2, Math.min(1.5, state.pitch + pitch));
    draw();
  }

  const keys = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, STEP], ArrowDown: [0, -STEP] };
  canvas.tabIndex = 0;
  canvas.onkeydown = (event) => {
    if (!(event.key in keys)) return;
    event.preventDefault();
    turn(...keys[event.key]);
  };
  canvas.onpointermove = (event) => {
    if (event.buttons === 1) turn(TURN_PER_PIXEL * event.movementX, TURN_PER_PIXEL * event.movementY);
  };
  canvas.onpointerdown = (event) => canvas.setPointerCapture(event.pointerId);
  draw();
}

// Tables: a click on a column's title sorts by it; a button copies the table.

const NUMBER = /^[[<>≤≥|]*\s*([-−+]?\d*\.?\d+)(?:\s*×\s*10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?/;
const HIGH = "⁰¹²³⁴⁵⁶⁷⁸⁹";

// The number at the start of a cell; null where there is none. "<.001" is a little less than .001.
function number(text) {
  const found = text.replace(/[\u2009\u202f]/g, "").match(NUMBER);
  if (!found) return null;
  const power = [...(found[2] ?? "")].map((sign) => (sign === "⁻" ? "-" : HIGH.indexOf(sign))).join("");
  const value = Number(found[1].replace("−", "-")) * 10 ** Number(power || 0);
  return text.startsWith("<") ? value - 1e-9 : value;
}

// Rows in order; cells that hold nothing come last either way.
function sorted(rows, text, isWords, up) {
  const key = (row) => (isWords ? text(row) || null : number(text(row)));
  const order = (a, b) => (isWords ? a.localeCompare(b, undefined, { numeric: true }) : a - b);
  const known = rows.filter((row) => key(row) !== null);
  const rest = rows.filter((row) => key(row) === null);
  known.sort((a, b) => (up ? 1 : -1) * order(key(a), key(b)));
  return [...known, ...rest];
}

function sortable(table) {
  const titles = [...table.tHead.rows[table.tHead.rows.length - 1].cells];
  const body = table.tBodies[0];
  titles.forEach((title, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...title.childNodes);
    title.append(button);
    button.onclick = () => {
      const up = title.getAttribute("aria-sort") !== "ascending";
      titles.forEach((other) => other.removeAttribute("aria-sort"));
      title.setAttribute("aria-sort", up ? "ascending" : "descending");
      const text = (row) => row.cells[column].textContent.trim();
      body.append(...sorted([...body.rows], text, title.classList.contains("words"), up));
    };
  });
}

function copyable(grid) {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "copy";
  button.textContent = "Copy";
  button.onclick = async () => {
    const rows = [...grid.querySelector("table").rows];
    const wide = (cell) => [cell.textContent.trim(), ...Array(cell.colSpan - 1).fill("")];
    const text = rows.map((row) => [...row.cells].flatMap(wide).join("\t")).join("\n");
    try {
      await navigator.clipboard.writeText(text);
      button.textContent = "Copied";
    } catch {
      button.textContent = "The browser does not allow it";
    }
  };
  grid.prepend(button);
}

document.querySelectorAll("canvas[data-film]").forEach(player);
document.querySelectorAll(".grid").forEach(copyable);
document.querySelectorAll(".grid table").forEach((table) => {
  if (!table.querySelector("td.group")) sortable(table);
});

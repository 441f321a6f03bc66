"use strict";

// Films: poses that can be played, turned and stepped through.

const MISSING = -32768;
const COLOURS = { l: "#9a9a9a", r: "#1c1c1c", "-": "#1c1c1c" };
const FORCE = "#009E73", MARKER = "#0072B2", FLOOR = "#d4d4d4";
const TURN_PER_PIXEL = 0.01;
const MARGIN = 0.06;
const OBLIQUE = [2.4, 0.2]; // yaw and pitch: from the front, a little to the right and above

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

function reach(film, poseAt) {
  let wide = 500, high = 1000;
  for (let k = 0; k < film.frames; k++) {
    const pose = poseAt(k);
    for (const [x, y, z] of [...pose.bones, pose.head, pose.tip]) {
      if (x === MISSING) continue;
      wide = Math.max(wide, Math.hypot(x, y));
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
  const scale = Math.min(canvas.height * (1 - 2 * MARGIN) / high, canvas.width / (2 * wide) * (1 - MARGIN));
  const state = { frame: 0, yaw: OBLIQUE[0], pitch: OBLIQUE[1], playing: false, from: 0, started: 0 };

  // The person looks along x, y points to the right, z up.
  function seen([x, y, z]) {
    const across = -Math.sin(state.yaw) * x + Math.cos(state.yaw) * y;
    const away = Math.cos(state.yaw) * x + Math.sin(state.yaw) * y;
    const up = Math.cos(state.pitch) * z - Math.sin(state.pitch) * away;
    return [canvas.width / 2 + scale * across, canvas.height * (1 - MARGIN) - scale * up];
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
    for (let k = -2; k <= 2; k++) {
      line([500 * k, -1000, 0], [500 * k, 1000, 0], FLOOR, 1);
      line([-1000, 500 * k, 0], [1000, 500 * k, 0], FLOOR, 1);
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
    pen.clearRect(0, 0, canvas.width, canvas.height);
    pen.lineCap = "round";
    floor();
    for (let k = 0; k < film.bones; k++) line(pose.bones[2 * k], pose.bones[2 * k + 1], COLOURS[film.sides[k]], 5);
    circle(pose.head, scale * film.head_mm, COLOURS["-"]);
    for (const marker of pose.markers) circle(marker, 3, MARKER);
    if (pose.tip[0] !== MISSING) arrow(pose.foot, pose.tip);
    slider.value = state.frame;
    time.textContent = (film.times_ms[state.frame] / 1000).toFixed(2) + " s";
  }

  function step(now) {
    if (!state.playing) return;
    const at = state.from + now - state.started;
    let frame = film.times_ms.findIndex((t) => t > at) - 1;
    if (frame < 0) frame = film.frames - 1;
    state.frame = frame;
    draw();
    if (frame === film.frames - 1) stop();
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
    state.started = performance.now();
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

  canvas.onpointermove = (event) => {
    if (event.buttons !== 1) return;
    state.yaw -= TURN_PER_PIXEL * event.movementX;
    state.pitch = Math.max(-0.2, Math.min(1.5, state.pitch + TURN_PER_PIXEL * event.movementY));
    draw();
  };
  canvas.onpointerdown = (event) => canvas.setPointerCapture(event.pointerId);
  draw();
}

// Tables: a click on a column's title sorts by it; a button copies the table.

function number(text) {
  const found = text.replace("−", "-").match(/-?\d*\.?\d+/);
  return found ? Number(found[0]) : null;
}

function order(a, b) {
  const x = number(a), y = number(b);
  if (x !== null && y !== null && x !== y) return x - y;
  if ((x === null) !== (y === null)) return x === null ? 1 : -1;
  return a.localeCompare(b);
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
      const rows = [...body.rows].sort((a, b) => (up ? 1 : -1) * order(text(a), text(b)));
      body.append(...rows);
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
    const text = rows.map((row) => [...row.cells].map((cell) => cell.textContent.trim()).join("\t")).join("\n");
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

"use strict";

// ---- decoding: what motion_data.py packs ------------------------------------------------------

const CHANNELS = 9;
const ROOM = 12; // numbers of a Gaussian in the texture: three texels of four

function bytesOf(base64) {
  const text = atob(base64.trim());
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes;
}

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Words of all frames, channel by channel: (T, 9, N).
function wordsOf(header, bytes) {
  const { count, frames } = header;
  if (bytes.length !== 4 * count + 2 * CHANNELS * count * frames) {
    throw new Error("the motion is damaged: " + bytes.length + " bytes");
  }
  const words = new Uint16Array(CHANNELS * count * frames);
  const size = CHANNELS * count;
  for (let t = 0, from = 4 * count; t < frames; t++) {
    for (let channel = 0; channel < CHANNELS; channel++, from += 2 * count) {
      const at = t * size + channel * count;
      for (let i = 0; i < count; i++) {
        const change = bytes[from + i] | (bytes[from + count + i] << 8);
        words[at + i] = change + (t ? words[at - size + i] : 0);
      }
    }
  }
  return words;
}

// Unit quaternion w, x, y, z of three words of 11 bits; bit 11 of two says which one is left out.
function quaternionOf(first, second, third) {
  const largest = (first >> 11) | ((second >> 11) << 1);
  const kept = [first & 2047, second & 2047, third].map((w) => (w / 2047 - 0.5) * Math.SQRT2);
  const rest = 1 - kept[0] * kept[0] - kept[1] * kept[1] - kept[2] * kept[2];
  kept.splice(largest, 0, Math.sqrt(Math.max(rest, 0)));
  return kept;
}

// xx, xy, xz, yy, yz, zz of R S S R^T into out[at...].
function covariance(q, sizes, out, at) {
  const [w, x, y, z] = q;
  const R = [
    1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
    2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
    2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
  ];
  let k = at;
  for (let i = 0; i < 3; i++) {
    for (let j = i; j < 3; j++) {
      let sum = 0;
      for (let a = 0; a < 3; a++) sum += R[3 * i + a] * R[3 * j + a] * sizes[a] * sizes[a];
      out[k++] = sum;
    }
  }
}

// What the shader reads of frame t: place and opacity, covariance, colour in one number.
function frameOf(header, bytes, words, t, out) {
  const { count, low, step } = header;
  const at = t * CHANNELS * count;
  const word = (channel, i) => words[at + channel * count + i];
  const size = (channel, i) => Math.exp(header.size_low + header.size_step * word(channel, i));
  for (let i = 0; i < count; i++) {
    const to = ROOM * i;
    for (let a = 0; a < 3; a++) out[to + a] = low[a] + step[a] * word(a, i);
    out[to + 3] = bytes[3 * count + i] / 255;
    const turn = quaternionOf(word(3, i), word(4, i), word(5, i));
    covariance(turn, [size(6, i), size(7, i), size(8, i)], out, to + 4);
    // 24 bits are exact in a float of 32.
    out[to + 10] = (bytes[i] * 256 + bytes[count + i]) * 256 + bytes[2 * count + i];
    out[to + 11] = 0;
  }
  return out;
}

// ---- order: a counting sort on 16 bits of depth, the farthest first ---------------------------

function orderByDepth(places, count, row) {
  const depths = new Float32Array(count);
  let least = Infinity, most = -Infinity;
  for (let i = 0; i < count; i++) {
    const depth = row[0] * places[3 * i] + row[1] * places[3 * i + 1] + row[2] * places[3 * i + 2];
    depths[i] = depth;
    if (depth < least) least = depth;
    if (depth > most) most = depth;
  }
  const scale = most > least ? 65535 / (most - least) : 0;
  const starts = new Uint32Array(65537);
  const keys = new Uint16Array(count);
  for (let i = 0; i < count; i++) {
    keys[i] = 65535 - Math.round((depths[i] - least) * scale);
    starts[keys[i] + 1]++;
  }
  for (let k = 0; k < 65536; k++) starts[k + 1] += starts[k];
  const order = new Uint32Array(count);
  for (let i = 0; i < count; i++) order[starts[keys[i]]++] = i;
  return order;
}

// Sorts in a worker where the browser allows one of a page from the disk, else at once.
function makeSorter(deliver) {
  let worker = null, busy = false, waiting = null;
  function here(job) {
    deliver(job, orderByDepth(job.places, job.count, job.row));
  }
  function send(job) {
    busy = true;
    worker.postMessage(job);
  }
  try {
    const answer = "onmessage = (e) => { const job = e.data; const order = orderByDepth(" +
      "job.places, job.count, job.row); postMessage({ job, order }, [order.buffer]); };";
    const url = URL.createObjectURL(
      new Blob([orderByDepth.toString() + "\n" + answer], { type: "text/javascript" }));
    worker = new Worker(url);
    URL.revokeObjectURL(url);
    worker.onmessage = (event) => {
      busy = false;
      const next = waiting;
      waiting = null;
      if (next) send(next);
      deliver(event.data.job, event.data.order);
    };
    worker.onerror = (event) => {
      event.preventDefault();
      worker = null;
      if (waiting) here(waiting);
    };
  } catch (error) {
    worker = null;
  }
  return {
    ask(job) {
      if (!worker) here(job);
      else if (busy) waiting = job; // only the newest is worth sorting
      else send(job);
    },
    get threaded() { return worker !== null; },
    stop() { if (worker) worker.terminate(); worker = null; },
  };
}

// ---- camera: x right, y down, z forward; orbits about a target ---------------------------------

function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

// Rows right, down, forward, and the eye.
function cameraOf(view) {
  const [start, side, up] = view.axes;
  const { azimuth, elevation } = view;
  const outwards = [0, 1, 2].map((k) => Math.cos(azimuth) * start[k] + Math.sin(azimuth) * side[k]);
  const forward = [0, 1, 2].map(
    (k) => -(Math.cos(elevation) * outwards[k] + Math.sin(elevation) * up[k]));
  const right = [0, 1, 2].map((k) => Math.cos(azimuth) * side[k] - Math.sin(azimuth) * start[k]);
  const down = cross(forward, right);
  const eye = [0, 1, 2].map((k) => view.target[k] - view.distance * forward[k]);
  return { rows: [right, down, forward], eye };
}

// ---- drawing: EWA splatting (Zwicker et al. 2001) as jaxphys/render does it ---------------------

const WIDTH = 1536; // texels of a row of the texture, a multiple of three
const SPLAT_VERTEX = `#version 300 es
precision highp float;
precision highp int;
uniform highp sampler2D gaussians;
uniform vec3 rows[3];
uniform vec3 eye;
uniform float focal;
uniform vec2 size;
in uint index;
out vec2 away;
flat out vec3 factors;
flat out vec4 shade;
const float LOW_PASS = 0.3, NEAR = 0.01, ALPHA_MIN = 1.0 / 255.0;
void main() {
  int texel = 3 * int(index);
  ivec2 at = ivec2(texel % ${WIDTH}, texel / ${WIDTH});
  vec4 place = texelFetch(gaussians, at, 0);
  vec4 one = texelFetch(gaussians, at + ivec2(1, 0), 0);
  vec4 two = texelFetch(gaussians, at + ivec2(2, 0), 0);
  mat3 S = mat3(one.x, one.y, one.z, one.y, one.w, two.x, one.z, two.x, two.y);
  vec3 offset = place.xyz - eye;
  vec3 p = vec3(dot(rows[0], offset), dot(rows[1], offset), dot(rows[2], offset));
  gl_Position = vec4(2.0, 2.0, 0.0, 1.0);
  if (p.z <= NEAR || place.w < ALPHA_MIN) return;
  vec2 ahead = p.xy / p.z;
  vec2 centre = focal * ahead + 0.5 * size;
  vec2 border = 0.65 * size / focal;
  vec2 held = clamp(ahead, -border, border);
  vec3 across = focal / p.z * (rows[0] - held.x * rows[2]);
  vec3 along = focal / p.z * (rows[1] - held.y * rows[2]);
  vec3 S_across = S * across, S_along = S * along;
  float b = dot(across, S_along);
  float a = dot(across, S_across) + LOW_PASS;
  float c = max(dot(along, S_along), 0.0) + LOW_PASS;
  float schur = max(a - b / c * b, LOW_PASS);
  factors = vec3(inversesqrt(schur), -b / c * inversesqrt(schur), inversesqrt(c));
  float level = 2.0 * log(place.w / ALPHA_MIN);
  vec2 half_size = sqrt(level * vec2(schur + b * b / c, c));
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  away = -corner * half_size;
  vec2 pixel = centre - away;
  int packed_colour = int(two.z);
  shade = vec4(vec3(packed_colour >> 16, (packed_colour >> 8) & 255, packed_colour & 255) / 255.0,
    place.w);
  gl_Position = vec4(2.0 * pixel.x / size.x - 1.0, 1.0 - 2.0 * pixel.y / size.y, 0.0, 1.0);
}`;
const SPLAT_FRAGMENT = `#version 300 es
precision highp float;
in vec2 away;
flat in vec3 factors;
flat in vec4 shade;
out vec4 colour;
void main() {
  float u = factors.x * away.x + factors.y * away.y, v = factors.z * away.y;
  float alpha = min(0.99, shade.a * exp(-0.5 * (u * u + v * v)));
  if (alpha < 1.0 / 255.0) discard;
  colour = vec4(shade.rgb * alpha, alpha);
}`;
const FLOOR_VERTEX = `#version 300 es
void main() {
  gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0, 0.0, 1.0);
}`;
const FLOOR_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 rows[3];
uniform vec3 eye;
uniform float focal;
uniform vec2 size;
uniform vec3 paper;
uniform vec3 floor_colour;
uniform vec4 place; // middle x, middle y, height, extent; no floor where the extent is 0
out vec4 colour;
void main() {
  vec2 pixel = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y);
  vec2 ray = (pixel - 0.5 * size) / focal;
  vec3 through = ray.x * rows[0] + ray.y * rows[1] + rows[2];
  float fade = 0.0;
  if (place.w > 0.0 && through.z < -1e-6 && eye.z > place.z) {
    vec2 met = eye.xy + (place.z - eye.z) / through.z * through.xy - place.xy;
    fade = exp(-min(0.5 * dot(met, met) / (place.w * place.w), 50.0));
  }
  colour = vec4(mix(paper, floor_colour, fade), 1.0);
}`;

function programOf(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
      throw new Error("shader: " + gl.getShaderInfoLog(shader));
    }
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new Error("program: " + gl.getProgramInfoLog(program));
  }
  const places = {};
  const total = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
  for (let i = 0; i < total; i++) {
    const { name } = gl.getActiveUniform(program, i);
    places[name.replace("[0]", "")] = gl.getUniformLocation(program, name);
  }
  return { program, places };
}

function makePainter(canvas, count) {
  const gl = canvas.getContext("webgl2",
    { alpha: false, antialias: false, depth: false, preserveDrawingBuffer: true });
  if (!gl) throw new Error("this browser has no WebGL 2; the film plays all the same");
  const splats = programOf(gl, SPLAT_VERTEX, SPLAT_FRAGMENT);
  const floor = programOf(gl, FLOOR_VERTEX, FLOOR_FRAGMENT);
  const texture = gl.createTexture();
  const height = Math.ceil((3 * count) / WIDTH);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, WIDTH, height);
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
    gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
  }
  const numbers = new Float32Array(4 * WIDTH * height);
  const empty = gl.createVertexArray(), filled = gl.createVertexArray();
  const indices = gl.createBuffer();
  gl.bindVertexArray(filled);
  gl.bindBuffer(gl.ARRAY_BUFFER, indices);
  gl.bufferData(gl.ARRAY_BUFFER, 4 * count, gl.DYNAMIC_DRAW);
  const place = gl.getAttribLocation(splats.program, "index");
  gl.enableVertexAttribArray(place);
  gl.vertexAttribIPointer(place, 1, gl.UNSIGNED_INT, 0, 0);
  gl.vertexAttribDivisor(place, 1);
  gl.disable(gl.DEPTH_TEST);

  function look({ program, places }, camera, focal) {
    gl.useProgram(program);
    gl.uniform3fv(places.rows, camera.rows.flat());
    gl.uniform3fv(places.eye, camera.eye);
    gl.uniform1f(places.focal, focal);
    gl.uniform2f(places.size, canvas.width, canvas.height);
  }
  return {
    numbers,
    upload() {
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, WIDTH, height, gl.RGBA, gl.FLOAT, numbers);
    },
    draw(camera, focal, order, surroundings) {
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.disable(gl.BLEND);
      look(floor, camera, focal);
      gl.uniform3fv(floor.places.paper, surroundings.background);
      gl.uniform3fv(floor.places.floor_colour, surroundings.colour);
      gl.uniform4fv(floor.places.place, surroundings.place);
      gl.bindVertexArray(empty);
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      look(splats, camera, focal);
      gl.uniform1i(splats.places.gaussians, 0);
      gl.bindVertexArray(filled);
      gl.bindBuffer(gl.ARRAY_BUFFER, indices);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, order);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
    },
    stop() {
      const loses = gl.getExtension("WEBGL_lose_context");
      if (loses) loses.loseContext();
    },
  };
}

// ---- one object, playable ------------------------------------------------------------------------

async function openPlayer(card, header, base64, report) {
  const find = (name) => card.querySelector("[data-part=" + name + "]");
  const canvas = document.createElement("canvas");
  canvas.tabIndex = 0;
  canvas.setAttribute("aria-label", "The object in 3D: drag or arrow keys to turn, wheel to zoom");
  find("stage").replaceChildren(canvas);
  const bytes = await inflated(bytesOf(base64));
  const words = wordsOf(header, bytes);
  const painter = makePainter(canvas, header.count);
  const scrub = find("scrub"), play = find("play"), speed = find("speed"), told = find("told");
  const home = JSON.stringify(header.view);
  let view = JSON.parse(home);
  let frame = -1, wanted = 0, playing = false, clock = 0, last = 0, ended = false, shape = "";
  scrub.max = header.frames - 1;

  const sorter = makeSorter((job, order) => {
    if (ended) return;
    if (job.frame !== frame) {
      frame = job.frame;
      frameOf(header, bytes, words, frame, painter.numbers);
      painter.upload();
    }
    painter.draw(job.camera, (0.5 * canvas.width) / Math.tan(0.5 * job.field), order,
      header.surroundings);
    report.frame = frame;
    report.drawn += 1;
    report.threaded = sorter.threaded;
  });
  function placesOf(t) {
    const { count, low, step } = header;
    const places = new Float32Array(3 * count);
    for (let a = 0; a < 3; a++) {
      const at = (t * CHANNELS + a) * count;
      for (let i = 0; i < count; i++) places[3 * i + a] = low[a] + step[a] * words[at + i];
    }
    return places;
  }
  let known = { frame: -1, places: null };
  function show() {
    if (known.frame !== wanted) known = { frame: wanted, places: placesOf(wanted) };
    const camera = cameraOf(view);
    sorter.ask({ frame: wanted, places: known.places, count: header.count, camera,
      row: camera.rows[2], field: view.field });
    scrub.value = wanted;
    told.textContent = "frame " + wanted * header.stride + ", " +
      header.seconds[wanted].toFixed(3) + " s";
  }
  function fit() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(16, Math.round(canvas.clientWidth * ratio));
    const height = Math.max(16, Math.round(width / view.aspect));
    if (shape === width + "x" + height) return false;
    shape = width + "x" + height;
    canvas.width = width;
    canvas.height = height;
    return true;
  }
  function go(t) {
    wanted = Math.max(0, Math.min(header.frames - 1, t));
    clock = (wanted * header.stride) / header.fps;
    show();
  }
  function set(state) {
    playing = state;
    play.textContent = playing ? "Pause" : "Play";
    if (playing && wanted === header.frames - 1) go(0);
    last = 0;
    if (playing) requestAnimationFrame(tick);
  }
  function tick(now) {
    if (!playing || ended) return;
    if (last) clock += ((now - last) / 1000) * Number(speed.value);
    last = now;
    const length = (header.frames * header.stride) / header.fps;
    if (clock >= length) clock %= length;
    const next = Math.min(header.frames - 1, Math.floor((clock * header.fps) / header.stride));
    if (next !== wanted) {
      wanted = next;
      show();
    }
    requestAnimationFrame(tick);
  }
  function turn(x, y) {
    view.azimuth -= x;
    view.elevation = Math.max(-1.55, Math.min(1.55, view.elevation + y));
    show();
  }
  function zoom(factor) {
    view.distance *= factor;
    show();
  }
  function shift(x, y) {
    const { rows } = cameraOf(view);
    const length = (2 * view.distance * Math.tan(0.5 * view.field)) / canvas.clientWidth;
    for (let k = 0; k < 3; k++) {
      view.target[k] -= length * (x * rows[0][k] + y * rows[1][k]);
    }
    show();
  }
  let held = null;
  canvas.onpointerdown = (event) => {
    canvas.setPointerCapture(event.pointerId);
    held = [event.clientX, event.clientY, event.button === 2 || event.shiftKey];
  };
  canvas.onpointermove = (event) => {
    if (!held) return;
    const x = event.clientX - held[0], y = event.clientY - held[1];
    held = [event.clientX, event.clientY, held[2]];
    if (held[2]) shift(x, y);
    else turn(0.008 * x, 0.008 * y);
  };
  canvas.onpointerup = canvas.onpointercancel = () => { held = null; };
  canvas.oncontextmenu = (event) => event.preventDefault();
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(0.001 * Math.max(-300, Math.min(300, event.deltaY))));
  }, { passive: false });
  const keys = {
    ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0),
    ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
    "+": () => zoom(0.9), "-": () => zoom(1.1), " ": () => set(!playing),
  };
  canvas.onkeydown = (event) => {
    if (!keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  };
  play.onclick = () => set(!playing);
  scrub.oninput = () => {
    set(false);
    go(Number(scrub.value));
  };
  find("reset").onclick = () => {
    view = JSON.parse(home);
    show();
  };
  const watcher = new ResizeObserver(() => { if (fit()) show(); });
  watcher.observe(canvas);
  for (const control of [play, scrub, speed, find("reset")]) control.disabled = false;
  fit();
  go(0);
  return {
    go,
    close() {
      ended = true;
      playing = false;
      watcher.disconnect();
      sorter.stop();
      painter.stop();
      for (const control of [play, scrub, speed, find("reset")]) control.disabled = true;
      play.textContent = "Play";
    },
  };
}

// ---- the page --------------------------------------------------------------------------------------

function content(name) {
  return document.getElementById(name).textContent;
}

function openPage() {
  const report = { frame: -1, drawn: 0, threaded: null, errors: [] };
  window.jaxphysPage = report;
  let open = null;
  const cards = [...document.querySelectorAll("[data-card]")];
  for (const card of cards) {
    const number = card.dataset.card;
    const film = card.querySelector("video");
    film.src = URL.createObjectURL(new Blob([bytesOf(content("film-" + number))],
      { type: "video/mp4" }));
    const button = card.querySelector("[data-part=open]");
    const start = async () => {
      if (open) {
        open.player.close();
        open.closed();
        open = null;
      }
      button.disabled = true;
      try {
        const header = JSON.parse(content("motion-" + number));
        const player = await openPlayer(card, header, content("data-" + number), report);
        open = { player, closed: () => {
          card.querySelector("[data-part=stage]").replaceChildren(button);
          button.disabled = false;
        } };
        report.go = player.go;
      } catch (error) {
        report.errors.push(String(error));
        const line = document.createElement("p");
        line.textContent = error.message;
        card.querySelector("[data-part=stage]").replaceChildren(line);
      }
    };
    button.onclick = start;
    if (card === cards[0]) start();
  }
}

if (typeof document !== "undefined") openPage();
if (typeof module !== "undefined") {
  module.exports = { bytesOf, inflated, wordsOf, quaternionOf, covariance, frameOf, orderByDepth,
    cameraOf, ROOM };
}

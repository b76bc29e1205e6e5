// Plays a scene: see page.py for what is in `SCENE` and in the packed numbers.
const WIDTH = 4096;  // of textures that hold a list

const TYPES = { f4: Float32Array, f2: Uint16Array, u4: Uint32Array, u1: Uint8Array };

async function unpacked() {
  const text = document.getElementById("numbers").textContent.trim();
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(stream).arrayBuffer();
  return Object.fromEntries(Object.entries(SCENE.arrays).map(([name, { type, start, count }]) => [
    name, new TYPES[type](buffer, start, count)]));
}

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  const uniform = {};
  for (let i = 0; i < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); i++) {
    const { name } = gl.getActiveUniform(made, i);
    uniform[name] = gl.getUniformLocation(made, name);
  }
  return { made, uniform };
}

function texture(gl, filter) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, filter);
  for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
  return made;
}

function listTexture(gl, values, channels, inner, outer, type) {
  const height = Math.max(1, Math.ceil(values.length / channels / WIDTH));
  if (height > gl.getParameter(gl.MAX_TEXTURE_SIZE)) throw new Error("the scene is too large for this browser");
  const filled = new values.constructor(WIDTH * height * channels);
  filled.set(values);
  const made = texture(gl, gl.NEAREST);
  gl.texImage2D(gl.TEXTURE_2D, 0, inner, WIDTH, height, 0, outer, type, filled);
  return made;
}

// --- Poses and times: column-major matrices for WebGL are made of rows where they are used. ---

const between = (times, t) => {
  let i = 0;
  while (i < times.length - 2 && times[i + 1] <= t) i++;
  const step = times.length > 1 ? times[i + 1] - times[i] : 1;
  return [i, times.length > 1 ? Math.min(1, Math.max(0, (t - times[i]) / step)) : 0];
};
const lerp = (a, b, u) => a.map((each, i) => each + (b[i] - each) * u);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const scaled = (a, by) => a.map((each) => each * by);
const plus = (a, b) => a.map((each, i) => each + b[i]);
const unit = (a) => scaled(a, 1 / Math.hypot(...a));
const turned = (v, axis, angle) => plus(plus(scaled(v, Math.cos(angle)), scaled(cross(axis, v), Math.sin(angle))),
  scaled(axis, dot(axis, v) * (1 - Math.cos(angle))));

/** A pose as its place and its three axes in the world: right, down and ahead. */
const poseOf = (m) => ({ place: [m[3], m[7], m[11]], axes: [0, 1, 2].map((k) => [m[k], m[4 + k], m[8 + k]]) });

function recorded(t) {
  const [i, u] = between(SCENE.path_s, t);
  const a = poseOf(SCENE.path[i]), b = poseOf(SCENE.path[Math.min(i + 1, SCENE.path.length - 1)]);
  const ahead = unit(lerp(a.axes[2], b.axes[2], u));
  const right = unit(cross(lerp(a.axes[1], b.axes[1], u), ahead));
  return { place: lerp(a.place, b.place, u), axes: [right, cross(ahead, right), ahead] };
}

function exposure(t) {
  if (!SCENE.exposure) return [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];
  const { times_s, transforms } = SCENE.exposure, [i, u] = between(times_s, t);
  return lerp(transforms[i], transforms[Math.min(i + 1, transforms.length - 1)], u);
}

// --- Drawing ---

class Painter {
  constructor(canvas, numbers) {
    this.gl = canvas.getContext("webgl2", { antialias: false, alpha: false, preserveDrawingBuffer: true });
    if (!this.gl) throw new Error("this browser has no WebGL 2");
    const gl = this.gl, n = numbers;
    this.canvas = canvas;
    this.numbers = n;
    this.floats = gl.getExtension("EXT_color_buffer_float") || gl.getExtension("EXT_color_buffer_half_float");
    this.splat = program(gl, SPLAT_VERTEX, SPLAT_FRAGMENT);
    this.finish = program(gl, FINISH_VERTEX, FINISH_FRAGMENT);
    this.lists = {
      uRows: listTexture(gl, n.rows, 4, gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT),
      uLives: listTexture(gl, n.lives, 2, gl.RG32F, gl.RG, gl.FLOAT),
      uPlaces: listTexture(gl, n.places, 3, gl.RGB32F, gl.RGB, gl.FLOAT),
      uTurns: listTexture(gl, n.turns, 4, gl.RGBA16F, gl.RGBA, gl.HALF_FLOAT),
      uSizes: listTexture(gl, n.sizes, 3, gl.RGB16F, gl.RGB, gl.HALF_FLOAT),
      uColours: listTexture(gl, n.colours, 3, gl.RGB16F, gl.RGB, gl.HALF_FLOAT),
    };
    if (SCENE.sky) {
      this.sky = texture(gl, gl.LINEAR);
      gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB8, ...SCENE.sky.size, 0, gl.RGB, gl.UNSIGNED_BYTE, n.sky);
    }
    this.count = n.rows.length / 4;
    this.order = new Uint32Array(this.count);
    this.keys = new Uint32Array(this.count);
    this.shown = new Uint32Array(this.count);
    this.bins = new Uint32Array(1 << 18);
    this.depth = new Float32Array(1);
    this.bits = new Uint32Array(this.depth.buffer);
    this.array = gl.createVertexArray();
    this.empty = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    this.instances = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    gl.bufferData(gl.ARRAY_BUFFER, Math.max(4, this.order.byteLength), gl.DYNAMIC_DRAW);
    const place = gl.getAttribLocation(this.splat.made, "aGaussian");
    gl.enableVertexAttribArray(place);
    gl.vertexAttribIPointer(place, 1, gl.UNSIGNED_INT, 0, 0);
    gl.vertexAttribDivisor(place, 1);
    this.target = gl.createFramebuffer();
  }

  /** Numbers of the Gaussians that are alive and in view, farthest first. */
  sorted(t, view, pinhole) {
    const { rows, lives, places } = this.numbers, [moment, share] = between(SCENE.moments_s, t);
    const [rx, ry, rz] = view.axes, p = view.place, bins = this.bins.fill(0);
    const wide = 1.6 * Math.max(pinhole.cx, pinhole.width - pinhole.cx) / pinhole.fx + 0.3;
    const tall = 1.6 * Math.max(pinhole.cy, pinhole.height - pinhole.cy) / pinhole.fy + 0.3;
    let found = 0;
    for (let i = 0; i < this.count; i++) {
      const deviation = lives[2 * i + 1];
      if (deviation > 0 && Math.abs(t - lives[2 * i]) > 3.4 * deviation) continue;
      const offset = rows[4 * i], first = rows[4 * i + 1], last = rows[4 * i + 2];
      const here = Math.min(Math.max(moment, first), last), next = Math.min(Math.max(moment + 1, first), last);
      const a = 3 * (offset + here - first), b = 3 * (offset + next - first);
      const x = places[a] + (places[b] - places[a]) * share - p[0];
      const y = places[a + 1] + (places[b + 1] - places[a + 1]) * share - p[1];
      const z = places[a + 2] + (places[b + 2] - places[a + 2]) * share - p[2];
      const depth = rz[0] * x + rz[1] * y + rz[2] * z;
      if (depth < 0.2) continue;
      // Large ones reach into the picture from beside it; those near, where they are largest, always count.
      if (depth > 3 && (Math.abs(rx[0] * x + rx[1] * y + rx[2] * z) > wide * depth
        || Math.abs(ry[0] * x + ry[1] * y + ry[2] * z) > tall * depth)) continue;
      this.depth[0] = depth;
      // The bits of a positive number grow with it.
      const key = Math.min((this.bits[0] - 0x3e4ccccd) >>> 10, (1 << 18) - 1);
      this.keys[found] = key;
      this.shown[found++] = i;
      bins[key]++;
    }
    for (let k = bins.length - 1, at = 0; k >= 0; k--) { const own = bins[k]; bins[k] = at; at += own; }
    // Of equal depth the first one is in front, thus drawn last.
    for (let k = found - 1; k >= 0; k--) this.order[bins[this.keys[k]]++] = this.shown[k];
    return { found, moment, share };
  }

  resize(width, height) {
    const gl = this.gl;
    if (this.canvas.width !== width || this.canvas.height !== height || !this.splats) {
      this.canvas.width = width;
      this.canvas.height = height;
      gl.deleteTexture(this.splats);
      this.splats = texture(gl, gl.NEAREST);
      gl.texStorage2D(gl.TEXTURE_2D, 1, this.floats ? gl.RGBA16F : gl.RGBA8, width, height);
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.splats, 0);
    }
    gl.viewport(0, 0, width, height);
  }

  draw(t, view, pinhole) {
    const gl = this.gl, { found, moment, share } = this.sorted(t, view, pinhole);
    this.resize(pinhole.width, pinhole.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.useProgram(this.splat.made);
    const u = this.splat.uniform;
    Object.entries(this.lists).forEach(([name, list], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, list);
      gl.uniform1i(u[name], unit);
    });
    const [right, down, ahead] = view.axes, p = view.place;
    gl.uniformMatrix4fv(u.uCameraFromWorld, false, [
      ...[0, 1, 2].flatMap((k) => [right[k], down[k], ahead[k], 0]),
      -dot(right, p), -dot(down, p), -dot(ahead, p), 1]);
    gl.uniform1i(u.uCoefficients, SCENE.coefficients);
    gl.uniform1i(u.uMoment, moment);
    gl.uniform1f(u.uShare, share);
    gl.uniform1f(u.uTime, t);
    gl.uniform3f(u.uEye, ...p);
    this.setPinhole(u, pinhole);
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.order, 0, found);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    if (found) gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, found);
    gl.disable(gl.BLEND);
    this.finished(t, view, pinhole);
  }

  setPinhole(u, pinhole) {
    this.gl.uniform2f(u.uFocal, pinhole.fx, pinhole.fy);
    this.gl.uniform2f(u.uCentre, pinhole.cx, pinhole.cy);
    this.gl.uniform2f(u.uSize, pinhole.width, pinhole.height);
  }

  finished(t, view, pinhole) {
    const gl = this.gl, u = this.finish.uniform, e = exposure(t);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.useProgram(this.finish.made);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.splats);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.sky || this.splats);
    gl.uniform1i(u.uSplats, 0);
    gl.uniform1i(u.uSky, 1);
    gl.uniform1i(u.uHasSky, this.sky ? 1 : 0);
    if (SCENE.sky) {
      gl.uniform2f(u.uAzimuth, ...SCENE.sky.azimuth_rad);
      gl.uniform2f(u.uElevation, ...SCENE.sky.elevation_rad);
    }
    gl.uniformMatrix3fv(u.uWorldFromCamera, false, view.axes.flat());
    gl.uniformMatrix4x3fv(u.uExposure, false, [0, 1, 2, 3].flatMap((k) => [e[k], e[4 + k], e[8 + k]]));
    this.setPinhole(u, pinhole);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** What was drawn last, rows from the top: RGB as bytes, and the share that Gaussians cover. */
  picture() {
    const gl = this.gl, { width, height } = this.canvas, size = width * height;
    const seen = new Uint8Array(4 * size), splats = this.floats ? new Float32Array(4 * size) : new Uint8Array(4 * size);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, seen);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.readPixels(0, 0, width, height, gl.RGBA, this.floats ? gl.FLOAT : gl.UNSIGNED_BYTE, splats);
    const rgb = [], alpha = [];
    for (let y = 0; y < height; y++)
      for (let x = 0; x < width; x++) {
        const at = 4 * ((height - 1 - y) * width + x);
        rgb.push(seen[at], seen[at + 1], seen[at + 2]);
        alpha.push(splats[4 * (y * width + x) + 3] / (this.floats ? 1 : 255));
      }
    return { width, height, rgb, alpha };
  }
}

// --- What people do ---

const byId = (id) => document.getElementById(id);
const state = { time_s: 0, playing: true, free: null, keys: new Set(), drawn: "" };

/** The recorded pinhole, so large that the whole picture fits in. */
function fitted(width, height) {
  const c = SCENE.camera, by = Math.min(width / c.width_px, height / c.height_px);
  return {
    fx: c.fx_px * by, fy: c.fy_px * by, width, height,
    cx: width / 2 + (c.cx_px - c.width_px / 2) * by, cy: height / 2 + (c.cy_px - c.height_px / 2) * by,
  };
}

function fromFragment() {
  const given = new URLSearchParams(location.hash.slice(1)), number = (name) => Number(given.get(name)) || 0;
  if (given.has("t")) {
    state.time_s = Math.min(Math.max(number("t") - SCENE.start_s, 0), SCENE.length_s);
    state.playing = false;
  }
  document.body.classList.toggle("plain", given.has("plain"));
  state.aside = ["right", "down", "ahead"].map(number);
}

function view() {
  if (state.free) return state.free;
  const at = recorded(state.time_s);
  const place = state.aside.reduce((sum, far, k) => plus(sum, scaled(at.axes[k], far)), at.place);
  return { ...at, place };
}

function leave() {
  if (!state.free) state.free = view();
  return state.free;
}

function look(dx, dy, about) {
  const from = leave(), rate = 0.003, far = about ? 10 : 0;
  const centre = plus(from.place, scaled(from.axes[2], far));
  const sign = about ? 1 : -1;  // a point is turned, or the eye
  const axes = from.axes.map((axis) => turned(turned(axis, SCENE.up, sign * -rate * dx), from.axes[0], sign * rate * dy));
  state.free = { axes, place: plus(centre, scaled(axes[2], -far)) };
}

function fly(seconds) {
  const step = (state.keys.has("shift") ? 15 : 4) * seconds;
  const ways = { w: [2, 1], s: [2, -1], d: [0, 1], a: [0, -1], q: [1, 1], e: [1, -1],
    arrowup: [2, 1], arrowdown: [2, -1], arrowright: [0, 1], arrowleft: [0, -1] };
  for (const [key, [axis, sign]] of Object.entries(ways))
    if (state.keys.has(key)) {
      const from = leave();
      state.free = { ...from, place: plus(from.place, scaled(from.axes[axis], sign * step)) };
    }
}

function listen(canvas) {
  canvas.onpointerdown = (e) => { canvas.setPointerCapture(e.pointerId); };
  canvas.onpointermove = (e) => {
    if (e.buttons) look(e.movementX, e.movementY, e.shiftKey || e.buttons === 2);
  };
  canvas.oncontextmenu = (e) => e.preventDefault();
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    const from = leave();
    state.free = { ...from, place: plus(from.place, scaled(from.axes[2], -0.01 * e.deltaY)) };
  }, { passive: false });
  window.onkeydown = (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    if (e.key === " ") { e.preventDefault(); play(!state.playing); }
    else if (e.target.tagName !== "INPUT") state.keys.add(e.key.toLowerCase());
  };
  window.onkeyup = (e) => state.keys.delete(e.key.toLowerCase());
  window.onblur = () => state.keys.clear();
  window.onhashchange = () => { state.free = null; fromFragment(); play(state.playing); };
  byId("play").onclick = () => play(!state.playing);
  byId("drive").onclick = () => { state.free = null; state.aside = [0, 0, 0]; };
  byId("time").oninput = (e) => { play(false); state.time_s = Number(e.target.value); };
}

function play(on) {
  state.playing = on && SCENE.length_s > 0;
  byId("play").textContent = state.playing ? "Pause" : "Play";
}

function run(painter) {
  let before = performance.now();
  const frame = (now) => {
    const seconds = Math.min(0.1, (now - before) / 1000);
    before = now;
    fly(seconds);
    if (state.playing) state.time_s = (state.time_s + seconds) % SCENE.length_s;
    const by = Math.min(window.devicePixelRatio, 1.5);
    const pinhole = fitted(Math.max(1, Math.round(innerWidth * by)), Math.max(1, Math.round(innerHeight * by)));
    const seen = view(), what = JSON.stringify([state.time_s, seen, pinhole]);
    if (what !== state.drawn) {
      painter.draw(state.time_s, seen, pinhole);
      state.drawn = what;
      byId("time").value = state.time_s;
      byId("clock").textContent = `${(state.time_s + SCENE.start_s).toFixed(2)} s`;
      byId("drive").disabled = !state.free && state.aside.every((far) => far === 0);
    }
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}

async function start() {
  const canvas = byId("picture");
  byId("time").max = SCENE.length_s;
  document.title = SCENE.title;
  const painter = new Painter(canvas, await unpacked());
  fromFragment();
  play(state.playing);
  listen(canvas);
  // For scripts: the scene's own seconds, a pose as 16 numbers row by row, a pinhole in pixels.
  window.dreamdrive = {
    scene: SCENE,
    draw({ time_s, world_from_camera, camera }) {
      const c = camera || SCENE.camera;
      const pinhole = { fx: c.fx_px, fy: c.fy_px, cx: c.cx_px, cy: c.cy_px, width: c.width_px, height: c.height_px };
      const t = time_s - SCENE.start_s;
      painter.draw(t, world_from_camera ? poseOf(world_from_camera) : recorded(t), pinhole);
      state.drawn = "";
      return painter.picture();
    },
  };
  run(painter);
}

start().catch((error) => { byId("said").textContent = `This scene cannot be shown: ${error.message}.`; });

#include "viewer.h"

#include <fmt/format.h>

#include "costate/record/svg_plot.h"
#include "gltf.h"

namespace costate::app {

namespace {

/// Shows the glTF of the page by WebGL: what gltf.h writes, nothing more of the format.
constexpr const char* kViewer = R"js(
'use strict';
(function () {
  const gltf = JSON.parse(document.getElementById('gltf').textContent);
  const canvas = document.getElementById('view'), slider = document.getElementById('time'),
        button = document.getElementById('play'), label = document.getElementById('label');
  const gl = canvas.getContext('webgl', {antialias: true});
  if (!gl) return;  // the drawing stays
  document.getElementById('viewer').hidden = false;
  document.getElementById('still').hidden = true;
  gl.getExtension('OES_element_index_uint');
  const bytes = Uint8Array.from(atob(gltf.buffers[0].uri.split(',')[1]), c => c.charCodeAt(0)).buffer;
  const widths = {SCALAR: 1, VEC3: 3, VEC4: 4};
  const numbers = i => {
    const a = gltf.accessors[i], v = gltf.bufferViews[a.bufferView], n = a.count * widths[a.type];
    return a.componentType === 5126 ? new Float32Array(bytes, v.byteOffset, n) : new Uint32Array(bytes, v.byteOffset, n);
  };

  // Column-major matrices.
  const multiply = (a, b) => {
    const c = new Float32Array(16);
    for (let i = 0; i < 4; ++i) for (let j = 0; j < 4; ++j) {
      let sum = 0;
      for (let k = 0; k < 4; ++k) sum += a[4 * k + i] * b[4 * j + k];
      c[4 * j + i] = sum;
    }
    return c;
  };
  const placed = (t, q, s) => {
    const [x, y, z, w] = q;
    return new Float32Array([
      s[0] * (1 - 2 * (y * y + z * z)), s[0] * 2 * (x * y + z * w), s[0] * 2 * (x * z - y * w), 0,
      s[1] * 2 * (x * y - z * w), s[1] * (1 - 2 * (x * x + z * z)), s[1] * 2 * (y * z + x * w), 0,
      s[2] * 2 * (x * z + y * w), s[2] * 2 * (y * z - x * w), s[2] * (1 - 2 * (x * x + y * y)), 0,
      t[0], t[1], t[2], 1]);
  };

  const program = gl.createProgram();
  for (const [kind, source] of [
    [gl.VERTEX_SHADER, 'attribute vec3 position, normal; uniform mat4 model, view; uniform vec3 size; varying vec3 n;' +
      'void main() { n = mat3(model) * (normal / (size * size)); gl_Position = view * model * vec4(position, 1.0); }'],
    [gl.FRAGMENT_SHADER, 'precision mediump float; uniform vec4 color; uniform vec3 light; varying vec3 n;' +
      'void main() { float s = 0.45 + 0.55 * abs(dot(normalize(n), light));' +
      'gl_FragColor = vec4(pow(color.rgb * s, vec3(0.4545)) * color.a, color.a); }']]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  gl.useProgram(program);
  const uniform = {};
  for (const name of ['model', 'view', 'size', 'color', 'light']) uniform[name] = gl.getUniformLocation(program, name);
  const attribute = {position: gl.getAttribLocation(program, 'position'), normal: gl.getAttribLocation(program, 'normal')};
  gl.enableVertexAttribArray(attribute.position);
  gl.enableVertexAttribArray(attribute.normal);
  gl.enable(gl.DEPTH_TEST);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);

  const buffers = {};
  const buffer = (i, target) => {
    if (!buffers[i]) {
      buffers[i] = gl.createBuffer();
      gl.bindBuffer(target, buffers[i]);
      gl.bufferData(target, numbers(i), gl.STATIC_DRAW);
    }
    return buffers[i];
  };

  const channels = {};
  let times = new Float32Array([0]);
  for (const c of gltf.animations ? gltf.animations[0].channels : []) {
    const sampler = gltf.animations[0].samplers[c.sampler];
    times = numbers(sampler.input);
    channels[c.target.node + c.target.path] = numbers(sampler.output);
  }
  const at = (node, path, t) => {
    const all = channels[node + path], n = path === 'rotation' ? 4 : 3;
    if (!all) return gltf.nodes[node][path] || {translation: [0, 0, 0], rotation: [0, 0, 0, 1], scale: [1, 1, 1]}[path];
    let low = 0, high = times.length - 1;
    while (high - low > 1) { const middle = (low + high) >> 1; if (times[middle] <= t) low = middle; else high = middle; }
    const f = high > low ? Math.min(1, Math.max(0, (t - times[low]) / (times[high] - times[low]))) : 0;
    const r = [];
    for (let k = 0; k < n; ++k) r.push(all[n * low + k] * (1 - f) + all[n * high + k] * f);
    if (n === 4) { const size = Math.hypot(...r); for (let k = 0; k < 4; ++k) r[k] /= size; }  // samples are near each other
    return r;
  };

  // The room that the motion takes, for the camera. What travels far is followed.
  const root = placed([0, 0, 0], gltf.nodes[0].rotation || [0, 0, 0, 1], [1, 1, 1]);
  const place = (node, t) => {
    const p = at(node, 'translation', t);
    return [0, 1, 2].map(k => root[k] * p[0] + root[4 + k] * p[1] + root[8 + k] * p[2]);
  };
  const moving = [];
  for (let node = 1; node < gltf.nodes.length; ++node) if (channels[node + 'translation']) moving.push(node);
  const middle = t => {
    const sum = [0, 0, 0];
    for (const node of moving) place(node, t).forEach((x, k) => { sum[k] += x / moving.length; });
    return sum;
  };
  const room = some => {
    const low = [1e30, 1e30, 1e30], high = [-1e30, -1e30, -1e30];
    for (let node = 1; node < gltf.nodes.length; ++node)
      for (const t of some)
        place(node, t).forEach((x, k) => { low[k] = Math.min(low[k], x); high[k] = Math.max(high[k], x); });
    return {low, high, extent: Math.max(...high.map((x, k) => x - low[k]), 1e-3)};
  };
  const all = room(times.filter((t, i) => i % Math.max(1, times.length >> 4) === 0)), start = room([times[0]]);
  const follows = moving.length > 0 && all.extent > 3 * start.extent;
  const {low, high, extent} = follows ? start : all;
  const target = low.map((x, k) => (x + high[k]) / 2), from = middle(times[0]);
  const flat = all.high[2] - all.low[2] < 1e-6 * all.extent;
  let turn = flat ? 0 : 0.7, tilt = flat ? 0 : 0.4, distance = 1.9 * extent;

  let t = 0, playing = true, last = 0;
  const camera = () => {
    const aspect = canvas.width / canvas.height, near = distance / 50, far = distance * 20, f = 1.8;
    const c = Math.cos(turn), s = Math.sin(turn), e = Math.cos(tilt), d = Math.sin(tilt);
    const right = [c, 0, -s], up = [-s * d, e, -c * d], back = [s * e, d, c * e];
    const here = follows ? middle(t) : from;
    const eye = target.map((x, k) => x + here[k] - from[k] + distance * back[k]);
    const dot = v => -(v[0] * eye[0] + v[1] * eye[1] + v[2] * eye[2]);
    const view = [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0, dot(right), dot(up), dot(back), 1];
    const lens = [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
    gl.uniform3fv(uniform.light, back.map((x, k) => 0.8 * x + 0.5 * up[k] + 0.33 * right[k]));
    return multiply(lens, view);
  };

  const draw = () => {
    const wide = Math.round(canvas.clientWidth * devicePixelRatio), tall = Math.round(canvas.clientHeight * devicePixelRatio);
    if (canvas.width !== wide || canvas.height !== tall) { canvas.width = wide; canvas.height = tall; }
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(uniform.view, false, camera());
    for (const clear of [false, true]) {  // what can be looked through comes last
      (clear ? gl.enable : gl.disable).call(gl, gl.BLEND);
      gl.depthMask(!clear);
      for (let node = 1; node < gltf.nodes.length; ++node) {
        const p = gltf.meshes[gltf.nodes[node].mesh].primitives[0], color = gltf.materials[p.material].pbrMetallicRoughness.baseColorFactor;
        if (clear !== color[3] < 1) continue;
        const size = at(node, 'scale', t);
        gl.uniformMatrix4fv(uniform.model, false, multiply(root, placed(at(node, 'translation', t), at(node, 'rotation', t), size)));
        gl.uniform3fv(uniform.size, size);
        gl.uniform4fv(uniform.color, color);
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer(p.attributes.POSITION, gl.ARRAY_BUFFER));
        gl.vertexAttribPointer(attribute.position, 3, gl.FLOAT, false, 0, 0);
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer(p.attributes.NORMAL, gl.ARRAY_BUFFER));
        gl.vertexAttribPointer(attribute.normal, 3, gl.FLOAT, false, 0, 0);
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer(p.indices, gl.ELEMENT_ARRAY_BUFFER));
        gl.drawElements(gl.TRIANGLES, gltf.accessors[p.indices].count, gl.UNSIGNED_INT, 0);
      }
    }
    gl.depthMask(true);
    label.textContent = 't = ' + (times[0] + t).toPrecision(4) + ' s';
  };
  const end = times[times.length - 1];
  slider.max = end;
  slider.step = end / 1000 || 1;
  slider.oninput = () => { playing = false; button.textContent = 'Play'; t = Number(slider.value); draw(); };
  button.onclick = () => { playing = !playing; button.textContent = playing ? 'Pause' : 'Play'; };
  canvas.onpointerdown = e => canvas.setPointerCapture(e.pointerId);
  canvas.onpointermove = e => {
    if (!e.buttons) return;
    if (e.shiftKey || e.buttons === 2) {
      const k = distance / canvas.clientHeight;
      target[0] -= k * e.movementX * Math.cos(turn);
      target[2] += k * e.movementX * Math.sin(turn);
      target[1] += k * e.movementY;
    } else {
      turn -= e.movementX / 150;
      tilt = Math.min(1.55, Math.max(-1.55, tilt + e.movementY / 150));
    }
    draw();
  };
  canvas.oncontextmenu = e => e.preventDefault();
  canvas.onwheel = e => { e.preventDefault(); distance *= Math.exp(e.deltaY / 800); draw(); };
  const frame = now => {
    if (playing && end > 0) {
      t = (t + Math.min(0.1, (now - last) / 1000)) % end;
      slider.value = t;
    }
    if (playing) draw();
    last = now;
    requestAnimationFrame(frame);
  };
  draw();
  document.body.dataset.drawn = gltf.nodes.length - 1;
  requestAnimationFrame(frame);
})();
)js";

constexpr const char* kViewerStyle =
    "body { font-family: sans-serif; color: #222222; max-width: 1180px; margin: 1em auto; padding: 0 1em; }\n"
    "canvas { width: 100%; height: 70vh; border: 1px solid #cccccc; touch-action: none; display: block; }\n"
    "#time { width: 60%; vertical-align: middle; } #label { margin-left: 1em; }\n";

}  // namespace

std::string viewer_page(const Stage& stage, const std::string& title, const std::string& drawing) {
  std::string data = gltf_text(stage, title);
  // What would end the element: in JSON the same string.
  for (std::size_t at = 0; (at = data.find("</", at)) != std::string::npos; at += 3) data.replace(at, 2, "<\\/");
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<title>{0}</title>\n"
      "<style>\n{1}</style>\n</head>\n<body>\n<h1>{0}</h1>\n<div id=\"viewer\" hidden=\"hidden\">\n"
      "<canvas id=\"view\"></canvas>\n<p><button id=\"play\">Pause</button> "
      "<input id=\"time\" type=\"range\" min=\"0\" value=\"0\"/><span id=\"label\"></span></p>\n"
      "<p>Drag to turn, drag with Shift to move, wheel to come nearer.</p>\n</div>\n<div id=\"still\">\n{2}</div>\n"
      "<script id=\"gltf\" type=\"application/json\">{3}</script>\n<script>{4}</script>\n</body>\n</html>\n",
      xml_escaped(title), kViewerStyle, drawing, data, kViewer);
}

}  // namespace costate::app
